//! In which of several states something was.

use plotters::prelude::*;

use super::figure::{Extent, Figure, FigureError, MARGIN, X_LABELS, axes, axis_number, colour, draw};

/// Room for the names of the states, pixels.
const NAMES: u32 = 160;

/// A time in one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateSpan {
    /// Where it begins, in the unit of the horizontal axis.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// Index of the state.
    pub state: usize,
}

/// A bar for each span, one row a state; the first state is at the top.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn state_timeline(x_label: &str, states: &[&str], spans: &[StateSpan]) -> Result<Figure, FigureError> {
    let finite = || spans.iter().filter(|span| span.from.is_finite() && span.to.is_finite());
    let x = Extent::of(finite().flat_map(|span| [span.from, span.to]));
    let rows = states.len().max(1);
    // Rows lie at whole numbers; the first state at the greatest.
    let y = Extent { low: -0.6, high: rows as f64 - 0.4 };
    let row_of = |state: usize| rows as f64 - 1.0 - state as f64;
    let name_of = |height: &f64| {
        let row = height.round();
        let state = (rows as f64 - 1.0 - row).max(0.0) as usize;
        let is_row = (height - row).abs() < 1e-6 && row >= 0.0;
        states.get(state).filter(|_| is_row).copied().unwrap_or_default().to_owned()
    };
    draw(100 + 34 * rows as u32, Vec::new(), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(X_LABELS)
            .y_label_area_size(NAMES)
            .build_cartesian_2d(x.low..x.high, y.low..y.high)?;
        axes(&mut chart, [x_label, ""], rows + 2, &|value| axis_number(*value, x), &name_of)?;
        // A short time is seen too.
        let least = 0.002 * x.width();
        chart.draw_series(finite().filter(|span| span.state < rows).map(|span| {
            let (row, end) = (row_of(span.state), span.to.max(span.from + least));
            Rectangle::new([(span.from, row - 0.3), (end, row + 0.3)], colour(span.state).filled())
        }))?;
        Ok(())
    })
}
