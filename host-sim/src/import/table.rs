//! Rows of numbers, with the place of every fault.

use std::path::Path;

use crate::text_file::{self, TextFileError};

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
pub fn read_rows(path: &Path, columns: usize) -> Result<Vec<Row>, TextFileError> {
    let expected = "a table of numbers";
    let text = text_file::read(path, expected)?;
    let problem = |line, problem| TextFileError::Line { path: path.to_owned(), line, problem };
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
    if rows.is_empty() { Err(TextFileError::Empty { path: path.to_owned() }) } else { Ok(rows) }
}

/// A word that fits on a line of a message.
pub fn shorten(word: &str) -> String {
    word.chars().take(40).collect()
}
