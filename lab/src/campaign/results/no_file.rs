//! Stands for Apache Parquet where it was left out.

use std::path::Path;

use super::TABLES;
use super::{ResultsError, Row};

/// Refuses.
///
/// # Errors
/// Always.
pub fn write(_: &Path, _: &[Row]) -> Result<(), ResultsError> {
    Err(TABLES.into())
}

/// Refuses.
///
/// # Errors
/// Always.
pub fn read(_: &Path) -> Result<Vec<Row>, ResultsError> {
    Err(TABLES.into())
}
