//! Drive units that report their speed and steering angle.

use super::frame::{Frame, Id};
use super::signal::Signal;
use agv_core::measurement::{SpeedSample, Time};

/// A number in the frames of one identifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSignal {
    /// Identifier of the frames.
    pub id: Id,
    /// Where the number is in them.
    pub signal: Signal,
}

impl FrameSignal {
    /// The number, if the frame holds it.
    pub(super) fn value(&self, frame: &Frame) -> Option<f64> {
        if frame.id() != self.id || frame.is_remote() {
            return None;
        }
        self.signal.value(frame.data()).filter(|value| value.is_finite())
    }
}

/// A drive unit, and what it said last of its steering.
#[derive(Clone, Copy, Debug)]
pub struct DriveUnit {
    speed: FrameSignal,
    steering: FrameSignal,
    oldest_steering: f64,
    last_steering: Option<(Time, f64)>,
}

impl DriveUnit {
    /// A drive unit with the speed (m/s, positive forward) and the steering angle (rad, positive to the left) at those
    /// places, in one frame or in two. A steering angle older than `oldest_steering` (s) is not used.
    #[must_use]
    pub const fn new(speed: FrameSignal, steering: FrameSignal, oldest_steering: f64) -> Self {
        Self { speed, steering, oldest_steering, last_steering: None }
    }

    /// Takes a frame that was received at `time`; gives a sample if the frame holds the speed and the angle is known.
    pub fn handle(&mut self, frame: &Frame, time: Time) -> Option<SpeedSample> {
        if let Some(angle) = self.steering.value(frame) {
            self.last_steering = Some((time, angle));
        }
        let speed = self.speed.value(frame)?;
        let (angle_time, steering) = self.last_steering?;
        (time.since(angle_time) <= self.oldest_steering).then_some(SpeedSample { time, speed, steering })
    }
}
