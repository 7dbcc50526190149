//! A scan as if all of its beams were simultaneous.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose, difference};

use crate::recording::{RecordedScan, Truth, truth_at};

/// Neighbouring returns whose ranges differ by less than this are of one surface, m.
const CONNECTED: f64 = 0.3;

/// What the scan would hold if the vehicle had stood still where it was at the first beam, as far as `poses` of R tell its
/// motion; beams meet the straight lines between neighbouring returns. None if the motion is not known.
#[must_use]
pub fn simultaneous(scan: &RecordedScan, poses: &[Truth], laser: &Pose) -> Option<RecordedScan> {
    let start = truth_at(poses, scan.start)?.compose(laser);
    let mut returns: Vec<Option<(f64, f64)>> = Vec::with_capacity(scan.ranges.len());
    for (beam, range) in scan.ranges.iter().enumerate() {
        let range = f64::from(*range);
        if !(range.is_finite() && range > 0.0) {
            returns.push(None);
            continue;
        }
        let pose = truth_at(poses, scan.start.offset(beam as f64 * scan.beam_interval))?.compose(laser);
        let bearing = scan.first_bearing + beam as f64 * scan.bearing_step;
        let (sine, cosine) = bearing.sin_cos();
        let point = start.inverse_transform(&pose.transform(&Point::new(range * cosine, range * sine)));
        returns.push(Some((point.y.atan2(point.x), point.norm())));
    }
    let mut ranges = vec![0.0_f32; scan.ranges.len()];
    let is_circle = (scan.bearing_step * scan.ranges.len() as f64 - TAU).abs() < 1e-6;
    // Position of a bearing among the beams, counted so that the middle of the field of view is continuous.
    let middle = scan.first_bearing + 0.5 * scan.bearing_step * scan.ranges.len() as f64;
    let place = |bearing: f64| (difference(bearing, middle) + (middle - scan.first_bearing)) / scan.bearing_step;
    let mut put = |beam: f64, range: f64| {
        let count = ranges.len() as f64;
        let beam = if is_circle { beam.rem_euclid(count) } else { beam };
        if let Some(slot) = ranges.get_mut(beam as usize).filter(|_| beam >= 0.0)
            && (*slot == 0.0 || range < f64::from(*slot))
        {
            *slot = range as f32;
        }
    };
    for pair in returns.windows(2) {
        let [Some((first_bearing, first)), second] = *pair else { continue };
        let at = place(first_bearing);
        match second {
            Some((second_bearing, second)) if (first - second).abs() < CONNECTED => {
                let width = difference(second_bearing, first_bearing);
                let next = at + width / scan.bearing_step;
                let mut beam = at.min(next).ceil();
                while beam <= at.max(next) && width.abs() < 0.1 * PI {
                    // The straight line between both, at the bearing of the beam (law of areas).
                    let angle = (beam - at) * scan.bearing_step;
                    let areas = first * angle.sin() + second * (width - angle).sin();
                    let met = if width.abs() < 1e-9 { first } else { first * second * width.sin() / areas };
                    put(beam, met);
                    beam += 1.0;
                }
            }
            _ => put(at.round(), first),
        }
    }
    Some(RecordedScan { ranges, ..scan.clone() })
}

#[cfg(test)]
mod tests {
    use agv_core::measurement::{LaserId, Time};

    use super::*;

    #[test]
    fn a_moving_scan_of_a_room_becomes_that_of_a_standing_one() {
        // A room of 8 x 5 m; the vehicle drives at 1 m/s and turns at 0.3 rad/s during the revolution of 0.125 s.
        let beams = 1440;
        let step = TAU / f64::from(beams);
        let range_at = |pose: &Pose, bearing: f64| {
            let (sine, cosine) = (pose.theta + bearing).sin_cos();
            let along = |position: f64, size: f64, direction: f64| {
                if direction > 0.0 { (size - position) / direction } else { -position / direction }
            };
            along(pose.x, 8.0, cosine).min(along(pose.y, 5.0, sine))
        };
        let motion = |time: f64| Pose::new(3.0 + time, 2.0, 0.2 + 0.3 * time);
        let poses: Vec<_> = (0..=20)
            .map(|sample| f64::from(sample) * 0.01)
            .map(|time| Truth { time: Time::from_seconds(time), pose: motion(time) })
            .collect();
        let interval = 0.125 / f64::from(beams);
        let bearing = |beam: i32| -PI + step * f64::from(beam);
        let scan = RecordedScan {
            laser: LaserId::FIRST,
            start: Time::default(),
            beam_interval: interval,
            first_bearing: -PI,
            bearing_step: step,
            ranges: (0..beams)
                .map(|beam| range_at(&motion(interval * f64::from(beam)), bearing(beam)) as f32)
                .collect(),
            intensities: Vec::new(),
        };
        let standing = simultaneous(&scan, &poses, &Pose::default()).unwrap();
        let errors = (0..beams).filter_map(|beam| {
            let range = f64::from(standing.ranges[beam as usize]);
            let expected = range_at(&motion(0.0), bearing(beam));
            (range > 0.0).then_some((range - expected).abs())
        });
        let errors: Vec<_> = errors.collect();
        // The end of the revolution leaves a gap, or meets what its beginning saw.
        assert!(errors.len() > 1400, "{}", errors.len());
        let far = errors.iter().filter(|error| **error > 0.005).count();
        assert!(far < 10, "{far}");
    }
}
