//! Stands for the formats of point clouds where they were left out.

use std::path::Path;

use agv_lidar3d::packet::Point;

use crate::left_out::POINT_CLOUDS;

pub(super) fn write_pcd(_: &Path, _: impl Iterator<Item = Option<Point>>, _: usize, _: usize) -> Result<(), String> {
    Err(POINT_CLOUDS.to_string())
}

pub(super) fn write_ply(_: &Path, _: &[Point]) -> Result<(), String> {
    Err(POINT_CLOUDS.to_string())
}

pub(super) fn write_las(_: &Path, _: &[Point]) -> Result<(), String> {
    Err(POINT_CLOUDS.to_string())
}
