//! Scans, poses and keypoints as text, for a scoring program that knows nothing of this one.
//!
//! `scans.txt`: one scan a line, count, first bearing (rad), step (rad), ranges (m). `poses.txt`: one laser pose a line, x
//! (m), y (m), heading (rad). `keypoints.csv`: one keypoint a line, in the frame of the laser, with a header.

use std::io::{self, Write};
use std::path::Path;

use agv_core::sensing::{Keypoint, KeypointKind};

use crate::import::PosedScan;
use crate::output_file::OutputFile;

/// Writes the three files into `folder`, which is made if it is not there.
pub fn write<'a>(folder: &Path, scans: impl IntoIterator<Item = (&'a PosedScan, Vec<Keypoint>)>) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let create = |name: &str| OutputFile::create(&folder.join(name));
    let (mut scan_file, mut pose_file) = (create("scans.txt")?, create("poses.txt")?);
    let mut keypoint_file = create("keypoints.csv")?;
    writeln!(
        keypoint_file,
        "scan,beam_index,kind,x_m,y_m,orientation_rad,radius_m,score,covariance_xx_m2,covariance_xy_m2,covariance_yy_m2"
    )?;
    for (index, (scan, keypoints)) in scans.into_iter().enumerate() {
        let recorded = &scan.scan;
        write!(scan_file, "{} {} {}", recorded.ranges.len(), recorded.first_bearing, recorded.bearing_step)?;
        for range in &recorded.ranges {
            write!(scan_file, " {range}")?;
        }
        writeln!(scan_file)?;
        writeln!(pose_file, "{} {} {}", scan.laser.x, scan.laser.y, scan.laser.theta)?;
        for keypoint in keypoints {
            let kind = match keypoint.kind {
                KeypointKind::Corner => "corner",
                KeypointKind::EndPoint => "end",
            };
            let [xx, xy, yy] = keypoint.covariance;
            writeln!(
                keypoint_file,
                "{index},{},{kind},{},{},{},{},{},{xx},{xy},{yy}",
                keypoint.beam,
                keypoint.position.x,
                keypoint.position.y,
                keypoint.orientation,
                keypoint.radius,
                keypoint.score
            )?;
        }
    }
    scan_file.finish()?;
    pose_file.finish()?;
    keypoint_file.finish()
}
