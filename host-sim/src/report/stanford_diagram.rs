//! Stanford diagram: errors against protection levels (S. Pullen, T. Walter: GBAS integrity diagrams).

use plotters::prelude::*;

use super::figure::{
    BACKGROUND_INK, Extent, Figure, FigureError, MARGIN, MARKS, Mark, SHADES, WARNING_INK, X_LABELS, Y_LABELS, axes,
    axis_number, draw,
};

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct StanfordDiagram<'a> {
    /// Protection level and error, in cells from 0 on, and how many outputs have them.
    pub cells: &'a [(u32, u32, u64)],
    /// Width of a cell, mm.
    pub cell_mm: f64,
    /// Cells along each axis; the last one has all that is larger.
    pub count: u32,
    /// Alert limits, mm.
    pub limits: &'a [f64],
}

/// Height of the picture, pixels.
const HEIGHT: u32 = 600;

/// Draws errors (across) and protection levels (up) of a position; below the diagonal outputs mislead.
///
/// # Errors
/// If the picture cannot be drawn.
pub fn stanford_diagram(diagram: &StanfordDiagram) -> Result<Figure, FigureError> {
    let width = diagram.cell_mm;
    let extent = Extent { low: 0.0, high: width * f64::from(diagram.count) };
    // A shade for each power of a hundred.
    let class = |count: u64| (count.max(1).ilog10() / 2).min(SHADES.len() as u32 - 1) as usize;
    let names = ["1 output and more", "100 and more", "10,000 and more", "1,000,000 and more", "100,000,000 and more"];
    let most = diagram.cells.iter().map(|cell| class(cell.2)).max().unwrap_or(0);
    let mut legend: Vec<_> = (0..=most).map(|class| (Mark::Square, SHADES[class], names[class].to_owned())).collect();
    legend.push((Mark::Line, WARNING_INK, "error equal to the protection level".to_owned()));
    legend.push((Mark::Dashes, BACKGROUND_INK, "alert limits".to_owned()));
    draw(HEIGHT, legend, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(MARGIN)
            .x_label_area_size(X_LABELS)
            .y_label_area_size(Y_LABELS)
            .build_cartesian_2d(extent.low..extent.high, extent.low..extent.high)
            .map_err(|error| error.to_string())?;
        let number = |value: &f64| axis_number(*value, extent);
        axes(&mut chart, ["error, mm", "protection level, mm"], MARKS, &number, &number)?;
        chart.draw_series(diagram.cells.iter().map(|&(level, error, count)| {
            let low = (f64::from(error) * width, f64::from(level) * width);
            Rectangle::new([low, (low.0 + width, low.1 + width)], SHADES[class(count)].filled())
        }))?;
        let ends = [(extent.low, extent.low), (extent.high, extent.high)];
        chart.draw_series(LineSeries::new(ends, WARNING_INK.stroke_width(2)))?;
        for &limit in diagram.limits {
            for line in [[(extent.low, limit), (extent.high, limit)], [(limit, extent.low), (limit, extent.high)]] {
                chart.draw_series(DashedLineSeries::new(line, 8, 5, BACKGROUND_INK.stroke_width(2)))?;
            }
        }
        Ok(())
    })
}
