//! Maps as files: one landmark a line.
//!
//! ```text
//! id,kind,x_m,y_m,deviation_m
//! 0,reflector,1.250000,-3.400000,0.002000
//! ```
//!
//! Kinds are `reflector`, `corner` and `end_point`; positions are in W. Identifiers are unique among reflectors and among
//! the other kinds.

use std::collections::HashSet;
use std::fmt::Write;
use std::path::Path;

use agv_core::maps::{Landmark, LandmarkKind};

use crate::output_file;
use crate::text_file::{self, TextFileError};

/// First line of every map.
pub const HEADER: &str = "id,kind,x_m,y_m,deviation_m";

/// Whether a file begins as a map does.
#[must_use]
pub fn is_map(path: &Path) -> bool {
    text_file::read(path, "a map").is_ok_and(|text| text.lines().next().is_some_and(|first| first.trim() == HEADER))
}

/// Reads a map.
///
/// # Errors
/// See [`TextFileError`].
pub fn read(path: &Path) -> Result<Vec<Landmark>, TextFileError> {
    let expected = "a map";
    let text = text_file::read(path, expected)?;
    let mut lines = text.lines().zip(1..);
    if lines.next().is_none_or(|(header, _)| header.trim() != HEADER) {
        return Err(TextFileError::Foreign {
            path: path.to_owned(),
            expected,
            looks_like: "text without a map's heading",
        });
    }
    let mut known = HashSet::new();
    let mut landmarks = Vec::new();
    for (text, line) in lines.filter(|(text, _)| !text.trim().is_empty()) {
        let landmark = parse(text).map_err(|problem| TextFileError::of_line(path, line, problem))?;
        if !known.insert((landmark.kind == LandmarkKind::Reflector, landmark.id)) {
            let problem = format!("there is another landmark {}", landmark.id);
            return Err(TextFileError::of_line(path, line, problem));
        }
        landmarks.push(landmark);
    }
    Ok(landmarks)
}

fn parse(text: &str) -> Result<Landmark, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [id, kind, x, y, deviation] = fields[..] else {
        return Err(format!("{} fields instead of 5", fields.len()));
    };
    let length = |name: &str, text: &str| {
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| format!("{name} is '{text}' instead of a number"))
    };
    let kind = match kind {
        "reflector" => LandmarkKind::Reflector,
        "corner" => LandmarkKind::Corner,
        "end_point" => LandmarkKind::EndPoint,
        other => return Err(format!("kind is '{other}' instead of reflector, corner or end_point")),
    };
    let deviation = length("deviation_m", deviation)?;
    if deviation < 0.0 {
        return Err("deviation_m is negative".to_owned());
    }
    Ok(Landmark {
        id: id.parse().map_err(|_| format!("id is '{id}' instead of a whole number up to 65535"))?,
        kind,
        x: length("x_m", x)?,
        y: length("y_m", y)?,
        deviation: deviation as f32,
    })
}

/// Writes a map; an older file of that name is replaced. Lengths are rounded to a micrometre.
///
/// # Errors
/// [`TextFileError::Io`] if the file cannot be written.
pub fn write(path: &Path, landmarks: &[Landmark]) -> Result<(), TextFileError> {
    let mut text = format!("{HEADER}\n");
    for Landmark { id, kind, x, y, deviation } in landmarks {
        let kind = match kind {
            LandmarkKind::Reflector => "reflector",
            LandmarkKind::Corner => "corner",
            LandmarkKind::EndPoint => "end_point",
        };
        let _ = writeln!(text, "{id},{kind},{x:.6},{y:.6},{deviation:.6}");
    }
    output_file::write(path, text).map_err(|source| TextFileError::Io { path: path.to_owned(), source })
}
