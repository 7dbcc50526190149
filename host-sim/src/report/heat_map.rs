//! A floor plan whose squares are coloured.

use plotters::prelude::*;

use super::figure::{
    BACKGROUND_INK, Extent, Figure, FigureError, MARGIN, MARKS, Mark, PointSet, SHADES, Shape, WIDTH, X_LABELS,
    Y_LABELS, axes, axis_number, draw,
};

/// A square of the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Its middle in W, m.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// Its class: the place of its name.
    pub class: usize,
}

/// Lines beside the points, as of walls.
#[derive(Clone, Copy, Debug)]
pub struct LineSet<'a> {
    /// What they are.
    pub name: &'a str,
    /// Both ends of each in W, m.
    pub lines: &'a [[[f64; 2]; 2]],
}

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct HeatMap<'a> {
    /// The squares.
    pub cells: &'a [Cell],
    /// Their size, m.
    pub size: f64,
    /// Names of the classes, the best one first; an empty name is not in the legend.
    pub classes: &'a [&'a str],
    /// Lines above the squares, as far as they are within the picture.
    pub lines: LineSet<'a>,
    /// Points above the squares.
    pub points: PointSet<'a>,
    /// The name of each point, which is written beside it if they are few; or none.
    pub names: &'a [String],
}

/// Names that are written at the most.
const NAMES: usize = 80;

/// Greatest height of the plan, pixels.
const TALLEST: f64 = 720.0;
const SHORTEST: f64 = 160.0;

/// Draws a floor plan with one scale for both axes.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn heat_map(map: &HeatMap) -> Result<Figure, FigureError> {
    let half = 0.5 * map.size;
    let ends = |value: f64| [value - half, value + half];
    let x =
        Extent::of(map.cells.iter().flat_map(|cell| ends(cell.x)).chain(map.points.points.iter().map(|point| point.0)));
    let y =
        Extent::of(map.cells.iter().flat_map(|cell| ends(cell.y)).chain(map.points.points.iter().map(|point| point.1)));
    let (x, y) = (x.widened(0.03), y.widened(0.03));
    let plane_width = f64::from(WIDTH - Y_LABELS - 2 * MARGIN);
    let height = (plane_width * y.width() / x.width()).clamp(SHORTEST, TALLEST);
    let scale = (x.width() / plane_width).max(y.width() / height);
    let widened = |extent: Extent, pixels: f64| extent.widened(0.5 * (scale * pixels / extent.width() - 1.0).max(0.0));
    let (x, y) = (widened(x, plane_width), widened(y, height));
    let shade = |class: usize| SHADES[class.min(SHADES.len() - 1)];
    let named = map.classes.iter().enumerate().filter(|(_, name)| !name.is_empty());
    let mut legend: Vec<_> = named.map(|(class, name)| (Mark::Square, shade(class), (*name).to_owned())).collect();
    if !map.lines.lines.is_empty() {
        legend.push((Mark::Line, BACKGROUND_INK, map.lines.name.to_owned()));
    }
    legend.push((Mark::Point(Shape::Disc), POINT_INK, map.points.name.to_owned()));
    draw(height as u32 + X_LABELS + 2 * MARGIN, legend, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(X_LABELS)
            .y_label_area_size(Y_LABELS)
            .build_cartesian_2d(x.low..x.high, y.low..y.high)
            .map_err(|error| error.to_string())?;
        axes(&mut chart, ["x, m", "y, m"], MARKS, &|value| axis_number(*value, x), &|value| axis_number(*value, y))?;
        let cells = map.cells.iter().map(|cell| {
            let corners = [(cell.x - half, cell.y - half), (cell.x + half, cell.y + half)];
            Rectangle::new(corners, shade(cell.class).filled())
        });
        chart.draw_series(cells)?;
        let lines = map.lines.lines.iter().filter_map(|ends| clipped(*ends, [x, y]));
        chart.draw_series(lines.map(|ends| PathElement::new(ends, BACKGROUND_INK.stroke_width(2))))?;
        chart.draw_series(map.points.points.iter().map(|point| Circle::new(*point, 5, WHITE.filled())))?;
        chart.draw_series(map.points.points.iter().map(|point| Circle::new(*point, 4, POINT_INK.filled())))?;
        if map.names.len() <= NAMES {
            let named = map.points.points.iter().zip(map.names);
            let style = ("sans-serif", 15).into_font().color(&BLACK);
            chart.draw_series(
                named.map(|(point, name)| EmptyElement::at(*point) + Text::new(name.clone(), (7, -14), style.clone())),
            )?;
        }
        Ok(())
    })
}

/// Colour of the points: that of reflectors everywhere.
const POINT_INK: RGBColor = RGBColor(0, 114, 178);

/// The part of a line that is within a box (Y.-D. Liang, B. A. Barsky, "A new concept and method for line clipping", 1984).
fn clipped([from, to]: [[f64; 2]; 2], within: [Extent; 2]) -> Option<[(f64, f64); 2]> {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for ((start, end), extent) in from.iter().zip(to).zip(within) {
        let way = end - start;
        if way == 0.0 {
            if *start < extent.low || *start > extent.high {
                return None;
            }
            continue;
        }
        let (low, high) = ((extent.low - start) / way, (extent.high - start) / way);
        (enters, leaves) = (enters.max(low.min(high)), leaves.min(low.max(high)));
    }
    let at = |share: f64| (from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]));
    (enters < leaves).then(|| [at(enters), at(leaves)])
}
