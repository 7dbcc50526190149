//! Scans as the point clouds of others: a file a scan.

use std::path::{Path, PathBuf};

#[cfg(feature = "point-clouds")]
use agv_lidar3d::cloud_file;

use super::revolution::Revolution;
use agv_lidar3d::calibration::Laser;

/// Whether a name is that of a point cloud: it ends in .pcd, .bin, .ply or .las.
#[must_use]
pub fn is_cloud(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    matches!(ending.as_deref(), Some("pcd" | "bin" | "ply" | "las"))
}

/// The point clouds in a folder, by name. Empty if there is none, or the folder cannot be read.
#[must_use]
pub fn in_folder(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| is_cloud(file));
    files.sort();
    files
}

/// The points of a file as one revolution, and the lasers that its rings are of.
///
/// # Errors
/// One line.
#[cfg(feature = "point-clouds")]
pub fn read(path: &Path) -> Result<(Revolution, Vec<Laser>), String> {
    let cloud = cloud_file::read(path).map_err(|error| error.to_string())?;
    let cloud = cloud_file::ringed(&cloud);
    Ok((Revolution { points: cloud.points, is_whole: true, ..Revolution::default() }, cloud.lasers))
}

/// Stands for the formats where they were left out.
///
/// # Errors
/// That they were.
#[cfg(not(feature = "point-clouds"))]
pub fn read(path: &Path) -> Result<(Revolution, Vec<Laser>), String> {
    Err(format!("{}: {}", path.display(), crate::left_out::POINT_CLOUDS))
}
