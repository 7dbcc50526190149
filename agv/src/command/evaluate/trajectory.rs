//! Poses in windows of a drive, for other programs.

use std::fmt::Write;
use std::path::Path;

use agv_host_sim::output_file;
use agv_lab::evaluate::windows::{TRAJECTORY_HEADER, WindowPose};
use anyhow::Context;

/// Writes a line for each pose; an older file is replaced.
pub fn write(path: &Path, poses: &[WindowPose]) -> anyhow::Result<()> {
    let mut text = format!("{TRAJECTORY_HEADER}\n");
    for pose in poses {
        let _ = writeln!(text, "{pose}");
    }
    output_file::write(path, text).with_context(|| path.display().to_string())
}
