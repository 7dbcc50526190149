//! A pose that is put together from its frames.

use agv_core::geometry::Pose;
use agv_core::integrity::{Alarm, AlertLimit, ProtectionLevel};
use agv_core::state::{Mode, Reason};

use super::content::{Content, Health};
use crate::can::canopen::NodeId;
use crate::can::frame::Frame;

/// A pose as it was received from the bus. Numbers that the controller does not know are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedPose {
    /// Counter of its frames, 0 to 15.
    pub counter: u8,
    /// Pose of R in W.
    pub pose: Pose,
    /// Low 16 bits of the controller's clock, ms.
    pub time: u16,
    /// Distance travelled since a landmark last corrected the pose, m.
    pub dead_reckoning_distance: f64,
    /// Standard deviations of x (m), y (m), heading (rad).
    pub deviations: [f64; 3],
    /// Correlations of x and y, x and heading, y and heading.
    pub correlations: [f64; 3],
    /// Mode.
    pub mode: Mode,
    /// Why.
    pub reason: Reason,
    /// State of encoders and laser.
    pub health: Health,
    /// Whether the pose is good enough to leave the reflectors.
    pub is_good: bool,
    /// Whether landmarks have moved the position notably.
    pub has_jumped: bool,
    /// How often the position was reset, wrapping.
    pub resets: u8,
    /// By how far the last time, m.
    pub last_reset: f64,
    /// How often there was not room for all that was seen, modulo 4.
    pub overflows: u8,
    /// What the errors do not exceed; infinite if it is not known or too large to be told.
    pub level: ProtectionLevel,
    /// What travelling can live with.
    pub limit: AlertLimit,
    /// What the pose must not be used for.
    pub alarm: Alarm,
}

/// Puts the five frames of a pose together.
#[derive(Clone, Copy, Debug)]
pub struct PoseReceiver {
    node: NodeId,
    counter: u8,
    contents: [Option<Content>; 5],
}

impl PoseReceiver {
    /// A receiver for the controller at `node` that has heard nothing.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Self { node, counter: 0, contents: [None; 5] }
    }

    /// Takes a frame; gives the pose if the frame completes it. Of poses that miss a frame nothing is given.
    pub fn handle(&mut self, frame: &Frame) -> Option<PublishedPose> {
        let (content, counter) = Content::decode(frame, self.node).ok()?;
        if counter != self.counter {
            self.contents = [None; 5];
            self.counter = counter;
        }
        let slot = match content {
            Content::Position { .. } => 0,
            Content::Heading { .. } => 1,
            Content::Covariance { .. } => 2,
            Content::Status { .. } => 3,
            Content::Integrity { .. } => 4,
            _ => return None,
        };
        *self.contents.get_mut(slot)? = Some(content);
        let [
            Some(Content::Position { x, y }),
            Some(Content::Heading { heading, time, dead_reckoning_distance }),
            Some(Content::Covariance { deviations, correlations }),
            Some(Content::Status { mode, reason, health, is_good, has_jumped, resets, last_reset, overflows, .. }),
            Some(Content::Integrity { level, limit, alarm }),
        ] = self.contents
        else {
            return None;
        };
        self.contents = [None; 5];
        let pose = Pose { x, y, theta: heading };
        Some(PublishedPose {
            counter,
            pose,
            time,
            dead_reckoning_distance,
            deviations,
            correlations,
            mode,
            reason,
            health,
            is_good,
            has_jumped,
            resets,
            last_reset,
            overflows,
            level,
            limit,
            alarm,
        })
    }
}
