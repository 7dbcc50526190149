//! Paths over the map.

use plotters::prelude::*;

use super::figure::{
    BACKGROUND_INK, Extent, Figure, FigureError, MARGIN, MARKS, Mark, PointSet, Series, Shape, WIDTH, X_LABELS,
    Y_LABELS, axes, axis_number, draw,
};
use super::kinds::{Look, look_of};
use super::thinning::{thin_path, thin_points};

/// Points of one path that are drawn at the most.
const PATH_POINTS: usize = 3000;

/// Landmarks or walls of one kind that are drawn at the most.
const MAP_MARKS: usize = 5000;

/// Smallest and greatest height of the picture's plane, pixels.
const PLANE_HEIGHT: [f64; 2] = [220.0, 720.0];

/// What stands in the world, m.
#[derive(Clone, Copy, Debug, Default)]
pub struct Map<'a> {
    /// Outlines of solid things: line segments.
    pub outlines: &'a [[(f64, f64); 2]],
    /// Landmarks, one set a kind.
    pub landmarks: &'a [PointSet<'a>],
}

/// Paths over the map, in W, m, with one scale for both axes. The picture shows the paths and the landmarks; of the
/// outlines, what lies within that.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn trajectory_plot(map: &Map, paths: &[Series]) -> Result<Figure, FigureError> {
    let marks = || {
        let landmarks = map.landmarks.iter().flat_map(|set| set.points);
        paths.iter().flat_map(|path| path.points).chain(landmarks).copied()
    };
    let mut x = Extent::of(marks().map(|point| point.0)).widened(0.05);
    let mut y = Extent::of(marks().map(|point| point.1)).widened(0.05);
    let plane_width = f64::from(WIDTH - Y_LABELS - 2 * MARGIN);
    let plane_height = (plane_width * y.width() / x.width()).clamp(PLANE_HEIGHT[0], PLANE_HEIGHT[1]).round();
    let metres_a_pixel = (x.width() / plane_width).max(y.width() / plane_height);
    x = centred(x, metres_a_pixel * plane_width);
    y = centred(y, metres_a_pixel * plane_height);

    let path_looks: Vec<Look> = paths.iter().enumerate().map(|(index, path)| look_of(path.name, index)).collect();
    let places = map.landmarks.iter().enumerate();
    let set_looks: Vec<Look> = places.map(|(index, set)| look_of(set.name, paths.len() + index)).collect();
    let mut legend: Vec<_> = paths
        .iter()
        .zip(path_looks.iter())
        .map(|(path, look)| (Mark::Line, look.colour, path.name.to_owned()))
        .collect();
    let sets = map.landmarks.iter().zip(&set_looks);
    legend.extend(sets.map(|(set, look)| (Mark::Point(look.shape), look.colour, set.name.to_owned())));

    let is_inside = |point: &(f64, f64)| (x.low..=x.high).contains(&point.0) && (y.low..=y.high).contains(&point.1);
    draw(plane_height as u32 + X_LABELS + 2 * MARGIN, legend, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(X_LABELS)
            .y_label_area_size(Y_LABELS)
            .build_cartesian_2d(x.low..x.high, y.low..y.high)?;
        axes(&mut chart, ["x, m", "y, m"], MARKS, &|value| axis_number(*value, x), &|value| axis_number(*value, y))?;
        let outlines = map.outlines.iter().filter(|segment| segment.iter().any(is_inside)).take(MAP_MARKS);
        chart.draw_series(outlines.map(|segment| PathElement::new(*segment, BACKGROUND_INK)))?;
        for (set, look) in map.landmarks.iter().zip(&set_looks) {
            let points = thin_points(set.points, MAP_MARKS).into_iter().filter(is_inside);
            let ink = look.colour;
            match look.shape {
                Shape::Disc => chart.draw_series(points.map(|point| Circle::new(point, 3, ink.filled())))?,
                Shape::Cross => chart.draw_series(points.map(|point| Cross::new(point, 3, ink)))?,
                Shape::Triangle => {
                    chart.draw_series(points.map(|point| TriangleMarker::new(point, 4, ink.filled())))?
                }
                Shape::Square | Shape::Frame => {
                    let is_filled = look.shape == Shape::Square;
                    let style = if is_filled { ink.filled() } else { ink.stroke_width(2) };
                    chart.draw_series(
                        points.map(|point| EmptyElement::at(point) + Rectangle::new([(-3, -3), (3, 3)], style)),
                    )?
                }
            };
        }
        // What is wide lies below: a thin path on it stays to be seen.
        let mut order: Vec<usize> = (0..paths.len()).collect();
        order.sort_by_key(|index| std::cmp::Reverse(path_looks[*index].width));
        for index in order {
            let (path, look) = (&paths[index], path_looks[index]);
            let thinned = thin_path(path.points, PATH_POINTS);
            for piece in thinned.split(|point| !point.0.is_finite() || !point.1.is_finite()) {
                chart.draw_series(LineSeries::new(piece.iter().copied(), look.colour.stroke_width(look.width)))?;
            }
            let finite = path.points.iter().find(|point| point.0.is_finite() && point.1.is_finite());
            chart.draw_series(finite.map(|start| Circle::new(*start, 5, look.colour.stroke_width(2))))?;
        }
        Ok(())
    })
}

fn centred(extent: Extent, width: f64) -> Extent {
    let middle = 0.5 * (extent.low + extent.high);
    Extent { low: middle - 0.5 * width, high: middle + 0.5 * width }
}
