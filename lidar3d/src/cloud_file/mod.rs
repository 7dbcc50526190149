//! Clouds in the files of others: PCD, KITTI's `.bin`, PLY and LAS.

mod formats;
mod rings;

use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::vec::Vec;

pub use rings::{Ringed, ringed};

/// Why a file is no cloud.
#[derive(Debug, thiserror::Error)]
pub enum CloudFileError {
    /// The ending of the name is none of those that are known.
    #[error("{}: the name does not end in .pcd, .bin, .ply or .las", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be read, or is not what its name says.
    #[error("{}: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system or the format says.
        reason: String,
    },
}

/// A point of a file; not a number where nothing was seen in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilePoint {
    /// x, y, z, m.
    pub position: [f64; 3],
    /// Intensity, in the file's own unit; 0 if it has none.
    pub intensity: f64,
    /// Number of the ring, if the file states it.
    pub ring: Option<u16>,
}

impl FilePoint {
    /// Whether something was seen.
    #[must_use]
    pub fn is_seen(&self) -> bool {
        self.position.iter().all(|value| value.is_finite()) && self.position != [0.0; 3]
    }
}

/// A format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Point Cloud Library: text, binary or compressed; `ring` or `channel` are rings.
    Pcd,
    /// KITTI: x, y, z and reflectance as 32-bit floats, one point after the other.
    Kitti,
    /// Stanford polygon file, its element `vertex`.
    Ply,
    /// ASPRS LAS, 1.0 to 1.4, not compressed.
    Las,
}

impl Format {
    /// By the ending of a name; None for any other.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
            "pcd" => Some(Self::Pcd),
            "bin" => Some(Self::Kitti),
            "ply" => Some(Self::Ply),
            "las" => Some(Self::Las),
            _ => None,
        }
    }
}

/// Reads a cloud, in the order of the file.
///
/// # Errors
/// See [`CloudFileError`].
pub fn read(path: &Path) -> Result<Vec<FilePoint>, CloudFileError> {
    let format = Format::of(path).ok_or_else(|| CloudFileError::Format { path: path.to_owned() })?;
    let failed = |reason: String| CloudFileError::Read { path: path.to_owned(), reason };
    let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    if bytes.is_empty() {
        return Err(failed("the file holds no data".to_string()));
    }
    let points = match format {
        Format::Pcd => formats::pcd(&bytes),
        Format::Kitti => formats::kitti(&bytes),
        Format::Ply => formats::ply(&bytes),
        Format::Las => formats::las(bytes),
    };
    let points = points.map_err(failed)?;
    if points.iter().any(FilePoint::is_seen) { Ok(points) } else { Err(failed("it holds no point".to_string())) }
}
