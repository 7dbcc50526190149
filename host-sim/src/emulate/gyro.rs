//! The gyro of a vehicle that drives as recorded.

use agv_core::geometry::difference;
use agv_core::localizer::Event;
use agv_core::measurement::{GyroSample, Time};
use agv_wire::can::frame::Frame;
use agv_wire::can::gyro::GyroFrame;

use crate::recording::{Recording, Truth, truth_at};

/// A gyro on a bus that says what the drive has recorded, and before and behind it what it says of a vehicle that stands.
#[derive(Clone, Debug)]
pub struct EmulatedGyro {
    frame: GyroFrame,
    samples: Vec<GyroSample>,
    /// The time of the recording at which the drive begins.
    first: Time,
    start: Option<Time>,
    next: usize,
    rest: Rest,
}

/// What a gyro says while the vehicle stands: bias and noise, over and over again. Nothing if the drive has no truth.
#[derive(Clone, Debug)]
struct Rest {
    rates: Vec<f64>,
    /// From one reading to the next, s.
    period: f64,
    next: usize,
    /// When it says the next time that the vehicle stands.
    due: Time,
}

/// How much of the drive tells what the gyro says at rest, s: as long as a vehicle stands before it drives off.
const TOLD_BY: f64 = 5.0;
/// A vehicle that turns faster shows the error of the scale as well, rad/s.
const SLOW: f64 = 0.02;

impl Rest {
    /// The first readings of a vehicle that hardly turned, without what it turned.
    fn of(samples: &[GyroSample], latency: f64, factor: f64, truth: &[Truth]) -> Self {
        let mut periods: Vec<f64> = samples.windows(2).map(|pair| pair[1].time.since(pair[0].time)).collect();
        periods.sort_by(f64::total_cmp);
        let period = periods.get(periods.len() / 2).copied().unwrap_or(f64::INFINITY);
        let rate = |sample: &GyroSample| {
            let middle = sample.time.offset(-latency);
            let at = |time: f64| truth_at(truth, middle.offset(time)).map(|pose| pose.theta);
            let turned = difference(at(0.5 * period)?, at(-0.5 * period)?) / period;
            (turned.abs() < SLOW).then(|| sample.rate - turned / factor)
        };
        let count = if period.is_finite() { (TOLD_BY / period) as usize } else { 0 };
        let rates = samples.iter().filter_map(rate).take(count).collect();
        Self { rates, period, next: 0, due: Time::default() }
    }

    /// What it says at `now`, if anything is due.
    fn poll(&mut self, now: Time) -> Option<f64> {
        let rate = *self.rates.get(self.next).filter(|_| now >= self.due)?;
        self.next = (self.next + 1) % self.rates.len();
        let due = self.due.offset(self.period);
        self.due = if due <= now { now.offset(self.period) } else { due };
        Some(rate)
    }
}

impl EmulatedGyro {
    /// The gyro of a drive that begins with its first event; none if the drive has none.
    #[must_use]
    pub fn of(recording: &Recording, frame: &GyroFrame) -> Option<Self> {
        let samples: Vec<GyroSample> = recording
            .events
            .iter()
            .filter_map(|event| match event.view() {
                Event::Gyro(sample) => Some(sample),
                _ => None,
            })
            .collect();
        let first = recording.events.iter().find(|event| event.is_odometry()).and_then(|event| event.time())?;
        let parameters = &recording.parameters.gyro;
        let rest = Rest::of(&samples, parameters.latency, parameters.factor, &recording.truth);
        (!samples.is_empty()).then_some(Self { frame: *frame, samples, first, start: None, next: 0, rest })
    }

    /// Lets the vehicle drive off at `time`.
    pub const fn begin(&mut self, time: Time) {
        self.start = Some(time);
    }

    /// What it sends at `now`.
    pub fn poll(&mut self, now: Time) -> Vec<Frame> {
        let mut frames = Vec::new();
        let elapsed = self.start.map_or(f64::NEG_INFINITY, |start| now.since(start));
        while let Some(sample) = self.samples.get(self.next).filter(|sample| sample.time.since(self.first) <= elapsed) {
            frames.extend(self.frame.encode(sample.rate));
            self.next += 1;
            self.rest.due = now.offset(self.rest.period);
        }
        let is_driving = elapsed >= 0.0 && self.next < self.samples.len();
        if !is_driving {
            frames.extend(self.rest.poll(now).and_then(|rate| self.frame.encode(rate)));
        }
        frames
    }
}
