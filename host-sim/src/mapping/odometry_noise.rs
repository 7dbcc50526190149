//! The noise of an odometry, by what its scans say.

use agv_core::contours::{ContourMatcher, Prediction};
use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::odometry::OdometryNoise;
use agv_core::sensing::{PointScan, SensorPath};
use agv_core::state::PoseOutput;

use super::known_poses::by_odometry;
use crate::accuracy::quantile;
use crate::import::{BEAMS, RANGES};
use crate::recording::{RecordedEvent, RecordedScan, Recording};
use crate::replay::{ReplayError, replay};

/// Places along the way during a revolution.
const PATH_STEPS: u32 = 8;

/// Where the odometry has the vehicle.
struct OdometryPath<'a>(&'a [PoseOutput]);

impl OdometryPath<'_> {
    /// At a time, at constant body velocity between the poses that were told; the nearest one outside of them.
    fn at(&self, time: Time) -> Option<Pose> {
        let after = self.0.partition_point(|pose| pose.time <= time);
        let Some(before) = after.checked_sub(1).map(|before| self.0[before]) else {
            return self.0.first().map(|first| first.smooth);
        };
        let Some(next) = self.0.get(after) else { return Some(before.smooth) };
        let share = time.since(before.time) / next.time.since(before.time);
        Some(before.smooth.compose(&before.smooth.between(&next.smooth).fraction(share)))
    }

    /// Moves the returns of a scan to where they are seen from at its first beam.
    fn points(&self, scan: &RecordedScan, mount: &Pose, points: &mut PointScan<BEAMS>) {
        let view = scan.view();
        points.set(&view, RANGES.0, RANGES.1);
        let (start, duration) = (scan.start, view.end().since(scan.start));
        if duration <= 0.0 {
            return;
        }
        let Some(from) = self.at(start) else { return };
        let times = (0..=PATH_STEPS).map(|step| start.offset(duration * f64::from(step) / f64::from(PATH_STEPS)));
        let displacements = times.filter_map(|time| Some((time, from.between(&self.at(time)?))));
        let mut path = SensorPath::default();
        path.set(start, mount, displacements);
        path.correct(&view, points);
    }
}

/// Steps shorter than this say nothing of the noise, m.
const LEAST_WAY: f64 = 0.05;

/// Turns smaller than this say nothing of the noise of a turn, and larger ones nothing of that of the way, rad.
const LEAST_TURN: f64 = 0.1;

/// Fewest steps that say something.
const FEWEST_STEPS: usize = 20;

/// The noise of the odometry by what remains between its steps and those of scans matched to the way behind. The random walks are taken
/// from the 80 per cent quantile, as a few steps in a hundred are wrong by far more than the others; what the parameters
/// state is not made less.
///
/// # Errors
/// If the recording cannot be replayed.
pub fn odometry_noise(recording: &Recording) -> Result<OdometryNoise, ReplayError> {
    let odometry = replay(&by_odometry(recording, Pose::default()), |_| {})?;
    let path = OdometryPath(&odometry.poses);
    let mut matcher: Box<ContourMatcher> = Box::default();
    let mut points: Box<PointScan<BEAMS>> = Box::default();
    let mut last: Option<(Pose, Pose)> = None;
    let (mut along, mut yaw, mut turn) = (Vec::new(), Vec::new(), Vec::new());
    for event in &recording.events {
        let RecordedEvent::Scan(scan) = event else { continue };
        if scan.laser != agv_core::measurement::LaserId::FIRST {
            continue;
        }
        let (mount, Some(smooth)) = (recording.parameters.lasers.first(), path.at(scan.start)) else { continue };
        path.points(scan, mount, &mut points);
        matcher.see(points.view());
        let laser = smooth.compose(mount);
        let mut pose = laser;
        if let Some((before, found_before)) = last {
            let step = before.between(&laser);
            let way = step.position().norm();
            let prediction = Prediction::by_odometry(&found_before, &step);
            pose = prediction.pose;
            if let Some(found) = matcher.align(&prediction).filter(|found| found.share > 0.5) {
                pose = found.pose;
                let rest = step.between(&found_before.between(&found.pose));
                if way > LEAST_WAY && found.free_axis.is_none() {
                    along.push(rest.position().norm() / way.sqrt());
                }
                if step.theta.abs() > LEAST_TURN {
                    turn.push(rest.theta.abs() / step.theta.abs().sqrt());
                } else if way > LEAST_WAY {
                    yaw.push(rest.theta.abs() / way.sqrt());
                }
            }
        }
        matcher.keep(&pose);
        last = Some((laser, pose));
    }
    let stated = recording.parameters.odometry_noise;
    let walk = |mut rests: Vec<f64>, least: f64| {
        rests.sort_by(f64::total_cmp);
        // A normal number is within 1.28 deviations in 80 per cent.
        if rests.len() < FEWEST_STEPS { least } else { (quantile(&rests, 0.8) / 1.28).max(least) }
    };
    Ok(OdometryNoise {
        slip: walk(along.clone(), stated.slip),
        side_slip: walk(along, stated.side_slip),
        yaw: walk(yaw, stated.yaw),
        turn: walk(turn, stated.turn),
        ..stated
    })
}
