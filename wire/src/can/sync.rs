//! The producer of SYNC (CiA 301, 7.2.5).

use agv_core::measurement::Time;

use super::canopen::Message;
use super::frame::Frame;

/// Says when synchronous nodes read their inputs.
#[derive(Clone, Copy, Debug)]
pub struct SyncProducer {
    period: f64,
    next: Time,
}

impl SyncProducer {
    /// A producer that begins at `start` and repeats every `period` seconds (at least a millisecond).
    #[must_use]
    pub fn new(period: f64, start: Time) -> Self {
        Self { period: period.max(1e-3), next: start }
    }

    /// The SYNC frame, if one is due. Moments that were missed are left out, so that a late caller makes no burst.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        if now < self.next {
            return None;
        }
        let following = self.next.offset(self.period);
        self.next = if following <= now { now.offset(self.period) } else { following };
        Some(Message::Sync { counter: None }.encode())
    }

    /// When the next one is due.
    #[must_use]
    pub const fn next(&self) -> Time {
        self.next
    }
}
