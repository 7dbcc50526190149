//! The report of a replayed drive.

use super::figures::Figures;
use super::pictures::add_pictures;
use super::tables::{figure_rows, parameter_rows};
use super::track::Track;
use crate::log::SOFTWARE;
use crate::recording::Recording;
use crate::replay::Replay;
use crate::report::{FigureError, Page, Table};

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
    page.section("Figures").table(&table(rows));
    add_pictures(page, recording, replay, track)?;
    page.section("Parameters").paragraph("SI units and radians.");
    page.table(&table(parameter_rows(&recording.parameters)));
    Ok(())
}
