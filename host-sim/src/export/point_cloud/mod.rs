//! Point clouds for other programs: PCD, PLY and LAS.

#[cfg(not(feature = "point-clouds"))]
#[path = "no_writers.rs"]
mod writers;
#[cfg(feature = "point-clouds")]
mod writers;

use std::path::{Path, PathBuf};

use agv_lidar3d::packet::Point;

/// Why a cloud could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PointCloudError {
    /// The ending of the name is none of those that are known.
    #[error("{}: the name does not end in .pcd, .ply or .las", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("{}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system or the format says.
        reason: String,
    },
}

/// A format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Point Cloud Library.
    Pcd,
    /// Stanford polygon file.
    Ply,
    /// ASPRS LAS 1.2.
    Las,
}

impl Format {
    /// By the ending of a name.
    ///
    /// # Errors
    /// [`PointCloudError::Format`].
    pub fn of(path: &Path) -> Result<Self, PointCloudError> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("pcd") => Ok(Self::Pcd),
            Some("ply") => Ok(Self::Ply),
            Some("las") => Ok(Self::Las),
            _ => Err(PointCloudError::Format { path: path.to_owned() }),
        }
    }
}

/// Writes points: x, y, z in m, intensity and the ring from the lowest up (in LAS: user data); in PCD also which return it
/// is (0 unknown, 1 first, 2 second, 3 strongest, 4 second strongest, 5 last, 6 both) and the time after the beginning
/// of the turn, s.
///
/// # Errors
/// See [`PointCloudError`].
pub fn write(path: &Path, points: &[Point]) -> Result<(), PointCloudError> {
    let outcome = match Format::of(path)? {
        Format::Pcd => writers::write_pcd(path, points.iter().map(|point| Some(*point)), points.len(), 1),
        Format::Ply => writers::write_ply(path, points),
        Format::Las => writers::write_las(path, points),
    };
    outcome.map_err(|reason| PointCloudError::Write { path: path.to_owned(), reason })
}

/// Writes an organised cloud as PCD: a ring a row, not a number where nothing was seen.
///
/// # Errors
/// See [`PointCloudError`].
pub fn write_organised(path: &Path, cloud: &[Option<[f32; 3]>], rings: usize) -> Result<(), PointCloudError> {
    if Format::of(path)? != Format::Pcd {
        let reason = "only PCD holds organised clouds".to_owned();
        return Err(PointCloudError::Write { path: path.to_owned(), reason });
    }
    let columns = cloud.len() / rings.max(1);
    let points = cloud.iter().enumerate().map(|(place, position)| {
        let laser = (place / columns.max(1)) as u8;
        // Rows go down, rings go up.
        let ring = (rings.saturating_sub(1) as u8).saturating_sub(laser);
        position.map(|position| Point { position, laser, ring, ..Point::default() })
    });
    let outcome = writers::write_pcd(path, points, columns, rings);
    outcome.map_err(|reason| PointCloudError::Write { path: path.to_owned(), reason })
}
