//! What a gyro on the vehicle says.

use agv_core::geometry::difference;
use agv_core::measurement::{GyroSample, Time};

use super::random::Random;
use super::scenario::{GyroFault, GyroOptions};
use super::vehicle::Motion;

/// The drift is what the bias walks in so many seconds.
const DRIFT_TIME: f64 = 60.0;
/// Degrees an hour.
const DEGREES_AN_HOUR: f64 = core::f64::consts::PI / 180.0 / 3600.0;

/// Readings of a gyro on a vehicle that moves so, from `start` on, with the time at which each is heard. A reading is the mean rate
/// since the one before, in whole steps of the gyro.
#[must_use]
pub fn samples(motion: &Motion, options: &GyroOptions, start: Time, random: &mut Random) -> Vec<GyroSample> {
    let period = 1.0 / options.rate;
    let length = motion.interval * (motion.states.len().saturating_sub(1)) as f64;
    let headings = unwrapped(motion);
    let heading_at = |time: f64| {
        let place = (time / motion.interval).max(0.0);
        let index = (place as usize).min(headings.len() - 1);
        let next = headings[(index + 1).min(headings.len() - 1)];
        headings[index] + (place - index as f64).min(1.0) * (next - headings[index])
    };
    let scale = 1.0 + options.scale_error * random.sign();
    let mut bias = options.bias_deg.to_radians() * random.normal();
    let walk = options.drift_deg_h * DEGREES_AN_HOUR * (period / DRIFT_TIME).sqrt();
    let (unit, range) = (options.step_deg.to_radians(), options.range_deg.to_radians());
    let mut told = 0.0;
    let count = (length / period) as usize;
    let mut samples = Vec::with_capacity(count);
    for number in 1..=count {
        let time = number as f64 * period;
        let rate = (heading_at(time) - heading_at(time - period)) / period;
        bias += walk * random.normal();
        let noise = options.noise_deg.to_radians() * random.normal();
        let jump: f64 = options.faults.iter().map(|fault| fault.jump(time)).sum();
        let raw = (rate / scale + bias + noise + jump.to_radians()).clamp(-range, range);
        if !options.faults.iter().any(|fault| fault.is_frozen(time)) {
            told = if unit > 0.0 { (raw / unit).round() * unit } else { raw };
        }
        if options.faults.iter().any(|fault| fault.is_silent(time)) {
            continue;
        }
        samples.push(GyroSample { time: start.offset(time + options.latency), rate: told });
    }
    samples
}

/// Headings without steps of a whole turn, rad.
fn unwrapped(motion: &Motion) -> Vec<f64> {
    let mut heading = motion.states.first().map_or(0.0, |state| state.pose.theta);
    let mut before = heading;
    motion
        .states
        .iter()
        .map(|state| {
            heading += difference(state.pose.theta, before);
            before = state.pose.theta;
            heading
        })
        .collect()
}

impl GyroFault {
    fn is_on(&self, time: f64) -> bool {
        (self.from..self.from + self.lasts).contains(&time)
    }

    fn is_frozen(&self, time: f64) -> bool {
        self.frozen && self.is_on(time)
    }

    fn is_silent(&self, time: f64) -> bool {
        self.silent && self.is_on(time)
    }

    fn jump(&self, time: f64) -> f64 {
        if self.is_on(time) { self.jump_deg } else { 0.0 }
    }
}
