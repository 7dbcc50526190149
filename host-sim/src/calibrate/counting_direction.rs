//! Whether a counter counts the wrong way.

use super::counted::{Counted, CounterFault};
use super::model::VehicleModel;
use super::odometry_path::OdometryPath;
use super::windows::LaserPose;

/// Time over which motions are compared, s.
const SPAN: f64 = 0.5;
/// The counters disagree with the laser if they explain less than this share of its motion.
pub(super) const POOR: f64 = 0.5;
/// Another direction of counting must explain the motion better by this factor.
const CLEARLY_BETTER: f64 = 3.0;

/// How much of the laser's motion the counters do not explain: their difference over the motion, where a radian counts as
/// a metre. None if the laser hardly moves.
pub(super) fn unexplained(counted: &[Counted], model: &VehicleModel, poses: &[LaserPose]) -> Option<f64> {
    let odometry = OdometryPath::new(counted, model);
    let (mut difference, mut motion) = (0.0, 0.0);
    let mut last: Option<&LaserPose> = None;
    for pose in poses {
        let Some(before) = last else {
            last = Some(pose);
            continue;
        };
        if pose.time.since(before.time) < SPAN {
            continue;
        }
        let measured = before.pose.between(&pose.pose);
        let claimed = odometry.laser_at(before.time).between(&odometry.laser_at(pose.time));
        difference += (measured.position() - claimed.position()).norm()
            + agv_core::geometry::difference(measured.theta, claimed.theta).abs();
        motion += measured.position().norm() + measured.theta.abs();
        last = Some(pose);
    }
    (motion > 0.1).then(|| difference / motion)
}

/// Looks whether a counter runs the wrong way. `seen` says how the laser moved, and `poses` says it for other counters, as
/// following reflectors rests on them; None if it cannot be told. Gives the counters as they should be.
pub fn wrong_direction(
    counted: &[Counted],
    model: &VehicleModel,
    seen: Option<&[LaserPose]>,
    poses: impl Fn(&[Counted]) -> Option<Vec<LaserPose>>,
) -> Option<(CounterFault, Vec<Counted>)> {
    let as_it_is = seen.and_then(|seen| unexplained(counted, model, seen)).unwrap_or(f64::INFINITY);
    if as_it_is < POOR {
        return None;
    }
    let reversed = |is_steering: bool| {
        let turn = |sample: &Counted| match is_steering {
            true => Counted { steering: -sample.steering, ..*sample },
            false => Counted { ticks: -sample.ticks, ..*sample },
        };
        let turned: Vec<Counted> = counted.iter().map(turn).collect();
        Some((unexplained(&turned, model, &poses(&turned)?)?, CounterFault::WrongDirection { is_steering }, turned))
    };
    let best = [false, true].into_iter().filter_map(reversed).min_by(|first, second| first.0.total_cmp(&second.0));
    best.filter(|(left, ..)| *left < POOR && CLEARLY_BETTER * left < as_it_is).map(|(_, fault, turned)| (fault, turned))
}
