//! What can be seen of a drive, and done to it, while it goes on.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use agv_wire::can::controller::PublishedPose;
use agv_wire::can::emcy::Emergency;

use super::line_watch::LineDelay;
use crate::emulate::board::Ports;

/// A pose that the controller has said, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeardPose {
    /// When it was heard.
    pub heard: Instant,
    /// What it says.
    pub pose: PublishedPose,
}

/// An emergency that the controller has sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeardEmergency {
    /// When it was heard.
    pub heard: Instant,
    /// What it says.
    pub emergency: Emergency,
}

/// What is wrong with the bus, switched on and off while the vehicle drives.
#[derive(Debug, Default)]
pub struct BusTrouble {
    /// Whether the driving wheel's encoder is silent.
    pub is_drive_silent: AtomicBool,
    /// Of so many frames to the controller one has a wrong bit; none if 0.
    pub corrupted_in: AtomicU32,
    /// Frames of other nodes in each second.
    pub foreign: AtomicU32,
    /// How many of them were sent.
    pub foreign_sent: AtomicU32,
}

/// What is known of a drive while it goes on.
pub struct Watch<'a> {
    /// The ports of the board.
    pub ports: Ports,
    /// Port of the emulated NAV350 on this machine.
    pub laser_port: u16,
    /// Port of this machine where everybody may listen to the log stream.
    pub stream_port: u16,
    /// What is wrong with the bus.
    pub trouble: &'a BusTrouble,
    /// Whether the laser answers; the connections end when it does not.
    pub is_laser_on: &'a AtomicBool,
    /// What was heard so far.
    pub(super) heard: &'a Mutex<Heard>,
    pub(super) stopped: &'a AtomicBool,
}

/// What was heard of a drive.
#[derive(Default)]
pub(super) struct Heard {
    pub poses: Vec<HeardPose>,
    pub emergencies: Vec<HeardEmergency>,
    /// When the drive began.
    pub begin: Option<Instant>,
    /// See [`super::Driven::longest_stall`], s.
    pub longest_stall: f64,
    /// See [`super::Driven::longest_delay`], s.
    pub longest_delay: f64,
    /// See [`super::Driven::line_delays`].
    pub line_delays: Vec<LineDelay>,
}

impl Watch<'_> {
    fn with<T>(&self, look: impl FnOnce(&Heard) -> T) -> T {
        look(&self.heard.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The newest pose.
    #[must_use]
    pub fn pose(&self) -> Option<HeardPose> {
        self.with(|heard| heard.poses.last().copied())
    }

    /// How long the vehicle has been driving; None while it stands at the start.
    #[must_use]
    pub fn driven(&self) -> Option<Duration> {
        self.with(|heard| heard.begin).and_then(|begin| Instant::now().checked_duration_since(begin))
    }

    /// All poses that were heard since.
    #[must_use]
    pub fn poses_since(&self, time: Instant) -> Vec<HeardPose> {
        self.with(|heard| heard.poses.iter().filter(|pose| pose.heard >= time).copied().collect())
    }

    /// All emergencies so far.
    #[must_use]
    pub fn emergencies(&self) -> Vec<HeardEmergency> {
        self.with(|heard| heard.emergencies.clone())
    }

    /// Ends the emulation before its time.
    pub fn end(&self) {
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// Whether the emulation has ended.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}
