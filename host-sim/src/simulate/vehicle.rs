//! The true vehicle: a tricycle that follows a path.

use agv_core::geometry::{Pose, Twist, difference};

use super::path::{Direction, Leg, Path};
use super::random::Random;
use super::scenario::{DriveOptions, OdometryOptions};
use super::speed_profile::SpeedProfile;

/// The true vehicle at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleState {
    /// Pose of R in W.
    pub pose: Pose,
    /// True angle of the driving wheel, rad, positive to the left.
    pub steering: f64,
    /// True way of the driving wheel over the ground since the start, m, signed.
    pub wheel_way: f64,
    /// Sense of the present leg; at rest, of the one just driven.
    pub direction: Direction,
    /// Index of that leg.
    pub leg: usize,
}

/// The true vehicle at equal intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Interval between states, s.
    pub interval: f64,
    /// The states; the first is at time zero.
    pub states: Vec<VehicleState>,
}

/// A part of the timetable.
enum Phase<'a> {
    Drive { leg: &'a Leg, index: usize, start: Pose, profile: SpeedProfile },
    Rest { leg: &'a Leg, way: f64, start: Pose, duration: f64 },
}

impl Phase<'_> {
    fn duration(&self) -> f64 {
        match self {
            Self::Drive { profile, .. } => profile.duration(),
            Self::Rest { duration, .. } => *duration,
        }
    }
}

/// Length over which the steering law takes a change of curvature, m.
const CURVATURE_WINDOW: f64 = 0.5;
/// Length within which the steering law takes away an offset from the path, m, and in so many of its steps at least: a law that sees its
/// pose less often sways.
const RETURN_LENGTH: f64 = 0.6;
const RETURN_STEPS: f64 = 5.0;
/// The wheel turns no farther than this to either side, rad.
const LARGEST_STEERING: f64 = 1.4;

/// Drives `path` from standstill to standstill.
///
/// The steering law sees the true pose: curvature of the path plus feedback of lateral and heading offset, critically
/// damped over the way, with a limited steering rate. The floor disturbs the motion by a walk of the heading and a side
/// slip, both white over the way. The path must have legs of positive length.
#[must_use]
pub fn drive(
    path: &Path,
    wheelbase: f64,
    options: &DriveOptions,
    disturbance: &OdometryOptions,
    interval: f64,
    random: &mut Random,
) -> Motion {
    let phases = timetable(path, options);
    let first_curvature = path.legs.first().map_or(0.0, |leg| leg.mean_curvature(0.0, CURVATURE_WINDOW));
    let mut state = VehicleState {
        pose: path.start,
        steering: libm::atan(wheelbase * first_curvature),
        wheel_way: 0.0,
        direction: path.legs.first().map_or(Direction::Forward, |leg| leg.direction),
        leg: 0,
    };
    let steering_step = options.steering_rate_deg.to_radians() * interval;
    let yaw_walk = disturbance.yaw_walk_deg.to_radians();
    let mut states = vec![state];
    for phase in &phases {
        let steps = libm::ceil(phase.duration() / interval - 1e-9) as usize;
        let mut way = 0.0;
        for step in 1..=steps {
            let (leg, start, way_before, way_after) = match phase {
                Phase::Rest { leg, way, start, .. } => (leg, start, *way, *way),
                Phase::Drive { leg, index, start, profile } => {
                    let way_before = std::mem::replace(&mut way, profile.way(step as f64 * interval));
                    (state.direction, state.leg) = (leg.direction, *index);
                    (leg, start, way_before, way)
                }
            };
            let command = steering_command(leg, start, [way_before, way_after], &state.pose, wheelbase);
            let steering = state.steering + (command - state.steering).clamp(-steering_step, steering_step);
            let mean_steering = 0.5 * (state.steering + steering);
            let moved = leg.direction.sign() * (way_after - way_before);
            let root = libm::sqrt(moved.abs());
            let yaw = yaw_walk * root * random.normal();
            let side_slip = disturbance.side_slip * root * random.normal();
            let arc = Twist { x: moved, y: 0.0, theta: moved * libm::tan(mean_steering) / wheelbase };
            state = VehicleState {
                pose: state.pose.compose(&Pose::exp(&arc)).compose(&Pose::new(0.0, side_slip, yaw)),
                steering,
                wheel_way: state.wheel_way + moved / libm::cos(mean_steering),
                ..state
            };
            let (before, now) = ((states.len() - 1) as f64 * interval, states.len() as f64 * interval);
            for carry in options.carries.iter().filter(|carry| before < carry.from && carry.from <= now) {
                state.pose = state.pose.compose(&Pose::new(carry.x, carry.y, carry.heading_deg.to_radians()));
            }
            states.push(state);
        }
    }
    Motion { interval, states }
}

fn timetable<'a>(path: &'a Path, options: &DriveOptions) -> Vec<Phase<'a>> {
    let mut phases = Vec::new();
    let mut start = path.start;
    for (index, leg) in path.legs.iter().enumerate() {
        let duration = if index == 0 { options.start_standstill } else { options.stop_between_legs };
        phases.push(Phase::Rest { leg, way: 0.0, start, duration });
        let profile = SpeedProfile::new(leg.length(), options.speed, options.acceleration, options.braking);
        phases.push(Phase::Drive { leg, index, start, profile });
        if index + 1 == path.legs.len() {
            phases.push(Phase::Rest { leg, way: leg.length(), start, duration: options.end_standstill });
        }
        start = leg.pose(&start, leg.length());
    }
    phases
}

/// The steering angle (rad) that keeps a vehicle at `pose` on the leg from `start` between two ways (m).
#[must_use]
pub fn steering_command(leg: &Leg, start: &Pose, [before, way]: [f64; 2], pose: &Pose, wheelbase: f64) -> f64 {
    let reference = leg.pose(start, way);
    let lateral = reference.between(pose).y;
    let heading = difference(pose.theta, reference.theta);
    let return_length = RETURN_LENGTH.max(RETURN_STEPS * (way - before).abs());
    let curvature = leg.mean_curvature(way, CURVATURE_WINDOW)
        - lateral / (return_length * return_length)
        - leg.direction.sign() * 2.0 * heading / return_length;
    libm::atan(wheelbase * curvature).clamp(-LARGEST_STEERING, LARGEST_STEERING)
}
