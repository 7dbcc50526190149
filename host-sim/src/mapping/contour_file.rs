//! Maps of contours as files: one point of a surface a line.
//!
//! ```text
//! x_m,y_m,facing_deg
//! 1.2500,-3.4000,90.0
//! 1.3000,-3.4000,
//! ```
//!
//! Positions are in W. The direction in which the surface faces is counter-clockwise from the first axis of W; a corner has
//! none.

use std::fmt::Write;
use std::path::Path;

use agv_core::geometry::Point;

use crate::contour_map::{ContourMap, MapPoint};
use crate::output_file;
use crate::text_file::{self, TextFileError};

/// First line of every such map.
pub const HEADER: &str = "x_m,y_m,facing_deg";

/// Whether a file begins as such a map does.
#[must_use]
pub fn is_contour_map(path: &Path) -> bool {
    text_file::read(path, "a map").is_ok_and(|text| text.lines().next().is_some_and(|line| line.trim() == HEADER))
}

/// Reads a map.
///
/// # Errors
/// See [`TextFileError`].
pub fn read(path: &Path) -> Result<ContourMap, TextFileError> {
    let expected = "a map of contours";
    let text = text_file::read(path, expected)?;
    let mut lines = text.lines().zip(1..);
    if lines.next().is_none_or(|(header, _)| header.trim() != HEADER) {
        let looks_like = "text without its heading";
        return Err(TextFileError::Foreign { path: path.to_owned(), expected, looks_like });
    }
    let mut points = Vec::new();
    for (text, line) in lines.filter(|(text, _)| !text.trim().is_empty()) {
        points.push(parse(text).map_err(|problem| TextFileError::of_line(path, line, problem))?);
    }
    Ok(ContourMap::of(points))
}

fn parse(text: &str) -> Result<MapPoint, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [x, y, facing] = fields[..] else {
        return Err(format!("{} fields instead of 3", fields.len()));
    };
    let number = |name: &str, text: &str| {
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| format!("{name} is '{text}' instead of a number"))
    };
    let normal = if facing.is_empty() {
        Point::zeros()
    } else {
        let (sine, cosine) = number("facing_deg", facing)?.to_radians().sin_cos();
        Point::new(cosine, sine)
    };
    Ok(MapPoint { position: Point::new(number("x_m", x)?, number("y_m", y)?), normal })
}

/// Writes a map; an older file of that name is replaced.
///
/// # Errors
/// [`TextFileError::Io`] if the file cannot be written.
pub fn write(path: &Path, map: &ContourMap) -> Result<(), TextFileError> {
    let mut text = format!("{HEADER}\n");
    for MapPoint { position, normal } in map.points() {
        let _ = write!(text, "{:.4},{:.4},", position.x, position.y);
        if normal != Point::zeros() {
            let _ = write!(text, "{:.1}", normal.y.atan2(normal.x).to_degrees());
        }
        text.push('\n');
    }
    output_file::write(path, text).map_err(|source| TextFileError::Io { path: path.to_owned(), source })
}
