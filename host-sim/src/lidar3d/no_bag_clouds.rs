//! Stands for clouds in recordings of ROS 2 where these were left out.

use std::ops::ControlFlow;
use std::path::Path;

use agv_lidar3d::calibration::Laser;

use super::revolution::Revolution;
use crate::left_out::{BAGS, POINT_CLOUDS};

fn left_out(path: &Path) -> String {
    let what = BAGS.check().and(POINT_CLOUDS.check());
    format!("{}: {}", path.display(), what.err().map_or(String::new(), |error| error.to_string()))
}

/// Says that they were.
///
/// # Errors
/// Always.
pub fn topic(path: &Path, _: Option<&str>) -> Result<(String, usize), String> {
    Err(left_out(path))
}

/// Says that they were.
///
/// # Errors
/// Always.
pub fn for_each(path: &Path, _: &str, _: impl FnMut(Revolution, Vec<Laser>) -> ControlFlow<()>) -> Result<(), String> {
    Err(left_out(path))
}
