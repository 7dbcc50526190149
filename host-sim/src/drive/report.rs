//! The report of a replayed drive.

use super::figures::Figures;
use super::fitness::Grade;
use super::pictures::add_pictures;
use super::tables::{figure_rows, parameter_rows, verdict};
use super::track::Track;
use crate::log::SOFTWARE;
use crate::recording::Recording;
use crate::replay::Replay;
use crate::report::{FigureError, Page, Table};

/// Adds what a drive was at a glance.
pub(super) fn add_verdict(page: &mut Page, figures: &Figures) {
    let class = match figures.fitness.grade() {
        Grade::Good => "good",
        Grade::Partly => "partly",
        Grade::Poor => "poor",
    };
    page.verdict(class, &verdict(figures));
}

/// Adds everything about a replayed drive to a page. `remarks` are rows of the first table that the drive does not know:
/// where it comes from, and what is wrong with its log.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn add_drive(
    page: &mut Page,
    remarks: &[[String; 2]],
    recording: &Recording,
    replay: &Replay,
    track: &Track,
    figures: &Figures,
) -> Result<(), FigureError> {
    let table = |rows: Vec<[String; 2]>| Table { heading: Vec::new(), rows: rows.into_iter().map(Vec::from).collect() };
    let mut rows = remarks.to_vec();
    rows.push(["replayed by".to_owned(), SOFTWARE.to_owned()]);
    rows.extend(figure_rows(figures));
    add_verdict(page, figures);
    page.section("Figures").table(&table(rows));
    add_pictures(page, recording, replay, track, figures)?;
    page.section("Parameters").paragraph("Settings by their names, in SI units and radians.");
    page.table(&table(parameter_rows(&recording.parameters)));
    Ok(())
}
