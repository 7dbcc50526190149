//! Clouds in the files of others: PCD, KITTI's `.bin`, PLY and LAS.

mod formats;
mod plain_numbers;
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
    /// The file is compressed in a way that is not read.
    #[error("{}: compressed LAS is not read: `pdal translate IN.laz OUT.las` or `laszip -i IN.laz -o OUT.las` unpacks it", path.display())]
    Compressed {
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

/// A cloud, and what was assumed or is doubtful of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileCloud {
    /// Points in the order of the file.
    pub points: Vec<FilePoint>,
    /// What was assumed.
    pub notes: Vec<String>,
    /// What is probably wrong.
    pub warnings: Vec<String>,
}

/// A format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Point Cloud Library: text, binary or compressed; `ring` or `channel` are rings.
    Pcd,
    /// Plain 32-bit floats, one point after the other: x, y, z and reflectance (KITTI), and the ring (nuScenes).
    Plain,
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
            "bin" => Some(Self::Plain),
            "ply" => Some(Self::Ply),
            "las" => Some(Self::Las),
            _ => None,
        }
    }
}

/// Whether a name is that of a compressed LAS file.
#[must_use]
pub fn is_compressed(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("laz"))
}

/// Reads a cloud.
///
/// # Errors
/// See [`CloudFileError`].
pub fn read_cloud(path: &Path) -> Result<FileCloud, CloudFileError> {
    if is_compressed(path) {
        return Err(CloudFileError::Compressed { path: path.to_owned() });
    }
    let format = Format::of(path).ok_or_else(|| CloudFileError::Format { path: path.to_owned() })?;
    let failed = |reason: String| CloudFileError::Read { path: path.to_owned(), reason };
    let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    if bytes.is_empty() {
        return Err(failed("the file holds no data".to_string()));
    }
    let cloud = match format {
        Format::Pcd => formats::pcd(&bytes),
        Format::Plain => plain_numbers::read(&bytes),
        Format::Ply => formats::ply(&bytes),
        Format::Las => formats::las(bytes),
    };
    let cloud = cloud.map_err(failed)?;
    if cloud.points.iter().any(FilePoint::is_seen) { Ok(cloud) } else { Err(failed("it holds no point".to_string())) }
}

/// The points of a cloud, in the order of the file.
///
/// # Errors
/// See [`CloudFileError`].
pub fn read(path: &Path) -> Result<Vec<FilePoint>, CloudFileError> {
    read_cloud(path).map(|cloud| cloud.points)
}
