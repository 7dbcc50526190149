//! What is wrong, as emergencies, the error register and the history of errors tell it (CiA 301, 7.2.7, 7.5.2.2 and 7.5.2.4).

use agv_core::measurement::Time;

use crate::can::emcy::Emergency;

/// Errors that are remembered.
pub const HISTORY: usize = 8;
/// An error is over when there was nothing of it for so long, s: what flickers is told twice in that time at most.
pub const HOLD: f64 = 0.5;

/// What can be wrong. Codes are those of CiA 301, table 26; those of sensors are CiA 402's, and FF01h and on are the
/// controller's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// A part of the board does not work. It stays until the next start.
    Board,
    /// The program ended by itself the last time. It stays until the next start.
    Panicked,
    /// Not everything that was set was found. It stays until the next start.
    SettingsLost,
    /// Frames of the bus came faster than they were taken.
    Overrun,
    /// Errors of the bus had driven the controller off it; it is back.
    BusOff,
    /// A node whose heartbeat is watched (1016h) is silent.
    HeartbeatLost,
    /// The laser is silent or faulty.
    Laser,
    /// The driving wheel's encoder is not to be believed.
    DriveEncoder,
    /// The steering's encoder is not to be believed.
    SteeringEncoder,
    /// The vehicle does not know any more where it is.
    Lost,
    /// The localiser is too slow for what it is told.
    Overload,
    /// An initial pose was refused: the vehicle moves, or the bus may not give one.
    PoseRefused,
    /// The processor stands still from now on, for as long as a page of flash takes to erase: nothing is sent meanwhile.
    Pause,
    /// A discrete line cannot be set or read.
    DiscreteLine,
}

const KINDS: [ErrorKind; 14] = [
    ErrorKind::Board,
    ErrorKind::Panicked,
    ErrorKind::SettingsLost,
    ErrorKind::Overrun,
    ErrorKind::BusOff,
    ErrorKind::HeartbeatLost,
    ErrorKind::Laser,
    ErrorKind::DriveEncoder,
    ErrorKind::SteeringEncoder,
    ErrorKind::Lost,
    ErrorKind::Overload,
    ErrorKind::PoseRefused,
    ErrorKind::Pause,
    ErrorKind::DiscreteLine,
];

impl ErrorKind {
    /// The code that is told.
    #[must_use]
    pub const fn code(self) -> u16 {
        match self {
            Self::Board => 0x5000,
            Self::Panicked => 0x6100,
            Self::SettingsLost => 0x6300,
            Self::Overrun => 0x8110,
            Self::BusOff => 0x8140,
            Self::HeartbeatLost => 0x8130,
            Self::Laser => 0x7300,
            Self::DriveEncoder => 0x7305,
            Self::SteeringEncoder => 0x7306,
            Self::Lost => 0xFF01,
            Self::Overload => 0xFF02,
            Self::PoseRefused => 0xFF03,
            Self::Pause => 0xFF04,
            Self::DiscreteLine => 0xFF05,
        }
    }

    /// Its bits of the error register: generic, communication (8xxxh), manufacturer (FFxxh).
    const fn register(self) -> u8 {
        match self.code() >> 8 {
            0x80..=0x8F => 0x11,
            0xFF => 0x81,
            _ => 0x01,
        }
    }

    const fn is_lasting(self) -> bool {
        matches!(self, Self::Board | Self::Panicked | Self::SettingsLost)
    }
}

/// One kind of error.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// When there was something of it the last time, while it is not over.
    seen: Option<Time>,
    /// Whether the bus was told of it.
    is_told: bool,
    /// Of which parts there was something, and of which the bus was told: a bit for each.
    parts: u8,
    told_parts: u8,
}

/// What is wrong and what was.
#[derive(Clone, Debug)]
pub(super) struct Errors {
    states: [State; KINDS.len()],
    /// The latest first.
    history: [u32; HISTORY],
    remembered: usize,
}

impl Errors {
    pub(super) const fn new() -> Self {
        Self {
            states: [State { seen: None, is_told: false, parts: 0, told_parts: 0 }; KINDS.len()],
            history: [0; HISTORY],
            remembered: 0,
        }
    }

    /// There is such an error at `now`, of the parts whose bits are set.
    pub(super) fn report(&mut self, kind: ErrorKind, parts: u8, now: Time) {
        if let Some((_, state)) = KINDS.iter().zip(&mut self.states).find(|(known, _)| **known == kind) {
            state.seen = Some(now);
            state.parts |= parts;
        }
    }

    /// The next emergency that is due: an error, or the end of one.
    pub(super) fn poll(&mut self, now: Time) -> Option<Emergency> {
        for (kind, state) in KINDS.iter().zip(&mut self.states) {
            if !kind.is_lasting() && state.is_told && state.seen.is_some_and(|seen| now.since(seen) >= HOLD) {
                (state.seen, state.parts) = (None, 0);
            }
        }
        let is_due = |(_, state): &(&ErrorKind, &mut State)| {
            state.seen.is_some() != state.is_told || state.parts != state.told_parts
        };
        let (kind, state) = KINDS.iter().zip(&mut self.states).find(is_due)?;
        state.is_told = state.seen.is_some();
        state.told_parts = state.parts;
        let (is_there, code, parts) = (state.is_told, kind.code(), state.parts);
        let register = self.register();
        if is_there {
            self.remember(code, parts);
            return Some(Emergency { code, register, details: [parts, 0, 0, 0, 0] });
        }
        let [low, high] = code.to_le_bytes();
        Some(Emergency { code: 0, register, details: [low, high, 0, 0, 0] })
    }

    /// The upper half of an entry is the additional information of CiA 301: the parts.
    fn remember(&mut self, code: u16, parts: u8) {
        let mut carried = u32::from(code) | u32::from(parts) << 16;
        for place in &mut self.history {
            carried = core::mem::replace(place, carried);
        }
        self.remembered = (self.remembered + 1).min(HISTORY);
    }

    /// The error register, object 1001h.
    pub(super) fn register(&self) -> u8 {
        let there = KINDS.iter().zip(&self.states).filter(|(_, state)| state.seen.is_some());
        there.fold(0, |register, (kind, _)| register | kind.register())
    }

    /// Errors that happened, the latest first: object 1003h.
    pub(super) fn history(&self) -> &[u32] {
        self.history.get(..self.remembered).unwrap_or_default()
    }

    /// Forgets what happened.
    pub(super) fn clear_history(&mut self) {
        self.remembered = 0;
    }
}
