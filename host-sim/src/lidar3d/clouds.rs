//! Scans as the point clouds of others: a file a scan.

use std::path::{Path, PathBuf};

#[cfg(feature = "point-clouds")]
use agv_lidar3d::cloud_file;

use super::revolution::Revolution;
use crate::account::Account;
use agv_lidar3d::calibration::Laser;

/// Whether a name is that of a point cloud: it ends in .pcd, .bin, .ply, .las, or in .laz, which is refused in words.
#[must_use]
pub fn is_cloud(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    matches!(ending.as_deref(), Some("pcd" | "bin" | "ply" | "las" | "laz"))
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
    let cloud = cloud_file::read_cloud(path).map_err(|error| error.to_string())?;
    let cloud = cloud_file::ringed(&cloud.points);
    Ok((Revolution { points: cloud.points, is_whole: true, ..Revolution::default() }, cloud.lasers))
}

/// What was assumed of a file, and what is doubtful in it; nothing if it cannot be read.
#[cfg(feature = "point-clouds")]
#[must_use]
pub fn account(path: &Path) -> Account {
    let mut account = Account::default();
    if let Ok(cloud) = cloud_file::read_cloud(path) {
        cloud.notes.into_iter().for_each(|note| account.note(note));
        cloud.warnings.into_iter().for_each(|warning| account.warn(warning));
    }
    account
}

/// Stands for the formats where they were left out.
#[cfg(not(feature = "point-clouds"))]
#[must_use]
pub fn account(_: &Path) -> Account {
    Account::default()
}

/// Stands for the formats where they were left out.
///
/// # Errors
/// That they were.
#[cfg(not(feature = "point-clouds"))]
pub fn read(path: &Path) -> Result<(Revolution, Vec<Laser>), String> {
    Err(format!("{}: {}", path.display(), crate::left_out::POINT_CLOUDS))
}
