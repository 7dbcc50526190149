//! Ways past what stands in a world: straight to a place, a turn on the spot, straight to the next.

use agv_core::geometry::{Pose, difference, wrap};
use agv_host_sim::simulate::random::Random;

use super::sites::Site;

/// Speed, m/s, and rate of turn, rad/s.
const SPEED: f64 = 1.0;
const TURN: f64 = 0.5;

/// Shortest and longest straight way, m.
const LEG: (f64, f64) = (2.0, 15.0);

/// Distance between places that must be free, m.
const STEP: f64 = 0.1;

/// Places that are tried before a way ends.
const TRIES: usize = 20_000;

/// Poses of a vehicle in a world, `interval` seconds apart, for `seconds`; fewer if no way leads on.
pub(super) fn way(site: &Site, seconds: f64, interval: f64, random: &mut Random) -> Vec<Pose> {
    let mut poses = vec![site.free_pose(random)];
    let wanted = (seconds / interval) as usize + 1;
    for _ in 0..TRIES {
        let Some(from) = poses.last().copied().filter(|_| poses.len() < wanted) else { break };
        let to = site.free_pose(random);
        let apart = to.position() - from.position();
        let length = apart.norm();
        let is_free = |step: usize| site.is_free(&(from.position() + apart * (STEP * step as f64 / length)));
        if !(LEG.0..LEG.1).contains(&length) || !(0..(length / STEP) as usize).all(is_free) {
            continue;
        }
        let turn = difference(apart.y.atan2(apart.x), from.theta);
        let steps = (turn.abs() / (TURN * interval)).ceil().max(1.0);
        poses.extend((1..=steps as usize).map(|step| {
            let theta = wrap(from.theta + turn * step as f64 / steps);
            Pose { theta, ..from }
        }));
        let theta = wrap(from.theta + turn);
        let steps = (length / (SPEED * interval)).ceil();
        poses.extend((1..=steps as usize).map(|step| {
            let place = from.position() + apart * (step as f64 / steps);
            Pose::new(place.x, place.y, theta)
        }));
    }
    poses.truncate(wanted);
    poses
}
