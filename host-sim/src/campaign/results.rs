//! What became of the runs of a campaign, as a file in Apache Parquet.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::{RecordReader as _, RecordWriter as _};
use parquet_derive::{ParquetRecordReader, ParquetRecordWriter};
use serde::Serialize;

use super::verdict::{Class, Verdict};

/// One run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, ParquetRecordWriter, ParquetRecordReader)]
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

/// Writes rows. The same rows make the same bytes.
///
/// # Errors
/// See [`ResultsError`].
pub fn write(path: &Path, rows: &[Row]) -> Result<(), ResultsError> {
    let format = |problem: parquet::errors::ParquetError| ResultsError::Format {
        path: path.to_path_buf(),
        problem: problem.to_string(),
    };
    let schema = rows.schema().map_err(format)?;
    let file = File::create(path).map_err(|source| ResultsError::Io { path: path.to_path_buf(), source })?;
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(format)?;
    let mut group = writer.next_row_group().map_err(format)?;
    rows.write_to_row_group(&mut group).map_err(format)?;
    group.close().map_err(format)?;
    writer.close().map_err(format)?;
    Ok(())
}

/// Reads rows.
///
/// # Errors
/// See [`ResultsError`].
pub fn read(path: &Path) -> Result<Vec<Row>, ResultsError> {
    let format = |problem: parquet::errors::ParquetError| ResultsError::Format {
        path: path.to_path_buf(),
        problem: problem.to_string(),
    };
    let file = File::open(path).map_err(|source| ResultsError::Io { path: path.to_path_buf(), source })?;
    let reader = SerializedFileReader::new(file).map_err(format)?;
    let mut rows: Vec<Row> = Vec::new();
    for index in 0..reader.num_row_groups() {
        let mut group = reader.get_row_group(index).map_err(format)?;
        let count = group.metadata().num_rows() as usize;
        let mut some: Vec<Row> = Vec::new();
        some.read_from_row_group(&mut *group, count).map_err(format)?;
        rows.extend(some);
    }
    Ok(rows)
}
