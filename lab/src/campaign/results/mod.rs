//! What became of the runs of a campaign, as a file in Apache Parquet.

#[cfg(feature = "tables")]
mod file;
#[cfg(not(feature = "tables"))]
#[path = "no_file.rs"]
mod file;

use std::path::PathBuf;

use agv_host_sim::left_out::LeftOut;

#[cfg(feature = "tables")]
use parquet_derive::{ParquetRecordReader, ParquetRecordWriter};
use serde::Serialize;

use super::verdict::{Class, Verdict};
pub use file::{read, write};

/// Results of campaigns as Parquet.
pub const TABLES: LeftOut = LeftOut::unless(cfg!(feature = "tables"), "tables (.parquet)", "tables");

/// One run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "tables", derive(ParquetRecordWriter, ParquetRecordReader))]
pub struct Row {
    /// Place of the run in the campaign.
    pub run: i64,
    /// What went wrong.
    pub fault: String,
    /// What went wrong beside it, or empty.
    pub other_fault: String,
    /// Seed of the run.
    pub seed: i64,
    /// [`Class`] as its name in snake case, or "panicked".
    pub class: String,
    /// See [`Verdict`].
    pub late_s: f64,
    /// See [`Verdict`].
    pub late_m: f64,
    /// See [`Verdict`].
    pub violations: i64,
    /// See [`Verdict`]; NaN if nothing was said.
    pub said_after_s: f64,
    /// Whether the fault lets the vehicle localise again.
    pub can_recover: bool,
    /// See [`Verdict`].
    pub is_recovered: bool,
    /// See [`Verdict`]; NaN if it has not recovered.
    pub recovered_after_s: f64,
    /// See [`Verdict`].
    pub worst_position_m: f64,
    /// See [`Verdict`].
    pub worst_heading_deg: f64,
    /// See [`Verdict`].
    pub seconds: f64,
    /// See [`Verdict`].
    pub degraded_s: f64,
}

/// Why results cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The file cannot be opened or made.
    #[error("{path}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// This program was built without tables.
    #[error(transparent)]
    LeftOut(#[from] agv_host_sim::left_out::LeftOut),
    /// The file is no table of results.
    #[error("{path} is not a table of a campaign's results: {problem}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

/// Class of a run that has panicked.
const PANICKED: &str = "panicked";

/// A class and its name.
const CLASSES: [(Class, &str); 4] = [
    (Class::Unimpressed, "unimpressed"),
    (Class::Said, "said"),
    (Class::Late, "late"),
    (Class::Misleading, "misleading"),
];

impl Row {
    /// The row of a run with these faults.
    #[must_use]
    pub fn new(run: usize, faults: [&str; 2], seed: u64, can_recover: bool, verdict: Option<&Verdict>) -> Self {
        let Some(verdict) = verdict else {
            let [fault, other_fault] = faults.map(str::to_owned);
            let (run, seed, class) = (run as i64, seed as i64, PANICKED.to_owned());
            return Self { run, fault, other_fault, seed, class, can_recover, ..Self::default() };
        };
        let name = CLASSES.iter().find(|(class, _)| *class == verdict.class).map_or("", |(_, name)| name);
        Self {
            run: run as i64,
            fault: faults[0].to_owned(),
            other_fault: faults[1].to_owned(),
            seed: seed as i64,
            class: name.to_owned(),
            late_s: verdict.late_s,
            late_m: verdict.late_m,
            violations: i64::from(verdict.violations),
            said_after_s: verdict.said_after_s.unwrap_or(f64::NAN),
            can_recover,
            is_recovered: verdict.is_recovered,
            recovered_after_s: verdict.recovered_after_s.unwrap_or(f64::NAN),
            worst_position_m: verdict.worst_position_m,
            worst_heading_deg: verdict.worst_heading_deg,
            seconds: verdict.seconds,
            degraded_s: verdict.degraded_s,
        }
    }

    /// Whether the controller or what is around it has panicked.
    #[must_use]
    pub fn has_panicked(&self) -> bool {
        self.class == PANICKED
    }

    /// Its class; none of a run that has panicked.
    #[must_use]
    pub fn class(&self) -> Option<Class> {
        CLASSES.iter().find(|(_, name)| *name == self.class).map(|(class, _)| *class)
    }
}
