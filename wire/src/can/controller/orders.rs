//! What the controller is told: an initial pose, and whether the vehicle stands.

use agv_core::geometry::{Pose, wrap};
use agv_core::measurement::{PoseFix, Time};

use super::content::Content;
use crate::can::canopen::NodeId;
use crate::can::frame::Frame;

/// The two frames of an initial pose must come within this time, s.
const PAIR_TIME: f64 = 0.1;
/// An initial pose with the counter of the one before is a repetition for so long, s.
const REPETITION_TIME: f64 = 1.0;
/// A report of standstill holds so long, s.
const STANDSTILL_TIME: f64 = 0.2;

/// Hears what the controller is told.
#[derive(Clone, Copy, Debug)]
pub struct OrderReceiver {
    node: NodeId,
    position: Option<(Time, u8, f64, f64)>,
    heading: Option<(Time, u8, [f64; 3])>,
    last_pose: Option<(Time, u8)>,
    /// Whether the bus has said that it stands, and when.
    command: Option<(Time, bool)>,
    /// When a wire has said so.
    line: Option<Time>,
}

impl OrderReceiver {
    /// A receiver at `node` that has heard nothing.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Self { node, position: None, heading: None, last_pose: None, command: None, line: None }
    }

    /// Whether the vehicle has been said to stand still, and lately. What the bus says goes before what a wire says: one that hangs on
    /// its supply says the same for ever.
    #[must_use]
    pub fn is_standstill(&self, now: Time) -> bool {
        let is_held = |since: Time| now.since(since) <= STANDSTILL_TIME;
        match self.command.filter(|(since, _)| is_held(*since)) {
            Some((_, is_standstill)) => is_standstill,
            None => self.line.is_some_and(is_held),
        }
    }

    /// A wire says at `time` that the vehicle stands still.
    pub const fn hear_line(&mut self, time: Time) {
        self.line = Some(time);
    }

    /// Takes a frame that was received at `time`; gives the pose to believe that it completes.
    pub fn handle(&mut self, frame: &Frame, time: Time) -> Option<PoseFix> {
        match Content::decode(frame, self.node).ok()? {
            (Content::InitialPosition { x, y }, counter) => self.position = Some((time, counter, x, y)),
            (Content::InitialHeading { heading, position_deviation, heading_deviation }, counter) => {
                self.heading = Some((time, counter, [heading, position_deviation, heading_deviation]));
            }
            (Content::Command { is_standstill }, _) => {
                self.command = Some((time, is_standstill));
                return None;
            }
            _ => return None,
        }
        self.initial_pose(time)
    }

    fn initial_pose(&mut self, time: Time) -> Option<PoseFix> {
        let (position_time, counter, x, y) = self.position?;
        let (heading_time, heading_counter, [heading, position_deviation, heading_deviation]) = self.heading?;
        if counter != heading_counter || libm::fabs(position_time.since(heading_time)) > PAIR_TIME {
            return None;
        }
        let is_repetition =
            self.last_pose.is_some_and(|(last, known)| known == counter && time.since(last) < REPETITION_TIME);
        (self.position, self.heading, self.last_pose) = (None, None, Some((time, counter)));
        let pose = Pose { x, y, theta: wrap(heading) };
        let fix = PoseFix { time, pose, position_deviation, heading_deviation };
        (!is_repetition && fix.is_sound()).then_some(fix)
    }
}
