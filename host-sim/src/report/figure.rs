//! A picture and what all pictures share.

use std::error::Error;

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;

/// A line through points.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// What it is.
    pub name: &'a str,
    /// Points, in the units of the axes; a point that is not finite interrupts the line.
    pub points: &'a [(f64, f64)],
}

/// Points without a line.
#[derive(Clone, Copy, Debug)]
pub struct PointSet<'a> {
    /// What they are.
    pub name: &'a str,
    /// Points, in the units of the axes; points that are not finite are left out.
    pub points: &'a [(f64, f64)],
}

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("a picture cannot be drawn: {0}")]
pub struct FigureError(String);

impl Figure {
    /// The picture as SVG.
    #[must_use]
    pub fn svg(&self) -> &str {
        &self.svg
    }

    /// The picture as SVG on one line, for a file of its own.
    #[must_use]
    pub fn one_line(&self) -> String {
        self.svg.lines().collect::<String>() + "\n"
    }
}

impl FigureError {
    fn new(error: &dyn Error) -> Self {
        Self(error.to_string())
    }
}

/// How an entry of the legend looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    Line,
    Dashes,
    Square,
    Point(Shape),
}

/// Shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Disc,
    Cross,
    Triangle,
    Square,
    Frame,
}

impl Shape {
    /// A shape for the set of that index, so that sets differ by more than colour.
    pub(super) fn of(index: usize) -> Self {
        [Self::Disc, Self::Cross, Self::Triangle][index % 3]
    }
}

/// A picture as SVG, with its legend apart, so that the legend stays readable on a small screen.
#[derive(Clone, Debug)]
pub struct Figure {
    pub(super) svg: String,
    pub(super) legend: Vec<(Mark, RGBColor, String)>,
}

/// Colours that people with any common colour blindness tell apart (M. Okabe, K. Ito, "Color universal design", 2008),
/// without the yellow, which is too light for a thin line.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// From good to bad: dark green to light, and from light to dark red; their lightness alone tells on which side a shade is, as the good ones
/// are greenish for every eye (C. Brewer, ColorBrewer, `BrBG` turned, 2003).
pub(super) const SHADES: [RGBColor; 7] = [
    RGBColor(1, 102, 94),
    RGBColor(53, 151, 143),
    RGBColor(128, 205, 193),
    RGBColor(199, 234, 229),
    RGBColor(246, 232, 195),
    RGBColor(191, 129, 45),
    RGBColor(84, 48, 5),
];

/// Grey of what stands in the background.
pub(super) const BACKGROUND_INK: RGBColor = RGBColor(150, 150, 150);

/// Colour of what exceeds or is refused.
pub(super) const WARNING_INK: RGBColor = PALETTE[1];

/// The colour of the series of that index.
pub(super) fn colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// Width of every picture, pixels. Narrow, so that a phone shows its letters at a readable size.
pub(super) const WIDTH: u32 = 720;

/// Height of a chart, pixels.
pub(super) const HEIGHT: u32 = 380;

pub(super) const MARGIN: u32 = 14;
pub(super) const X_LABELS: u32 = 54;
pub(super) const Y_LABELS: u32 = 80;

const FONT: &str = "sans-serif";
const FONT_SIZE: i32 = 20;

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws into an empty picture of that height, pixels.
pub(super) fn draw(
    height: u32,
    legend: Vec<(Mark, RGBColor, String)>,
    paint: impl FnOnce(&Area) -> Result<(), Box<dyn Error>>,
) -> Result<Figure, FigureError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        area.fill(&WHITE).map_err(|error| FigureError::new(&error))?;
        paint(&area).map_err(|error| FigureError(error.to_string()))?;
        area.present().map_err(|error| FigureError::new(&error))?;
    }
    Ok(Figure { svg, legend })
}

/// A range of values on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub low: f64,
    pub high: f64,
}

impl Extent {
    /// The extent of all finite values; 0 to 1 if there are none, and never without width.
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let (low, high) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return Self { low: 0.0, high: 1.0 };
        }
        if high - low > 1e-9 * low.abs().max(high.abs()).max(1e-12) {
            return Self { low, high };
        }
        let width = low.abs().max(1.0) * 0.5;
        Self { low: low - width, high: high + width }
    }

    pub(super) fn width(self) -> f64 {
        self.high - self.low
    }

    /// Wider by that share of the width on both sides.
    pub(super) fn widened(self, share: f64) -> Self {
        let margin = self.width() * share;
        Self { low: self.low - margin, high: self.high + margin }
    }
}

/// A number for an axis of that extent: as many decimals as its marks need.
pub(super) fn axis_number(value: f64, extent: Extent) -> String {
    let decimals = (2.0 - extent.width().max(1e-12).log10()).ceil().clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    let trimmed = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if trimmed == "-0" { "0".to_owned() } else { trimmed.to_owned() }
}

pub(super) type Plane<'a, X, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>;

/// Number of marks on a usual axis, about.
pub(super) const MARKS: usize = 8;

/// Axes with labels and a light grid, with about `rows` marks on the vertical one.
pub(super) fn axes<X, Y>(
    chart: &mut Plane<X, Y>,
    labels: [&str; 2],
    rows: usize,
    format_x: &dyn Fn(&X::ValueType) -> String,
    format_y: &dyn Fn(&Y::ValueType) -> String,
) -> Result<(), Box<dyn Error>>
where
    X: Ranged + ValueFormatter<X::ValueType>,
    Y: Ranged + ValueFormatter<Y::ValueType>,
{
    chart
        .configure_mesh()
        .x_desc(labels[0])
        .y_desc(labels[1])
        .x_labels(MARKS)
        .y_labels(rows)
        .x_label_formatter(format_x)
        .y_label_formatter(format_y)
        .label_style((FONT, FONT_SIZE))
        .axis_desc_style((FONT, FONT_SIZE))
        .bold_line_style(RGBColor(222, 222, 222))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(|error| error.to_string())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Extent, axis_number};

    #[test]
    fn an_extent_always_has_a_width() {
        assert_eq!(Extent::of([]), Extent { low: 0.0, high: 1.0 });
        assert_eq!(Extent::of([f64::NAN, f64::INFINITY]), Extent { low: 0.0, high: 1.0 });
        assert_eq!(Extent::of([3.0, f64::NAN, -1.0]), Extent { low: -1.0, high: 3.0 });
        for value in [0.0, 1.0, -1e9, 1e-20] {
            let extent = Extent::of([value]);
            assert!(extent.low < value && value < extent.high, "{value}: {extent:?}");
        }
    }

    #[test]
    fn numbers_on_an_axis_are_short_and_differ() {
        let extent = Extent { low: 0.0, high: 1.0 };
        assert_eq!(axis_number(0.1 + 0.2, extent), "0.3");
        assert_eq!(axis_number(-0.0, extent), "0");
        assert_eq!(axis_number(100.0, Extent { low: 0.0, high: 500.0 }), "100");
        assert_eq!(axis_number(0.002, Extent { low: 0.0, high: 0.01 }), "0.002");
    }
}
