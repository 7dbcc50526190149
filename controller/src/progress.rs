//! How far the bus and the localiser are with each other. The bus publishes while the localiser is busy; what a published
//! pose rests on is counted, so that a replay of the log publishes it again, to the last bit.

use agv_core::state::PoseOutput;

use super::encoders::BusEvent;

/// Counts of the bus at one moment; both wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Events that the bus has told the localiser.
    pub told: u32,
    /// Events, of the bus or of others, that the localiser had answered when the bus heard of it last.
    pub answered: u32,
}

impl Progress {
    /// Counts an event that the bus tells.
    pub(crate) fn tell(&mut self, event: BusEvent) -> Told {
        self.told = self.told.wrapping_add(1);
        Told { event, progress: Some(*self) }
    }
}

/// An event on its way to the localiser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// The event.
    pub event: BusEvent,
    /// How far the bus was, this event counted. None if somebody else tells it.
    pub progress: Option<Progress>,
}

impl From<BusEvent> for Told {
    /// An event that did not come from the bus.
    fn from(event: BusEvent) -> Self {
        Self { event, progress: None }
    }
}

/// A pose that went out on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SentPose {
    /// The pose.
    pub pose: PoseOutput,
    /// How far the bus was.
    pub progress: Progress,
}
