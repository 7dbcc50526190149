//! What the NAV350 is asked for.

use agv_wire::nav350::{Configuration, LandmarkDataFormat, OperatingMode, Orientation, UserLevel};

/// What the NAV350 is asked for, and told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaserSettings {
    /// Word of access of an authorised client.
    pub password: u32,
    /// Layer of its layout; [`LaserSettings::ANY_LAYER`] leaves it as it is.
    pub layer: u16,
    /// What it does.
    pub mode: LaserMode,
    /// Which reflectors it reports: 0 those that it uses, 1 all. The meaning is not verified.
    pub landmark_filter: u8,
    /// Which way its angles grow.
    pub orientation: LaserOrientation,
    /// Whether it is told how fast it moves.
    pub tells_speed: bool,
}

/// What the NAV350 does. The number of a mode never gets another meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum LaserMode {
    /// Poses, reflectors and scans; it needs a layout of at least three reflectors.
    Navigation = 0,
    /// Reflectors and scans: for a laser without a layout.
    LandmarkDetection = 1,
}

/// Which way the NAV350's angles grow, seen from above. The number of one never gets another meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum LaserOrientation {
    /// To the left; it is told so.
    CounterClockwise = 0,
    /// To the right; it is told so.
    Clockwise = 1,
    /// As it says itself.
    Own = 2,
}

impl LaserMode {
    /// Their names, at their numbers.
    pub const NAMES: [&'static str; 2] = ["navigation", "landmark_detection"];

    /// The mode with that number.
    #[must_use]
    pub const fn of_number(number: u64) -> Option<Self> {
        match number {
            0 => Some(Self::Navigation),
            1 => Some(Self::LandmarkDetection),
            _ => None,
        }
    }
}

impl LaserOrientation {
    /// Their names, at their numbers.
    pub const NAMES: [&'static str; 3] = ["counter_clockwise", "clockwise", "own"];

    /// The one with that number.
    #[must_use]
    pub const fn of_number(number: u64) -> Option<Self> {
        match number {
            0 => Some(Self::CounterClockwise),
            1 => Some(Self::Clockwise),
            2 => Some(Self::Own),
            _ => None,
        }
    }
}

impl LaserSettings {
    /// The layer that leaves the laser's own.
    pub const ANY_LAYER: u16 = u16::MAX;

    /// What a session asks for.
    #[must_use]
    pub fn configuration(&self) -> Configuration {
        let usual = Configuration::default();
        let Self { password, layer, mode, landmark_filter: filter, orientation, .. } = *self;
        Configuration {
            password,
            layer: (layer != Self::ANY_LAYER).then_some(layer),
            mode: match mode {
                LaserMode::Navigation => OperatingMode::Navigation,
                LaserMode::LandmarkDetection => OperatingMode::LandmarkDetection,
            },
            landmark_format: LandmarkDataFormat { filter, ..usual.landmark_format },
            orientation: match orientation {
                LaserOrientation::CounterClockwise => Some(Orientation::CounterClockwise),
                LaserOrientation::Clockwise => Some(Orientation::Clockwise),
                LaserOrientation::Own => None,
            },
            ..usual
        }
    }
}

impl Default for LaserSettings {
    /// Navigation with the maker's password; its own layer, all reflectors, angles to the left, no speed.
    fn default() -> Self {
        Self {
            password: UserLevel::AuthorisedClient.default_password(),
            layer: Self::ANY_LAYER,
            mode: LaserMode::Navigation,
            landmark_filter: 1,
            orientation: LaserOrientation::CounterClockwise,
            tells_speed: false,
        }
    }
}
