//! How late the board's driver hears what is sent to it: its serial line is emulated byte by byte, and how fast depends on this machine.

use std::time::{Duration, Instant};

use agv_wire::can::slcan::Command;

use crate::bus::{BusError, SlcanBus};

/// How often the line is tried.
const INTERVAL: Duration = Duration::from_millis(5);

/// Shorter delays are not noted.
const SHORTEST: Duration = Duration::from_millis(5);

/// What waited on its way to the board's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineDelay {
    /// When it was due.
    pub due: Instant,
    /// How long it took, and for what went over the line its way back. What was due shortly before or after took as long, to within
    /// [`INTERVAL`].
    pub delay: Duration,
}

impl LineDelay {
    /// One that is long enough to be noted.
    pub(super) fn of(due: Instant, delay: Duration) -> Option<Self> {
        (delay >= SHORTEST).then_some(Self { due, delay })
    }
}

/// Sends a command now and then, which the board's driver answers before any task has a say.
pub(super) struct LineWatch {
    acknowledged: u64,
    sent: Option<Instant>,
    due: Instant,
}

impl LineWatch {
    pub fn new(now: Instant) -> Self {
        Self { acknowledged: 0, sent: None, due: now }
    }

    /// Looks for the answer at `now`, and tries again if it is time.
    pub fn poll(&mut self, bus: &mut SlcanBus, now: Instant) -> Result<Option<LineDelay>, BusError> {
        let mut waited = None;
        if let Some(sent) = self.sent.filter(|_| bus.acknowledged() != self.acknowledged) {
            self.sent = None;
            waited = LineDelay::of(sent, now - sent);
        }
        if self.sent.is_none() && now >= self.due {
            self.acknowledged = bus.acknowledged();
            bus.command(Command::Open)?;
            (self.sent, self.due) = (Some(now), now + INTERVAL);
        }
        Ok(waited)
    }
}
