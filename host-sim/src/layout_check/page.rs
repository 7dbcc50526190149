//! The report of a check.

use super::{Check, CheckOptions, Finding};
use agv_core::geometry::Point;

use crate::report::{Cell, FigureError, HeatMap, LineSet, Page, PointSet, Table, heat_map};

/// Limits of the expected standard deviation of the position that are told apart, m, and what they mean.
const DEVIATIONS: [(f64, &str); 7] = [
    (0.002, "up to 2 mm"),
    (0.003, "up to 3 mm"),
    (0.005, "up to 5 mm"),
    (0.01, "up to 1 cm"),
    (0.02, "up to 2 cm"),
    (0.05, "up to 5 cm"),
    (f64::INFINITY, "more, or none"),
];

/// Shares of places where a vehicle finds itself, from which a layout is good, and partly so.
const GOOD: f64 = 0.98;
const PARTLY: f64 = 0.9;

/// Limits of the number of reflectors.
const COUNTS: [(usize, &str); 7] =
    [(1, "none or 1"), (2, "2"), (3, "3"), (4, "4"), (6, "5 or 6"), (8, "7 or 8"), (usize::MAX, "9 and more")];

/// What is drawn of a layout.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    /// Where the reflectors are, m.
    pub positions: &'a [Point],
    /// Their names.
    pub names: &'a [String],
    /// Both ends of each line of the drawing, as of walls, m.
    pub lines: &'a [[[f64; 2]; 2]],
}

/// A page with the pictures of a check.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(name: &str, plan: &Plan, options: &CheckOptions, check: &Check) -> Result<Page, FigureError> {
    let mut page = Page::new(&format!("Layout {name}"));
    let unique = format!("{:.1} %", 100.0 * check.unique_share);
    let is_good = check.unique_share >= GOOD && check.close_pairs.is_empty();
    let class = if is_good {
        "good"
    } else if check.unique_share >= PARTLY {
        "partly"
    } else {
        "poor"
    };
    page.verdict(class, &format!("A vehicle that is switched on finds itself at {unique} of the places."));
    page.section("Summary").table(&Table { heading: Vec::new(), rows: check.rows() });
    let warnings = check.warnings();
    if !warnings.is_empty() {
        page.section("Warnings");
        warnings.iter().for_each(|warning| {
            page.paragraph(warning);
        });
    }
    let points: Vec<(f64, f64)> = plan.positions.iter().map(|position| (position.x, position.y)).collect();
    let reflectors = PointSet { name: "reflectors", points: &points };
    let cells = |class: &dyn Fn(&super::CheckedPlace) -> usize| -> Vec<Cell> {
        check.looked.iter().map(|place| Cell { x: place.x_m, y: place.y_m, class: class(place) }).collect()
    };
    let by_deviation = cells(&|place| {
        let deviation = place.position_deviation_m.unwrap_or(f64::INFINITY);
        DEVIATIONS.iter().position(|(limit, _)| deviation <= *limit).unwrap_or(DEVIATIONS.len() - 1)
    });
    // The more the better: the classes run the other way.
    let by_count = cells(&|place| {
        COUNTS.len() - 1 - COUNTS.iter().position(|(limit, _)| place.seen <= *limit).unwrap_or(COUNTS.len() - 1)
    });
    let by_answer = cells(&|place| match place.finding {
        Finding::Unique => 0,
        Finding::Unknown => 4,
        Finding::Resembles { .. } => 5,
        Finding::TooFew => 6,
    });
    let deviations = DEVIATIONS.map(|(_, name)| name);
    let mut counts = COUNTS.map(|(_, name)| name);
    counts.reverse();
    let answers = ["finds itself", "", "", "", "no clear answer", "may be elsewhere", "too few seen"];
    let lines = near(plan.lines, plan.positions, options.farthest);
    let walls = LineSet { name: "lines of the drawing", lines: &lines };
    let draw = |cells: &[Cell], classes: &[&str]| {
        heat_map(&HeatMap {
            cells,
            size: options.spacing,
            classes,
            lines: walls,
            points: reflectors,
            names: plan.names,
        })
    };
    let (beside, kept) = (plan.lines.len(), lines.len());
    if kept < beside {
        page.paragraph(&format!(
            "Of {beside} lines of the drawing the pictures show the longest {kept} within reach of the reflectors."
        ));
    }
    page.section("How well the pose is determined");
    page.figure(
        &draw(&by_deviation, &deviations)?,
        "Expected standard deviation of the position along its worst axis, from one revolution.",
    );
    page.section("How many reflectors are visible");
    page.figure(
        &draw(&by_count, &counts)?,
        "Reflectors within reach of the sensor, at the most as many as it is assumed to see.",
    );
    page.section("Where a vehicle finds itself");
    page.figure(&draw(&by_answer, &answers)?, "What a vehicle that is switched on there finds out.");
    Ok(page)
}

/// Lines that are drawn at the most: a page with more is slow to open.
const MOST_LINES: usize = 5_000;

type Line = [[f64; 2]; 2];

/// The longest lines of which an end is within `reach` of the box around the reflectors.
fn near(lines: &[Line], positions: &[Point], reach: f64) -> Vec<Line> {
    let is_within = |value: f64, axis: fn(&Point) -> f64| {
        let least = positions.iter().map(axis).fold(f64::INFINITY, f64::min);
        let most = positions.iter().map(axis).fold(f64::NEG_INFINITY, f64::max);
        (least - reach..=most + reach).contains(&value)
    };
    let is_near = |[x, y]: &[f64; 2]| is_within(*x, |point| point.x) && is_within(*y, |point| point.y);
    let length = |[a, b]: &Line| (a[0] - b[0]).hypot(a[1] - b[1]);
    let mut near: Vec<Line> = lines.iter().filter(|ends| ends.iter().any(is_near)).copied().collect();
    near.sort_by(|a, b| length(b).total_cmp(&length(a)));
    near.truncate(MOST_LINES);
    near
}
