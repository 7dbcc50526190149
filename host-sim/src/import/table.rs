//! Rows of numbers, with the place of every fault.

use std::path::{Path, PathBuf};

use crate::file_kind;

/// Why a file of others cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
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

/// The text of a file.
///
/// # Errors
/// If the file is missing, cannot be read, is empty, or is not text.
pub fn read_text(path: &Path, expected: &'static str) -> Result<String, ImportError> {
    let bytes = std::fs::read(path).map_err(|source| {
        let path = path.to_owned();
        if source.kind() == std::io::ErrorKind::NotFound {
            ImportError::Missing { path }
        } else {
            ImportError::Io { path, source }
        }
    })?;
    if bytes.trim_ascii().is_empty() {
        return Err(ImportError::Empty { path: path.to_owned() });
    }
    let looks_like = file_kind::describe(&bytes[..bytes.len().min(4096)]);
    let foreign = |looks_like| ImportError::Foreign { path: path.to_owned(), expected, looks_like };
    if !looks_like.starts_with("text") {
        return Err(foreign(looks_like));
    }
    String::from_utf8(bytes).map_err(|_| foreign("text with binary data in it"))
}

/// One row and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Line in the file, from 1.
    pub line: usize,
    /// Its numbers.
    pub numbers: Vec<f64>,
}

/// Reads rows of `columns` numbers, separated by commas. A first row that is no number is a heading.
///
/// # Errors
/// If the file is missing, empty, not text, or a row has another number of columns or something that is no finite number.
pub fn read_rows(path: &Path, columns: usize) -> Result<Vec<Row>, ImportError> {
    let expected = "a table of numbers";
    let text = read_text(path, expected)?;
    let problem = |line, problem| ImportError::Line { path: path.to_owned(), line, problem };
    let mut table = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
    let mut rows = Vec::new();
    for (index, record) in table.records().enumerate() {
        let record = record.map_err(|error| problem(index + 1, error.to_string()))?;
        let line = record.position().map_or(index + 1, |position| position.line() as usize);
        let is_heading = index == 0 && record.iter().all(|word| word.trim().parse::<f64>().is_err());
        if is_heading {
            continue;
        }
        if record.len() != columns {
            return Err(problem(line, format!("there are {} columns instead of {columns}", record.len())));
        }
        let numbers = record
            .iter()
            .enumerate()
            .map(|(column, word)| match word.trim().parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(number),
                _ => Err(problem(line, format!("column {} is no number: {:?}", column + 1, shorten(word)))),
            })
            .collect::<Result<_, _>>()?;
        rows.push(Row { line, numbers });
    }
    if rows.is_empty() { Err(ImportError::Empty { path: path.to_owned() }) } else { Ok(rows) }
}

/// A word that fits on a line of a message.
pub fn shorten(word: &str) -> String {
    word.chars().take(40).collect()
}
