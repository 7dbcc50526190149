//! What the encoders of several wheels say.

use agv_core::measurement::{MOST_WHEELS, Time, WheelReading, WheelSample};
use agv_core::odometry::{AngleEncoder, Contact, Wheel};

use super::random::Random;
use super::scenario::OdometryOptions;
use super::vehicle::{Motion, VehicleState};

/// Counters of the true wheels of a vehicle that moves as one with a steered wheel `wheelbase` (m) ahead would, one sample a state of
/// `motion`; `start` is the time of the first. Steered wheels stand as the motion of their contacts wants them. Slip is in the
/// counters, which start anywhere.
#[must_use]
pub fn samples(
    motion: &Motion,
    wheels: &[Wheel],
    wheelbase: f64,
    options: &OdometryOptions,
    start: Time,
    random: &mut Random,
) -> Vec<WheelSample> {
    let noise = options.steering_noise_deg.to_radians();
    let mut turned: Vec<f64> = wheels.iter().map(|wheel| first_turn(wheel, random)).collect();
    let mut before = motion.states.first().copied();
    let mut samples = Vec::with_capacity(motion.states.len());
    for (index, state) in motion.states.iter().enumerate() {
        let time = index as f64 * motion.interval;
        let last = before.replace(*state).unwrap_or(*state);
        let mut readings = [WheelReading::default(); MOST_WHEELS];
        for ((number, wheel), reading) in (0_u8..).zip(wheels).zip(&mut readings) {
            let way = rolled(wheel, &last, state, wheelbase);
            let slip = options.slip_of(number, time);
            let counted = way * (1.0 + slip) + options.slip * libm::sqrt(way.abs()) * random.normal();
            let Some(turn) = turned.get_mut(usize::from(number)) else { continue };
            *turn += counted / wheel.radius;
            reading.count = wheel.turn.map_or(0, |encoder| counter(libm::floor(*turn / encoder.scale), &encoder));
            reading.steering = wheel.steering.map_or(0, |encoder| {
                let angle = direction(wheel, curvature(state.steering, wheelbase)) - wheel.heading;
                counter(libm::round((angle + noise * random.normal()) / encoder.scale), &encoder)
            });
        }
        samples.push(WheelSample { time: start.offset(time), wheels: readings });
    }
    samples
}

fn first_turn(wheel: &Wheel, random: &mut Random) -> f64 {
    wheel.turn.map_or(0.0, |encoder| encoder.scale * random.uniform() * encoder.range.values() as f64)
}

fn curvature(steering: f64, wheelbase: f64) -> f64 {
    libm::tan(steering) / wheelbase
}

/// In which direction the contact of a steered wheel moves, rad from forward to the left, while R goes forward on that curvature;
/// that of a fixed one rolls as it is mounted.
fn direction(wheel: &Wheel, curvature: f64) -> f64 {
    if wheel.steering.is_none() {
        return wheel.heading;
    }
    libm::atan2(curvature * wheel.x, 1.0 - curvature * wheel.y)
}

/// How far a wheel has rolled between two states, m: what its rollers let it move across is none of it.
fn rolled(wheel: &Wheel, before: &VehicleState, now: &VehicleState, wheelbase: f64) -> f64 {
    let steering = 0.5 * (before.steering + now.steering);
    let along = (now.wheel_way - before.wheel_way) * libm::cos(steering);
    let turn = along * curvature(steering, wheelbase);
    let moved = (along - turn * wheel.y, turn * wheel.x);
    let roller = match wheel.contact {
        Contact::Tyre => 0.0,
        Contact::Rollers(angle) => angle,
    };
    let (sine, cosine) = libm::sincos(direction(wheel, curvature(steering, wheelbase)) + roller);
    (moved.0 * cosine + moved.1 * sine) / libm::cos(roller)
}

/// What a counter shows after that many ticks.
fn counter(ticks: f64, encoder: &AngleEncoder) -> u32 {
    (ticks as i64).rem_euclid(encoder.range.values() as i64) as u32
}
