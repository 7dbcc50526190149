//! What the vehicle's own sensors say of its motion.

use agv_core::geometry::Pose;
use agv_core::measurement::{EncoderSample, PoseIncrement, SpeedSample, Time};
use agv_core::odometry::{Ackermann, CounterRange, Tricycle};

use super::path::Direction;
use super::random::Random;
use super::scenario::{OdometryOptions, VehicleErrors};
use super::vehicle::Motion;

/// Counters of a tricycle with the true parameters `tricycle`, one sample a state of `motion`; `start` is the time of the
/// first. Slip and steering errors are in the counters; the driving counter starts anywhere.
#[must_use]
pub fn encoders(
    motion: &Motion,
    tricycle: &Tricycle,
    options: &OdometryOptions,
    start: Time,
    random: &mut Random,
) -> Vec<EncoderSample> {
    let steering_noise = options.steering_noise_deg.to_radians();
    let mut counted_way = tricycle.drive_scale * random.uniform() * tricycle.drive_range.values() as f64;
    let mut wheel_way = 0.0;
    let mut leg = LegErrors::default();
    let mut samples = Vec::with_capacity(motion.states.len());
    for (index, state) in motion.states.iter().enumerate() {
        let moved = state.wheel_way - wheel_way;
        wheel_way = state.wheel_way;
        if leg.of != Some(state.leg) {
            leg = LegErrors::drawn(state.leg, options, random);
        }
        let too_much = leg.slip + options.slip_of(0, index as f64 * motion.interval);
        counted_way += moved * (1.0 + too_much) + options.slip * libm::sqrt(moved.abs()) * random.normal();
        let offset = match state.direction {
            Direction::Forward => tricycle.steering_offset_forward,
            Direction::Backward => tricycle.steering_offset_backward,
        };
        let steering = state.steering - offset + leg.steering + steering_noise * random.normal();
        samples.push(EncoderSample {
            time: start.offset(index as f64 * motion.interval),
            drive: counter(libm::floor(counted_way / tricycle.drive_scale), tricycle.drive_range),
            steering: counter(libm::round(steering / tricycle.steering_scale), tricycle.steering_range),
        });
    }
    samples
}

/// The counters as a vehicle tells them whose encoders are fitted wrongly.
#[must_use]
pub fn with_mistakes(sample: EncoderSample, tricycle: &Tricycle, truth: &VehicleErrors) -> EncoderSample {
    let turned = |count: u32, range: CounterRange| counter(-f64::from(count), range);
    let mut told = sample;
    if truth.drive_reversed {
        told.drive = turned(told.drive, tricycle.drive_range);
    }
    if truth.steering_reversed {
        told.steering = turned(told.steering, tricycle.steering_range);
    }
    if truth.encoders_swapped {
        (told.drive, told.steering) = (told.steering, told.drive);
    }
    told
}

/// Errors that last for a leg.
#[derive(Default)]
struct LegErrors {
    of: Option<usize>,
    /// Share of the way.
    slip: f64,
    /// rad.
    steering: f64,
}

impl LegErrors {
    /// Those of a new leg. Errors that a scenario does not have take no random numbers.
    fn drawn(leg: usize, options: &OdometryOptions, random: &mut Random) -> Self {
        let mut error = |deviation: f64| if deviation > 0.0 { deviation * random.normal() } else { 0.0 };
        let slip = error(options.leg_slip);
        Self { of: Some(leg), slip, steering: error(options.leg_steering_error_deg.to_radians()) }
    }
}

/// The wheel whose speed is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpeedWheel {
    /// The driving wheel of a tricycle.
    Steered,
    /// A rear wheel of a car whose virtual front wheel is the tricycle's wheel.
    Rear(Ackermann),
}

impl SpeedWheel {
    /// How far it goes while the driving wheel goes `way` (m) at a steering angle (rad).
    fn way(&self, way: f64, steering: f64) -> f64 {
        match self {
            Self::Steered => way,
            Self::Rear(car) => {
                let centre_way = way * libm::cos(steering);
                centre_way - centre_way * libm::tan(steering) / car.wheelbase * car.encoder_offset
            }
        }
    }
}

/// Speed of a wheel and steering angle. A sample tells the mean speed since the one before; `speed_scale` is the true way over the reported one and `steering_offset` (rad)
/// is what is missing in the reported angle.
#[must_use]
pub fn speeds(
    motion: &Motion,
    wheel: &SpeedWheel,
    speed_scale: f64,
    steering_offset: f64,
    options: &OdometryOptions,
    start: Time,
    random: &mut Random,
) -> Vec<SpeedSample> {
    let steering_noise = options.steering_noise_deg.to_radians();
    let mut previous = motion.states.first().copied();
    let mut samples = Vec::with_capacity(motion.states.len());
    for (index, state) in motion.states.iter().enumerate() {
        let before = previous.replace(*state).unwrap_or(*state);
        let mean_steering = 0.5 * (before.steering + state.steering);
        let way = wheel.way(state.wheel_way - before.wheel_way, mean_steering);
        let slip = options.slip_of(0, index as f64 * motion.interval);
        let counted = way * (1.0 + slip) + options.slip * libm::sqrt(way.abs()) * random.normal();
        samples.push(SpeedSample {
            time: start.offset(index as f64 * motion.interval),
            speed: counted / speed_scale / motion.interval,
            steering: state.steering - steering_offset + steering_noise * random.normal(),
        });
    }
    samples
}

/// Displacements between states, with the way too long or short by `way_scale` and turned by `turn` (rad) a metre.
#[must_use]
pub fn increments(
    motion: &Motion,
    way_scale: f64,
    turn: f64,
    options: &OdometryOptions,
    start: Time,
    random: &mut Random,
) -> Vec<PoseIncrement> {
    let mut previous = motion.states.first().map(|state| state.pose);
    let mut samples = Vec::with_capacity(motion.states.len());
    for (index, state) in motion.states.iter().enumerate() {
        let before = previous.replace(state.pose).unwrap_or(state.pose);
        let moved = before.between(&state.pose);
        let slip = options.slip * libm::sqrt(moved.x.abs()) * random.normal();
        samples.push(PoseIncrement {
            time: start.offset(index as f64 * motion.interval),
            displacement: Pose::new((moved.x + slip) / way_scale, moved.y / way_scale, moved.theta - turn * moved.x),
        });
    }
    samples
}

/// What a counter shows after that many ticks.
fn counter(ticks: f64, range: CounterRange) -> u32 {
    (ticks as i64).rem_euclid(range.values() as i64) as u32
}
