//! A campaign on one page.

use agv_core::integrity::AlertLimits;
use agv_host_sim::report::{Figure, FigureError, Page, StanfordDiagram, Table, stanford_diagram};

use super::figures::Figures;
use super::of_kind::{OfKind, Swept};
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
    if figures.per_fault.iter().any(|of| !of.sizes.is_empty()) {
        sizes(&mut page, figures);
    }
    Ok(page)
}

/// What each size of each kind has shown.
fn sizes(page: &mut Page, figures: &Figures) {
    page.section("Every size").paragraph("The sweep by which the worst sizes were found.");
    let heading = ["kind", "size", "failures", "runs", "HMI, s", "error over level, at most", "claimed, %"];
    let of_kind = |of: &OfKind| {
        let (kind, unit) = (of.kind.clone(), of.unit.clone());
        let row = move |of: &Swept| {
            vec![
                kind.clone(),
                format!("{} {unit}", of.size),
                of.failures.to_string(),
                of.runs.to_string(),
                format!("{:.2}", of.worst_hmi_s),
                of.error_over_pl_max.map_or_else(String::new, |share| format!("{share:.2}")),
                format!("{:.1}", 100.0 * of.share_claimed),
            ]
        };
        of.sizes.iter().map(row).collect::<Vec<_>>()
    };
    let rows = figures.per_fault.iter().flat_map(of_kind).collect();
    page.table(&Table { heading: heading.map(str::to_owned).to_vec(), rows });
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
