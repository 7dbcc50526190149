//! The gyro of a vehicle that drives as recorded.

use agv_core::localizer::Event;
use agv_core::measurement::{GyroSample, Time};
use agv_wire::can::frame::Frame;
use agv_wire::can::gyro::GyroFrame;

use crate::recording::Recording;

/// A gyro on a bus that says what the drive has recorded, from when the drive begins.
#[derive(Clone, Debug)]
pub struct EmulatedGyro {
    frame: GyroFrame,
    samples: Vec<GyroSample>,
    /// The time of the recording at which the drive begins.
    first: Time,
    start: Option<Time>,
    next: usize,
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
        (!samples.is_empty()).then_some(Self { frame: *frame, samples, first, start: None, next: 0 })
    }

    /// Lets the vehicle drive off at `time`.
    pub const fn begin(&mut self, time: Time) {
        self.start = Some(time);
    }

    /// What it sends at `now`.
    pub fn poll(&mut self, now: Time) -> Vec<Frame> {
        let Some(start) = self.start else { return Vec::new() };
        let elapsed = now.since(start);
        let mut frames = Vec::new();
        while let Some(sample) = self.samples.get(self.next).filter(|sample| sample.time.since(self.first) <= elapsed) {
            frames.extend(self.frame.encode(sample.rate));
            self.next += 1;
        }
        frames
    }
}
