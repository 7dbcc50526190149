//! A campaign on one page.

use agv_core::integrity::AlertLimits;
use agv_host_sim::report::{Figure, FigureError, Page, StanfordDiagram, Table, stanford_diagram};

use super::figures::Figures;
use super::stanford::{CELLS, Stanford};

/// A page with the Stanford diagrams and the kinds of faults.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(figures: &Figures) -> Result<Page, FigureError> {
    let mut page = Page::new("Trust");
    page.section("Errors and protection levels").paragraph(
        "Every claim of the campaign, each 10 ms: error and protection level of the position. To the right of the diagonal the error \
         is above its protection level; to the right of an alert limit, and below it, an output is hazardous. The last cells \
         of each axis have all that is larger.",
    );
    let [nominal, faults] = diagrams(figures)?;
    page.figure(&nominal, "Without faults");
    page.figure(&faults, "With faults");
    page.section("Kinds of faults").paragraph("Each at its worst size; hazardous outputs of one event.");
    let heading =
        ["kind", "class", "worst size", "failures", "runs", "worst seed", "HMI, s", "HMI, m", "found by", "claimed, %"];
    let rows = figures.per_fault.iter().map(|of| {
        vec![
            of.kind.clone(),
            format!("{:?}", of.class),
            format!("{} {}", of.worst_size, of.unit),
            of.failures.to_string(),
            of.runs.to_string(),
            of.worst_seed.to_string(),
            format!("{:.2}", of.worst_hmi_s),
            format!("{:.2}", of.worst_hmi_m),
            of.found_by.clone(),
            format!("{:.1}", 100.0 * of.share_claimed),
        ]
    });
    page.table(&Table { heading: heading.map(str::to_owned).to_vec(), rows: rows.collect() });
    Ok(page)
}

/// The Stanford diagrams without faults and with them.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn diagrams(figures: &Figures) -> Result<[Figure; 2], FigureError> {
    Ok([diagram(&figures.stanford_nominal)?, diagram(&figures.stanford_faults)?])
}

/// One Stanford diagram.
///
/// # Errors
/// If it cannot be drawn.
pub fn diagram(of: &Stanford) -> Result<Figure, FigureError> {
    let AlertLimits { travel, docking } = AlertLimits::default();
    let limits = [travel, docking].map(|limit| 1e3 * limit.position);
    stanford_diagram(&StanfordDiagram { cells: &of.cells, cell_mm: of.cell_mm, count: CELLS, limits: &limits })
}
