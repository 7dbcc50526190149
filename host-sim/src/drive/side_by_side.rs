//! Several replayed drives on one page, such as before and after a change.

use super::figures::{Figures, KINDS};
use super::health::health_rows;
use super::names::kind_name;
use super::pictures::{
    add_pictures, heading_error_chart, heading_error_line, position_error_chart, position_error_line,
};
use super::report::add_verdict;
use super::tables::{figure_rows, parameter_rows};
use super::track::Track;
use crate::log::SOFTWARE;
use crate::recording::Recording;
use crate::replay::Replay;
use crate::report::{Figure, FigureError, Map, Page, PointSet, Series, Table, trajectory_plot};

/// A drive that was replayed.
pub struct ReplayedDrive {
    /// Its name.
    pub name: String,
    /// What is to be said of its log: name and value.
    pub remarks: Vec<[String; 2]>,
    /// What happened.
    pub recording: Recording,
    /// What the localiser answered.
    pub replay: Replay,
    /// Where it said that the vehicle was.
    pub track: Track,
    /// The figures.
    pub figures: Figures,
}

/// Rows of names and values side by side: one column for each drive. A name that only some have leaves the others empty.
fn side_by_side(drives: &[ReplayedDrive], rows: impl Fn(&ReplayedDrive) -> Vec<[String; 2]>) -> Table {
    let columns: Vec<Vec<[String; 2]>> = drives.iter().map(rows).collect();
    let mut names: Vec<&String> = Vec::new();
    for [name, _] in columns.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let cell = |column: &[[String; 2]], name: &String| {
        let values = column.iter().filter(|[known, _]| known == name).map(|[_, value]| value.as_str());
        values.collect::<Vec<_>>().join("; ")
    };
    let row = |name: &&String| {
        let cells = columns.iter().map(|column| cell(column, name));
        std::iter::once((*name).clone()).chain(cells).collect()
    };
    Table {
        heading: std::iter::once(String::new()).chain(drives.iter().map(|drive| drive.name.clone())).collect(),
        rows: names.iter().map(row).collect(),
    }
}

/// Parameters that are not the same in all drives; all of them if there is one drive.
fn parameters(drives: &[ReplayedDrive]) -> Table {
    let mut table = side_by_side(drives, |drive| parameter_rows(&drive.recording.parameters));
    if drives.len() > 1 {
        table.rows.retain(|row| row[1..].iter().any(|cell| *cell != row[1]));
    }
    table
}

/// A page about drives: what they have in common to compare, then each of them.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn report_page(drives: &[ReplayedDrive]) -> Result<Page, FigureError> {
    let names: Vec<&str> = drives.iter().map(|drive| drive.name.as_str()).collect();
    let mut page = Page::new(&format!("Report on {}", names.join(", ")));
    page.paragraph(&format!("Replayed by {SOFTWARE}."));
    for drive in drives {
        if drives.len() > 1 {
            page.paragraph(&format!("{}:", drive.name));
        }
        add_verdict(&mut page, &drive.figures);
    }
    page.section("Summary").table(&side_by_side(drives, |drive| {
        drive.remarks.iter().cloned().chain(figure_rows(&drive.figures)).collect()
    }));
    page.section("Health").table(&side_by_side(drives, |drive| health_rows(&drive.recording)));
    if drives.len() > 1 {
        add_comparison(&mut page, drives)?;
    }
    for drive in drives {
        if drives.len() > 1 {
            page.part(&drive.name);
        }
        add_pictures(&mut page, &drive.recording, &drive.replay, &drive.track, &drive.figures)?;
    }
    let is_one = drives.len() == 1;
    page.section(if is_one { "Parameters" } else { "Parameters that differ" })
        .paragraph("Settings by their names, in SI units and radians.");
    page.table(&parameters(drives));
    Ok(page)
}

fn add_comparison(page: &mut Page, drives: &[ReplayedDrive]) -> Result<(), FigureError> {
    page.section("Ways side by side");
    let ways: Vec<Vec<(f64, f64)>> = drives
        .iter()
        .map(|drive| drive.track.points.iter().map(|point| (point.output.pose.x, point.output.pose.y)).collect())
        .collect();
    let paths: Vec<Series> =
        drives.iter().zip(&ways).map(|(drive, points)| Series { name: &drive.name, points }).collect();
    // The map is that of the first drive.
    let landmarks = KINDS.map(|kind| {
        let of_kind = drives[0].recording.landmarks.iter().filter(|landmark| landmark.kind == kind);
        of_kind.map(|landmark| (landmark.x, landmark.y)).collect::<Vec<_>>()
    });
    let mut sets: Vec<PointSet> =
        KINDS.iter().zip(&landmarks).map(|(kind, points)| PointSet { name: kind_name(*kind), points }).collect();
    sets.retain(|set| !set.points.is_empty());
    page.figure(&trajectory_plot(&Map { outlines: &[], landmarks: &sets }, &paths)?, "Ways of all drives.");
    for (line, chart, caption) in ERRORS {
        let lines: Vec<Vec<(f64, f64)>> = drives.iter().map(|drive| line(&drive.track)).collect();
        if lines.iter().all(Vec::is_empty) {
            continue;
        }
        let series: Vec<Series> =
            drives.iter().zip(&lines).map(|(drive, points)| Series { name: &drive.name, points }).collect();
        page.figure(&chart(&series)?, caption);
    }
    Ok(())
}

/// A line of a drive's errors, a chart of such lines, and what it shows.
type ErrorChart = (fn(&Track) -> Vec<(f64, f64)>, fn(&[Series]) -> Result<Figure, FigureError>, &'static str);

const ERRORS: [ErrorChart; 2] = [
    (position_error_line, position_error_chart, "Errors of the position over the way."),
    (heading_error_line, heading_error_chart, "Errors of the heading over the way."),
];
