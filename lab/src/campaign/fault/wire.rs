//! Faults of the lines between sensors and controller.

use std::collections::VecDeque;

use agv_core::measurement::Time;
use agv_wire::can::frame::Frame;

use super::{Fault, FaultKind};
use agv_host_sim::simulate::random::Random;

/// Something that goes over a line.
pub trait Message: Clone {
    /// Makes a part of it wrong.
    fn corrupt(&mut self, random: &mut Random);
    /// Cuts it.
    fn truncate(&mut self, random: &mut Random);
}

fn below(random: &mut Random, count: usize) -> usize {
    (random.uniform() * count as f64) as usize
}

impl Message for Vec<u8> {
    fn corrupt(&mut self, random: &mut Random) {
        if !self.is_empty() {
            let (place, bit) = (below(random, self.len()), below(random, 8));
            self[place] ^= 1 << bit;
        }
    }

    fn truncate(&mut self, random: &mut Random) {
        let length = below(random, self.len().max(1));
        self.resize(length, 0);
    }
}

impl Message for Frame {
    fn corrupt(&mut self, random: &mut Random) {
        let mut data = self.data().to_vec();
        if !data.is_empty() {
            let (place, bit) = (below(random, data.len()), below(random, 8));
            data[place] ^= 1 << bit;
        }
        if let Some(frame) = Self::new(self.id(), &data) {
            *self = frame;
        }
    }

    fn truncate(&mut self, random: &mut Random) {
        let length = below(random, self.data().len().max(1));
        if let Some(frame) = Self::new(self.id(), &self.data()[..length]) {
            *self = frame;
        }
    }
}

/// What may happen to a message.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Treatment {
    dropped: f64,
    doubled: f64,
    reordered: f64,
    corrupted: f64,
    truncated: f64,
    delay: f64,
    jitter: f64,
}

/// One direction of a line: messages leave in order, and arrive as faults let them.
pub struct Line<M> {
    /// Time that a sound line takes, s.
    latency: f64,
    on_the_way: VecDeque<(Time, M)>,
    held_back: Option<M>,
    random: Random,
}

impl<M: Message> Line<M> {
    /// A sound line that takes `latency` s.
    #[must_use]
    pub fn new(latency: f64, random: Random) -> Self {
        Self { latency, on_the_way: VecDeque::new(), held_back: None, random }
    }

    /// What was sent and has not arrived is lost.
    pub fn clear(&mut self) {
        self.on_the_way.clear();
        self.held_back = None;
    }

    fn deliver(&mut self, now: Time, treatment: &Treatment, message: M) {
        let delay = self.latency + treatment.delay + treatment.jitter * self.random.uniform();
        let arrival = now.offset(delay);
        // A line keeps the order: what is late holds up what follows.
        let arrival = self.on_the_way.back().map_or(arrival, |(last, _)| arrival.max(*last));
        self.on_the_way.push_back((arrival, message));
    }

    fn send(&mut self, now: Time, mut message: M, treatment: &Treatment) {
        if self.random.happens(treatment.dropped) {
            return;
        }
        if self.random.happens(treatment.corrupted) {
            message.corrupt(&mut self.random);
        }
        if self.random.happens(treatment.truncated) {
            message.truncate(&mut self.random);
        }
        if self.held_back.is_none() && self.random.happens(treatment.reordered) {
            self.held_back = Some(message);
            return;
        }
        if self.random.happens(treatment.doubled) {
            self.deliver(now, treatment, message.clone());
        }
        self.deliver(now, treatment, message);
        if let Some(held) = self.held_back.take() {
            self.deliver(now, treatment, held);
        }
    }

    /// The next message that has arrived.
    pub fn receive(&mut self, now: Time) -> Option<M> {
        if self.on_the_way.front().is_some_and(|(arrival, _)| *arrival <= now) {
            return self.on_the_way.pop_front().map(|(_, message)| message);
        }
        None
    }
}

impl Line<Vec<u8>> {
    /// Sends a telegram of the laser, `time` s after the vehicle has driven off.
    pub fn send_telegram(&mut self, now: Time, time: f64, telegram: Vec<u8>, faults: &[&Fault]) {
        let mut treatment = Treatment::default();
        for fault in faults.iter().filter(|fault| fault.is_active(time)) {
            match fault.what {
                FaultKind::TelegramsDropped { share } => treatment.dropped = share,
                FaultKind::LaserSilent => treatment.dropped = 1.0,
                FaultKind::TelegramsDelayed { seconds, jitter } => {
                    (treatment.delay, treatment.jitter) = (seconds, jitter);
                }
                FaultKind::TelegramsDoubled { share } => treatment.doubled = share,
                FaultKind::TelegramsReordered { share } => treatment.reordered = share,
                FaultKind::TelegramsCorrupted { share } => treatment.corrupted = share,
                FaultKind::TelegramsTruncated { share } => treatment.truncated = share,
                _ => {}
            }
        }
        self.send(now, telegram, &treatment);
    }
}

impl Line<Frame> {
    /// Sends a frame of an encoder, `time` s after the vehicle has driven off.
    pub fn send_frame(&mut self, now: Time, time: f64, frame: Frame, faults: &[&Fault]) {
        let mut treatment = Treatment::default();
        for fault in faults.iter().filter(|fault| fault.is_active(time)) {
            match fault.what {
                FaultKind::FramesDropped { share } => treatment.dropped = share,
                FaultKind::BusSilent => treatment.dropped = 1.0,
                FaultKind::FramesDelayed { seconds, jitter } => {
                    (treatment.delay, treatment.jitter) = (seconds, jitter);
                }
                FaultKind::FramesDoubled { share } => treatment.doubled = share,
                FaultKind::FramesReordered { share } => treatment.reordered = share,
                FaultKind::FramesCorrupted { share } => treatment.corrupted = share,
                _ => {}
            }
        }
        self.send(now, frame, &treatment);
    }
}
