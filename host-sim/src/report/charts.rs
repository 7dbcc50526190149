//! Charts over time or over the path.

use plotters::prelude::*;

use super::figure::{
    Area, BACKGROUND_INK, Extent, Figure, FigureError, HEIGHT, MARGIN, MARKS, Mark, PointSet, Series, Shape,
    WARNING_INK, X_LABELS, Y_LABELS, axes, axis_number, colour, draw,
};
use super::kinds::look_of;
use super::thinning::{thin_line, thin_points};

/// Points of one line, and of one set of points, that are drawn at the most.
const LINE_POINTS: usize = 2000;
const SET_POINTS: usize = 2500;

/// Horizontal lines at these heights, and what they stand for.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<'a> {
    /// What the lines mean.
    pub name: &'a str,
    /// Heights, in the unit of the vertical axis.
    pub heights: &'a [f64],
}

/// Lines over a common axis. The labels of the axes, horizontal and vertical, state the units.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn line_chart(labels: [&str; 2], series: &[Series], bounds: Option<Bounds>) -> Result<Figure, FigureError> {
    let points = || series.iter().flat_map(|series| series.points).filter(|point| point.1.is_finite());
    let mut legend: Vec<_> =
        series.iter().enumerate().map(|(index, series)| (Mark::Line, colour(index), series.name.to_owned())).collect();
    legend.extend(bounds.map(|bounds| (Mark::Dashes, BACKGROUND_INK, bounds.name.to_owned())));
    let (x, y) = extents(points, bounds);
    draw(HEIGHT, legend, |area| {
        let mut chart = plane(area, x, y)?;
        axes(&mut chart, labels, MARKS, &|value| axis_number(*value, x), &|value| axis_number(*value, y))?;
        for height in bounds.iter().flat_map(|bounds| bounds.heights) {
            let line = [(x.low, *height), (x.high, *height)];
            chart.draw_series(DashedLineSeries::new(line, 8, 5, BACKGROUND_INK.stroke_width(2)))?;
        }
        for (index, series) in series.iter().enumerate() {
            let thinned = thin_line(series.points, LINE_POINTS);
            for piece in thinned.split(|point| !point.0.is_finite() || !point.1.is_finite()) {
                chart.draw_series(LineSeries::new(piece.iter().copied(), colour(index).stroke_width(2)))?;
            }
        }
        Ok(())
    })
}

/// Points over a common axis, with bounds: innovations with their limits, for example.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn scatter_chart(labels: [&str; 2], sets: &[PointSet], bounds: Option<Bounds>) -> Result<Figure, FigureError> {
    let points = || sets.iter().flat_map(|set| set.points).filter(|point| point.0.is_finite() && point.1.is_finite());
    let mut legend: Vec<_> = sets
        .iter()
        .enumerate()
        .map(|(index, set)| {
            (Mark::Point(look_of(set.name, index).shape), look_of(set.name, index).colour, set.name.to_owned())
        })
        .collect();
    legend.extend(bounds.map(|bounds| (Mark::Dashes, BLACK, bounds.name.to_owned())));
    let (x, y) = extents(points, bounds);
    draw(HEIGHT, legend, |area| {
        let mut chart = plane(area, x, y)?;
        axes(&mut chart, labels, MARKS, &|value| axis_number(*value, x), &|value| axis_number(*value, y))?;
        for (index, set) in sets.iter().enumerate() {
            let thinned = thin_points(set.points, SET_POINTS);
            let finite = thinned.into_iter().filter(|point| point.0.is_finite() && point.1.is_finite());
            let look = look_of(set.name, index);
            let ink = look.colour.mix(0.6);
            match look.shape {
                Shape::Disc | Shape::Square | Shape::Frame => {
                    chart.draw_series(finite.map(|point| Circle::new(point, 2, ink.filled())))?
                }
                Shape::Cross => chart.draw_series(finite.map(|point| Cross::new(point, 3, ink)))?,
                Shape::Triangle => {
                    chart.draw_series(finite.map(|point| TriangleMarker::new(point, 3, ink.filled())))?
                }
            };
        }
        for height in bounds.iter().flat_map(|bounds| bounds.heights) {
            let line = [(x.low, *height), (x.high, *height)];
            chart.draw_series(DashedLineSeries::new(line, 8, 5, BLACK.stroke_width(2)))?;
        }
        Ok(())
    })
}

/// One use of a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandmarkMark {
    /// Time or path, in the unit of the horizontal axis.
    pub x: f64,
    /// Name of the landmark.
    pub landmark: u32,
    /// Whether the observation corrected the pose.
    pub is_accepted: bool,
}

/// Which landmarks were used when: one row for each landmark that was ever seen, in the order of their names.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn landmark_timeline(x_label: &str, marks: &[LandmarkMark]) -> Result<Figure, FigureError> {
    let mut names: Vec<u32> = marks.iter().map(|mark| mark.landmark).collect();
    names.sort_unstable();
    names.dedup();
    let place = |is_accepted: bool| -> Vec<(f64, f64)> {
        let marks = marks.iter().filter(|mark| mark.is_accepted == is_accepted && mark.x.is_finite());
        // A little apart, or one would hide the other.
        let shift = if is_accepted { 0.0 } else { -0.35 };
        let placed = marks.map(|mark| (mark.x, names.partition_point(|name| *name < mark.landmark) as f64 + shift));
        thin_points(&placed.collect::<Vec<_>>(), SET_POINTS)
    };
    let x = Extent::of(marks.iter().map(|mark| mark.x));
    let y = Extent { low: -1.0, high: (names.len() as f64).max(1.0) };
    let legend = vec![
        (Mark::Point(Shape::Disc), colour(0), "used".to_owned()),
        (Mark::Point(Shape::Cross), WARNING_INK, "rejected".to_owned()),
    ];
    let height = (120 + 18 * names.len() as u32).clamp(200, 900);
    let name_of = |row: &f64| {
        let is_row = row.fract().abs() < 1e-6 && *row >= 0.0;
        names.get(*row as usize).filter(|_| is_row).map(u32::to_string).unwrap_or_default()
    };
    draw(height, legend, |area| {
        let mut chart = plane(area, x, y)?;
        axes(&mut chart, [x_label, "landmark"], (names.len() + 4).min(40), &|value| axis_number(*value, x), &name_of)?;
        chart.draw_series(place(true).into_iter().map(|point| Circle::new(point, 2, colour(0).mix(0.7).filled())))?;
        chart.draw_series(place(false).into_iter().map(|point| Cross::new(point, 3, WARNING_INK.stroke_width(2))))?;
        Ok(())
    })
}

/// Extents of both axes; the bounds are always in the picture, and the vertical axis has room at both ends.
fn extents<'a, I: Iterator<Item = &'a (f64, f64)>>(points: impl Fn() -> I, bounds: Option<Bounds>) -> (Extent, Extent) {
    let heights = bounds.map(|bounds| bounds.heights).unwrap_or_default();
    let x = Extent::of(points().map(|point| point.0));
    let y = Extent::of(points().map(|point| point.1).chain(heights.iter().copied()));
    (x, y.widened(0.05))
}

type FloatPlane<'a> =
    super::figure::Plane<'a, plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>;

fn plane<'a>(area: &Area<'a>, x: Extent, y: Extent) -> Result<FloatPlane<'a>, Box<dyn std::error::Error>> {
    let chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .x_label_area_size(X_LABELS)
        .y_label_area_size(Y_LABELS)
        .build_cartesian_2d(x.low..x.high, y.low..y.high)
        .map_err(|error| error.to_string())?;
    Ok(chart)
}
