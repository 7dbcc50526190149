//! Rows in Apache Parquet.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use agv_host_sim::output_file::OutputFile;
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::{RecordReader as _, RecordWriter as _};

use super::{ResultsError, Row};

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
    let io = |source| ResultsError::Io { path: path.to_path_buf(), source };
    let file = OutputFile::create(path).map_err(io)?;
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties)).map_err(format)?;
    let mut group = writer.next_row_group().map_err(format)?;
    rows.write_to_row_group(&mut group).map_err(format)?;
    group.close().map_err(format)?;
    writer.into_inner().map_err(format)?.finish().map_err(io)
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
