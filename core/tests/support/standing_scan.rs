//! The scan of a laser that stands while it looks around once, in no time.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::Pose;
use agv_core::measurement::{LaserId, Scan, Time};

use super::hall::cast;

/// Where so many beams end that a laser at `sensor` in W sends around, from behind it; `change` is done to each range, m.
pub fn ranges(sensor: &Pose, beams: usize, change: impl Fn(usize, f64) -> f64) -> Vec<f32> {
    let step = TAU / beams as f64;
    (0..beams).map(|beam| change(beam, cast(sensor, beam as f64 * step - PI)) as f32).collect()
}

/// These as a scan.
pub fn scan(time: Time, ranges: &[f32]) -> Scan<'_> {
    Scan {
        laser: LaserId::FIRST,
        start: time,
        beam_interval: 0.0,
        first_bearing: -PI,
        bearing_step: TAU / ranges.len() as f64,
        ranges,
        intensities: &[],
    }
}
