//! The report of a check.

use super::{Check, CheckOptions, Finding};
use agv_core::geometry::Point;

use crate::report::{Cell, FigureError, HeatMap, Page, PointSet, Table, heat_map};

/// Limits of the expected standard deviation of the position that are told apart, m, and what they mean.
const DEVIATIONS: [(f64, &str); 5] = [
    (0.005, "up to 5 mm"),
    (0.01, "up to 1 cm"),
    (0.02, "up to 2 cm"),
    (0.05, "up to 5 cm"),
    (f64::INFINITY, "more, or none"),
];

/// Limits of the number of reflectors.
const COUNTS: [(usize, &str); 5] = [(2, "up to 2"), (3, "3"), (5, "4 or 5"), (8, "6 to 8"), (usize::MAX, "9 and more")];

/// A page with the pictures of a check.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(name: &str, positions: &[Point], options: &CheckOptions, check: &Check) -> Result<Page, FigureError> {
    let mut page = Page::new(&format!("Layout {name}"));
    page.section("Summary").table(&Table { heading: Vec::new(), rows: check.rows() });
    let warnings = check.warnings();
    if !warnings.is_empty() {
        page.section("Warnings");
        warnings.iter().for_each(|warning| {
            page.paragraph(warning);
        });
    }
    let points: Vec<(f64, f64)> = positions.iter().map(|position| (position.x, position.y)).collect();
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
        Finding::Unknown => 2,
        Finding::Resembles { .. } => 3,
        Finding::TooFew => 4,
    });
    let deviations = DEVIATIONS.map(|(_, name)| name);
    let mut counts = COUNTS.map(|(_, name)| name);
    counts.reverse();
    let answers = ["finds itself", "", "no clear answer", "may be elsewhere", "too few seen"];
    let draw = |cells: &[Cell], classes: &[&str]| {
        heat_map(&HeatMap { cells, size: options.spacing, classes, points: reflectors })
    };
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
