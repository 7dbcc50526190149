//! Rows of numbers, with the place of every fault.

use std::path::Path;

use crate::delimited;
use crate::text_file::{self, TextFileError};

/// One row and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Line in the file, from 1.
    pub line: usize,
    /// Its numbers.
    pub numbers: Vec<f64>,
}

/// Reads rows of `columns` numbers, separated by commas, semicolons or tabulators. A first row that is no number is a heading.
///
/// # Errors
/// If the file is missing, empty, not text, or a row has another number of columns or something that is no finite number.
pub fn read_rows(path: &Path, columns: usize) -> Result<Vec<Row>, TextFileError> {
    let expected = "a table of numbers";
    let text = text_file::read(path, expected)?;
    let problem = |line, problem| TextFileError::Line { path: path.to_owned(), line, problem };
    let table = delimited::of_text(&text);
    let mut rows = Vec::new();
    for (index, (line, record)) in table.rows.iter().enumerate() {
        let line = *line;
        let number = |word: &str| delimited::number(word, table.has_decimal_commas);
        let is_heading =
            index == 0 && record.iter().all(|word| number(word).is_none() && word.trim().parse::<f64>().is_err());
        if is_heading {
            continue;
        }
        if record.len() != columns {
            return Err(problem(line, format!("there are {} columns instead of {columns}", record.len())));
        }
        let numbers = record
            .iter()
            .enumerate()
            .map(|(column, word)| {
                number(word)
                    .ok_or_else(|| problem(line, format!("column {} is no number: {:?}", column + 1, shorten(word))))
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
