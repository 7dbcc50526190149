//! Files that people write or other programs leave: read whole, refused in one line.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use crate::file_kind;
use crate::left_out::LeftOut;

/// Why a text file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TextFileError {
    /// The file does not exist.
    #[error("{}: there is no such file", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The file holds nothing.
    #[error("{}: there are no data in the file", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is something else.
    #[error("{}: this is not {expected} but {looks_like}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it should be.
        expected: &'static str,
        /// What it seems to be.
        looks_like: &'static str,
    },
    /// This program was built without what reads it.
    #[error("{}: {source}", path.display())]
    LeftOut {
        /// The file.
        path: PathBuf,
        /// What was left out.
        source: LeftOut,
    },
    /// A line is not what it should be.
    #[error("{}:{line}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
}

impl TextFileError {
    /// What the operating system said of a file.
    #[must_use]
    pub fn of_system(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        if source.kind() == std::io::ErrorKind::NotFound { Self::Missing { path } } else { Self::Io { path, source } }
    }

    /// What is wrong with a line, counted from 1.
    #[must_use]
    pub fn of_line(path: &Path, line: usize, problem: impl Into<String>) -> Self {
        Self::Line { path: path.to_owned(), line, problem: problem.into() }
    }
}

/// The text of a file.
///
/// # Errors
/// If the file is missing, cannot be read, is empty, or is not text.
pub fn read(path: &Path, expected: &'static str) -> Result<String, TextFileError> {
    let bytes = std::fs::read(path).map_err(|source| TextFileError::of_system(path, source))?;
    text(path, bytes, expected)
}

/// The text of a file that may be compressed with gzip, which its name then says.
///
/// # Errors
/// As [`read`], and if it cannot be unpacked.
pub fn read_unpacked(path: &Path, expected: &'static str) -> Result<String, TextFileError> {
    if path.extension().is_none_or(|extension| extension != "gz") {
        return read(path, expected);
    }
    let file = std::fs::File::open(path).map_err(|source| TextFileError::of_system(path, source))?;
    let mut bytes = Vec::new();
    MultiGzDecoder::new(file).read_to_end(&mut bytes).map_err(|source| TextFileError::of_system(path, source))?;
    text(path, bytes, expected)
}

/// What programs of Windows put before a text.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

fn text(path: &Path, mut bytes: Vec<u8>, expected: &'static str) -> Result<String, TextFileError> {
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    if bytes.trim_ascii().is_empty() {
        return Err(TextFileError::Empty { path: path.to_owned() });
    }
    let looks_like = file_kind::describe(&bytes[..bytes.len().min(4096)]);
    let foreign = |looks_like| TextFileError::Foreign { path: path.to_owned(), expected, looks_like };
    if !looks_like.starts_with("text") {
        return Err(foreign(looks_like));
    }
    String::from_utf8(bytes).map_err(|_| foreign("text with binary data in it"))
}
