//! What tells the motion of a vehicle that drives as recorded: encoders, drives, or the vehicle's own controller.

use agv_controller::EncoderNodes;
use agv_core::localizer::Event;
use agv_core::measurement::Time;
use agv_core::odometry::{CounterRange, MOST_COUNTERS};
use agv_wire::can::encoder::Profile;
use agv_wire::can::frame::Frame;

use super::drive::EmulatedDrive;
use super::encoder::EmulatedEncoder;
use super::own_controller::EmulatedController;
use crate::recording::Recording;

/// What tells a counter.
#[derive(Clone, Debug)]
enum Node {
    Encoder(Box<EmulatedEncoder>),
    Drive(EmulatedDrive),
}

impl Node {
    fn set_position(&mut self, position: u32) {
        match self {
            Self::Encoder(encoder) => encoder.set_position(position),
            Self::Drive(drive) => drive.set_position(position),
        }
    }

    fn is_operational(&self) -> bool {
        match self {
            Self::Encoder(encoder) => encoder.is_operational(),
            Self::Drive(_) => true,
        }
    }

    fn poll(&mut self, now: Time) -> Option<Frame> {
        match self {
            Self::Encoder(encoder) => encoder.poll(now),
            Self::Drive(drive) => drive.poll(now),
        }
    }

    fn handle(&mut self, frame: &Frame) -> Option<Frame> {
        match self {
            Self::Encoder(encoder) => encoder.handle(frame),
            Self::Drive(_) => None,
        }
    }
}

/// What tells the motion on a bus. The drive begins when all encoders have been started, or when it is told to.
#[derive(Clone, Debug)]
pub struct EmulatedMotion {
    nodes: Vec<Node>,
    samples: Vec<(Time, [u32; MOST_COUNTERS])>,
    own: Option<EmulatedController>,
    start: Option<Time>,
    stands: bool,
}

/// Why a drive cannot be played.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MotionError {
    /// Nothing in it tells how the vehicle has moved.
    #[error("the drive has no encoders")]
    NoEncoders,
}

impl EmulatedMotion {
    /// What tells the motion of a drive at those nodes, or in those frames, just switched on.
    ///
    /// # Errors
    /// If the drive has nothing that tells it.
    pub fn new(recording: &Recording, nodes: &EncoderNodes) -> Result<Self, MotionError> {
        let counters = recording.parameters.vehicle.counters();
        let samples = recording.events.iter().filter_map(|event| match event.view() {
            Event::Encoders(sample) => Some((sample.time, [sample.drive, sample.steering, 0, 0])),
            Event::Wheels(sample) => {
                let mut counts = [0; MOST_COUNTERS];
                counts.iter_mut().zip(&counters).for_each(|(count, counter)| *count = sample.count(counter));
                Some((sample.time, counts))
            }
            _ => None,
        });
        let samples: Vec<_> = samples.collect();
        let own = nodes.motion_frames.and_then(|frames| EmulatedController::of(recording, &frames, nodes.period()));
        if samples.is_empty() && own.is_none() {
            return Err(MotionError::NoEncoders);
        }
        let mut ranges: Vec<CounterRange> = counters.iter().map(|counter| counter.range).collect();
        // Counters of a vehicle that is not known.
        if ranges.is_empty() && !samples.is_empty() {
            ranges = vec![CounterRange::BITS_32; 2];
        }
        let node = |((range, node), profile): ((CounterRange, _), Profile)| match profile {
            Profile::Encoder => Node::Encoder(Box::new(EmulatedEncoder::new(node, range))),
            Profile::Drive => Node::Drive(EmulatedDrive::new(node, nodes.period())),
        };
        let nodes = ranges.into_iter().zip(nodes.encoders).zip(nodes.profiles).map(node).collect();
        Ok(Self { nodes, samples, own, start: None, stands: false })
    }

    /// Length of the drive, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        let counted = match (self.samples.first(), self.samples.last()) {
            (Some((first, _)), Some((last, _))) => last.since(*first),
            _ => 0.0,
        };
        self.own.as_ref().map_or(counted, EmulatedController::duration)
    }

    /// The same, whose vehicle stands until [`Self::begin`].
    #[must_use]
    pub fn standing(self) -> Self {
        Self { stands: true, ..self }
    }

    /// Lets the vehicle drive off at `time`.
    pub const fn begin(&mut self, time: Time) {
        self.start = Some(time);
    }

    /// Whether all encoders have been started.
    #[must_use]
    pub fn are_operational(&self) -> bool {
        self.nodes.iter().all(Node::is_operational)
    }

    /// When the drive began.
    #[must_use]
    pub const fn start(&self) -> Option<Time> {
        self.start
    }

    /// What is sent at `now`, the wheels having turned as far as they have by then.
    pub fn poll(&mut self, now: Time) -> Vec<Frame> {
        if !self.stands && self.start.is_none() && self.are_operational() {
            self.start = Some(now);
        }
        let elapsed = self.start.map_or(0.0, |start| now.since(start));
        if let Some((first, _)) = self.samples.first() {
            let reached = self.samples.partition_point(|(time, _)| time.since(*first) <= elapsed).max(1);
            let (_, counts) = &self.samples[reached - 1];
            self.nodes.iter_mut().zip(counts).for_each(|(node, count)| node.set_position(*count));
        }
        let mut frames = Vec::new();
        for node in &mut self.nodes {
            frames.extend(std::iter::from_fn(|| node.poll(now)));
        }
        let start = self.start;
        frames.extend(self.own.iter_mut().flat_map(|own| own.poll(now, start)));
        frames
    }

    /// What the encoders answer to a frame.
    pub fn handle(&mut self, frame: &Frame) -> Vec<Frame> {
        self.nodes.iter_mut().filter_map(|node| node.handle(frame)).collect()
    }
}
