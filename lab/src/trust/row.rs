//! The record of one run, as parts of a campaign exchange them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use agv_host_sim::output_file;
use serde::{Deserialize, Serialize};

use super::kinds::{Kind, NOTHING};
use super::outcome::Outcome;

/// Why rows cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A line of the file is no row.
    #[error("{}: line {line} is no row of a campaign", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
    /// A run is there twice.
    #[error("the run of {kind:?} at {size} with seed {seed} is there twice")]
    Twice {
        /// Its kind.
        kind: String,
        /// Its size.
        size: f64,
        /// Its seed.
        seed: u64,
    },
}

/// Writes rows, a line of JSON each.
///
/// # Errors
/// [`RowsError::File`].
pub fn write(path: &Path, rows: &[Row]) -> Result<(), RowsError> {
    let wrap = |source| RowsError::File { path: path.to_owned(), source };
    let mut text = Vec::new();
    for row in rows {
        serde_json::to_writer(&mut text, row).map_err(|error| wrap(error.into()))?;
        writeln!(text).map_err(wrap)?;
    }
    output_file::write(path, text).map_err(wrap)
}

/// Reads the rows of all parts of a campaign, and puts them in the order in which one machine makes them.
///
/// # Errors
/// See [`RowsError`].
pub fn read(paths: &[PathBuf], kinds: &[Kind]) -> Result<Vec<Row>, RowsError> {
    let mut rows: Vec<Row> = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(path).map_err(|source| RowsError::File { path: path.clone(), source })?;
        for (line, row) in text.lines().enumerate() {
            let row = serde_json::from_str(row).map_err(|_| RowsError::Line { path: path.clone(), line: line + 1 })?;
            rows.push(row);
        }
    }
    let place = |row: &Row| {
        let kind = kinds.iter().position(|kind| kind.name == row.kind);
        let size = kind.and_then(|kind| kinds.get(kind)?.every_size().iter().position(|size| *size == row.size));
        (row.with.is_some(), row.kind == NOTHING, kind, size, row.seed)
    };
    rows.sort_by_key(place);
    match rows.windows(2).find(|pair| place(&pair[0]) == place(&pair[1]) && pair[0].with == pair[1].with) {
        Some([row, ..]) => Err(RowsError::Twice { kind: row.kind.clone(), size: row.size, seed: row.seed }),
        _ => Ok(rows),
    }
}

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the kind of fault.
    pub kind: String,
    /// Its size.
    pub size: f64,
    /// Name and size of another fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub with: Option<(String, f64)>,
    /// The seed of the run among those of its kind.
    pub seed: u64,
    /// The seed of hall, drive, noise and faults.
    pub scene: u64,
    /// Whether the commissioning check accepts the hall.
    pub is_accepted: bool,
    /// Whether a recovery may be asked for.
    pub can_recover: bool,
    /// What became of it; none if the program panicked.
    pub outcome: Option<Outcome>,
}

impl Row {
    /// Whether the run failed: an integrity failure, or a panic.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.outcome.as_ref().is_none_or(|outcome| outcome.failures > 0)
    }

    /// How bad it was: whether it failed, its longest hazardous event, ms, its misleading outputs, and its largest share of error over
    /// protection level, in millionths.
    fn badness(&self) -> (bool, u64, u64, u64) {
        let of_outcome = self.outcome.as_ref().map_or((0, 0, 0), |outcome| {
            let (hazard_ms, over) = (1e3 * outcome.worst_hazard_s, 1e6 * outcome.most_over_level);
            (hazard_ms.round() as u64, outcome.misleading, over as u64)
        });
        (self.has_failed(), of_outcome.0, of_outcome.1, of_outcome.2)
    }
}

/// The rows of one size of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct OfSize<'a> {
    /// The size.
    pub size: f64,
    /// Its runs.
    pub rows: Vec<&'a Row>,
}

impl OfSize<'_> {
    /// Runs that failed.
    #[must_use]
    pub fn failures(&self) -> usize {
        self.rows.iter().filter(|row| row.has_failed()).count()
    }

    /// Runs that failed, if what is hidden counts as well.
    #[must_use]
    pub fn failures_of_all(&self) -> usize {
        let has_failed = |row: &&&Row| row.outcome.as_ref().is_none_or(|outcome| outcome.failures_of_all > 0);
        self.rows.iter().filter(has_failed).count()
    }

    /// A sum over all runs that did not panic.
    #[must_use]
    pub fn sum(&self, value: impl Fn(&Outcome) -> u64) -> u64 {
        self.rows.iter().filter_map(|row| row.outcome.as_ref()).map(value).sum()
    }

    /// The number of runs that did not panic and of which something holds.
    #[must_use]
    pub fn count(&self, holds: impl Fn(&Outcome) -> bool) -> u64 {
        self.sum(|outcome| u64::from(holds(outcome)))
    }

    /// The greatest value of a run that did not panic.
    #[must_use]
    pub fn most(&self, value: impl Fn(&Outcome) -> f64) -> f64 {
        self.rows.iter().filter_map(|row| row.outcome.as_ref()).map(value).fold(0.0, f64::max)
    }

    /// The worst run.
    #[must_use]
    pub fn worst(&self) -> Option<&Row> {
        self.rows.iter().copied().max_by_key(|row| row.badness())
    }

    /// Share of the time in claims with a protection level within the alert limit of travelling.
    #[must_use]
    pub fn share_claimed(&self) -> f64 {
        self.sum(|outcome| outcome.available) as f64 / self.sum(|outcome| outcome.outputs).max(1) as f64
    }

    /// Failures, hazards, misleading outputs, and the largest share of error over protection level, in millionths.
    fn badness(&self) -> (usize, u64, u64, u64) {
        let share = (1e6 * self.most(|outcome| outcome.most_over_level)) as u64;
        (self.failures(), self.sum(|outcome| u64::from(outcome.hazards)), self.sum(|outcome| outcome.misleading), share)
    }
}

/// A share; none of nothing.
pub(super) fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// The rows of a kind that comes alone by its sizes, in order of size.
#[must_use]
pub fn by_size<'a>(rows: impl IntoIterator<Item = &'a Row>, kind: &str) -> Vec<OfSize<'a>> {
    let mut sizes: Vec<OfSize> = Vec::new();
    for row in rows.into_iter().filter(|row| row.kind == kind && row.with.is_none()) {
        match sizes.iter_mut().find(|of| of.size.to_bits() == row.size.to_bits()) {
            Some(of) => of.rows.push(row),
            None => sizes.push(OfSize { size: row.size, rows: vec![row] }),
        }
    }
    sizes.sort_by(|a, b| a.size.total_cmp(&b.size));
    sizes
}

/// The size of a kind at which its runs are worst: most failures, then hazards, then misleading outputs,
/// then the largest share of error over protection level; the smallest such. Of size nought a fault is none, and is not asked if others are.
#[must_use]
pub fn worst_size(sizes: &[OfSize]) -> Option<f64> {
    let mut worst: Option<&OfSize> = None;
    for of in sizes.iter().filter(|of| of.size != 0.0 || sizes.len() == 1) {
        if worst.is_none_or(|worst| of.badness() > worst.badness()) {
            worst = Some(of);
        }
    }
    worst.map(|of| of.size)
}
