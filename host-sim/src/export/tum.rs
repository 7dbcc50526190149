//! Poses as TUM's tools and `evo` read them: a line `time x y z qx qy qz qw` for each, in s, m and a unit quaternion.

use std::io::{self, Write};

use agv_core::geometry::Pose;
use agv_core::measurement::Time;

use crate::drive::Track;
use crate::recording::{Recording, truth_at};

/// Writes poses.
///
/// # Errors
/// If `output` takes no more.
pub fn write(poses: impl Iterator<Item = (Time, Pose)>, output: &mut impl Write) -> io::Result<()> {
    writeln!(output, "# timestamp tx ty tz qx qy qz qw")?;
    for (time, pose) in poses {
        let (sine, cosine) = (0.5 * pose.theta).sin_cos();
        let [seconds, micros] = [time.micros() / 1_000_000, time.micros() % 1_000_000];
        writeln!(output, "{seconds}.{micros:06} {} {} 0 0 0 {sine} {cosine}", pose.x, pose.y)?;
    }
    Ok(())
}

/// The poses that are compared with the truth: the last one of each instant.
pub fn estimated(track: &Track) -> impl Iterator<Item = (Time, Pose)> {
    track.points.iter().map(|point| (point.output.time, point.output.pose))
}

/// Where the vehicle really was at the times of its poses.
pub fn truth<'a>(recording: &'a Recording, track: &'a Track) -> impl Iterator<Item = (Time, Pose)> + 'a {
    track.points.iter().filter_map(|point| {
        let time = point.output.time;
        Some((time, truth_at(&recording.truth, time)?))
    })
}
