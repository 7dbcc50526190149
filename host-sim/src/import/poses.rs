//! Poses as most programs for multi-beam lidars write them: twelve numbers a line.

use std::path::Path;

use crate::text_file::{self, TextFileError};

/// Reads x, y (m) and heading (rad) of each line, which holds the three rows of a rotation with its translation.
///
/// # Errors
/// If the file cannot be read, or a line is something else.
pub fn read(path: &Path) -> Result<Vec<[f64; 3]>, TextFileError> {
    let text = text_file::read(path, "a file of poses")?;
    let pose = |(index, line): (usize, &str)| {
        let values: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        match values.as_deref() {
            Ok([r00, _, _, x, r10, _, _, y, _, _, _, _]) if [r00, x, r10, y].iter().all(|value| value.is_finite()) => {
                Ok([*x, *y, r10.atan2(*r00)])
            }
            _ => Err(TextFileError::of_line(path, index + 1, "this is no pose of twelve numbers")),
        }
    };
    text.lines().enumerate().map(pose).collect()
}
