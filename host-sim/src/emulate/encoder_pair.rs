//! The two encoders of a vehicle that drives as recorded.

use agv_core::localizer::Event;
use agv_core::measurement::{EncoderSample, Time, WheelSample};
use agv_core::odometry::{CounterRange, Differential, Tricycle, Vehicle, WheelVehicle};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::Frame;

use super::encoder::EmulatedEncoder;
use crate::recording::Recording;

/// Two encoders on a bus. The drive begins when both have been started, or when it is told to.
#[derive(Clone, Debug)]
pub struct EmulatedPair {
    nodes: [EmulatedEncoder; 2],
    samples: Vec<EncoderSample>,
    start: Option<Time>,
    stands: bool,
}

/// Why a drive cannot be played.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PairError {
    /// It has no encoder samples.
    #[error("the drive has no encoders")]
    NoEncoders,
}

impl EmulatedPair {
    /// The encoders of a drive at the nodes `drive` and `steering`, just switched on.
    ///
    /// # Errors
    /// If the drive has no encoders.
    pub fn new(recording: &Recording, drive: NodeId, steering: NodeId) -> Result<Self, PairError> {
        let is_differential = matches!(recording.parameters.vehicle, Vehicle::Wheels(WheelVehicle::Differential(_)));
        let samples = recording.events.iter().filter_map(|event| match event.view() {
            Event::Encoders(sample) => Some(sample),
            // The pair of a differential vehicle is left and right.
            Event::Wheels(WheelSample { time, wheels: [left, right, ..] }) if is_differential => {
                Some(EncoderSample { time, drive: left.count, steering: right.count })
            }
            _ => None,
        });
        let samples: Vec<_> = samples.collect();
        if samples.is_empty() {
            return Err(PairError::NoEncoders);
        }
        let (drive_range, steering_range) = match recording.parameters.vehicle {
            Vehicle::Tricycle(Tricycle { drive_range, steering_range, .. }) => (drive_range, steering_range),
            Vehicle::Wheels(WheelVehicle::Differential(Differential { left, right, .. })) => {
                (left.turn.range, right.turn.range)
            }
            _ => (CounterRange::BITS_32, CounterRange::BITS_32),
        };
        let nodes = [EmulatedEncoder::new(drive, drive_range), EmulatedEncoder::new(steering, steering_range)];
        Ok(Self { nodes, samples, start: None, stands: false })
    }

    /// Length of the drive, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        match (self.samples.first(), self.samples.last()) {
            (Some(first), Some(last)) => last.time.since(first.time),
            _ => 0.0,
        }
    }

    /// The same encoders, whose vehicle stands until [`Self::begin`].
    #[must_use]
    pub fn standing(self) -> Self {
        Self { stands: true, ..self }
    }

    /// Lets the vehicle drive off at `time`.
    pub const fn begin(&mut self, time: Time) {
        self.start = Some(time);
    }

    /// Whether both encoders have been started.
    #[must_use]
    pub fn are_operational(&self) -> bool {
        self.nodes.iter().all(EmulatedEncoder::is_operational)
    }

    /// When the drive began.
    #[must_use]
    pub const fn start(&self) -> Option<Time> {
        self.start
    }

    /// What the encoders send by themselves at `now`, having turned as far as they have by then.
    pub fn poll(&mut self, now: Time) -> Vec<Frame> {
        if !self.stands && self.start.is_none() && self.are_operational() {
            self.start = Some(now);
        }
        let elapsed = self.start.map_or(0.0, |start| now.since(start));
        if let Some(first) = self.samples.first().map(|sample| sample.time) {
            let reached = self.samples.partition_point(|sample| sample.time.since(first) <= elapsed).max(1);
            let sample = &self.samples[reached - 1];
            self.nodes[0].set_position(sample.drive);
            self.nodes[1].set_position(sample.steering);
        }
        let mut frames = Vec::new();
        for node in &mut self.nodes {
            frames.extend(std::iter::from_fn(|| node.poll(now)));
        }
        frames
    }

    /// What the encoders answer to a frame.
    pub fn handle(&mut self, frame: &Frame) -> Vec<Frame> {
        self.nodes.iter_mut().filter_map(|node| node.handle(frame)).collect()
    }
}
