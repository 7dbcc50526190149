//! The sensor's own units.

/// A coordinate, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coordinate(pub i32);

impl Coordinate {
    /// The coordinate, m.
    #[must_use]
    pub fn metres(self) -> f64 {
        f64::from(self.0) * 1e-3
    }

    /// The nearest coordinate to that many metres, saturating.
    #[must_use]
    pub fn from_metres(metres: f64) -> Self {
        Self(libm::round(metres * 1e3) as i32)
    }
}

/// A distance, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Distance(pub u32);

impl Distance {
    /// The distance, m.
    #[must_use]
    pub fn metres(self) -> f64 {
        f64::from(self.0) * 1e-3
    }

    /// The nearest distance to that many metres, saturating.
    #[must_use]
    pub fn from_metres(metres: f64) -> Self {
        Self(libm::round(metres * 1e3) as u32)
    }
}

/// A size of a reflector, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size(pub u16);

/// A direction, thousandths of a degree, 0 to 360 000.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Angle(pub u32);

impl Angle {
    /// The direction, rad.
    #[must_use]
    pub fn radians(self) -> f64 {
        f64::from(self.0) * RADIANS
    }

    /// The nearest direction to that many radians, any turn.
    #[must_use]
    pub fn from_radians(radians: f64) -> Self {
        let turn = libm::round(radians / RADIANS) % TURN;
        Self(if turn < 0.0 { turn + TURN } else { turn } as u32)
    }
}

/// A direction with a sign, thousandths of a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Milliangle(pub i32);

impl Milliangle {
    /// The direction, rad.
    #[must_use]
    pub fn radians(self) -> f64 {
        f64::from(self.0) * RADIANS
    }

    /// The nearest direction to that many radians, saturating.
    #[must_use]
    pub fn from_radians(radians: f64) -> Self {
        Self(libm::round(radians / RADIANS) as i32)
    }
}

/// A speed, mm/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Velocity(pub i16);

impl Velocity {
    /// The nearest speed to that many metres a second, saturating.
    #[must_use]
    pub fn from_metres_per_second(speed: f64) -> Self {
        Self(libm::round(speed * 1e3) as i16)
    }
}

/// A speed of rotation, thousandths of a degree a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RotationSpeed(pub i32);

impl RotationSpeed {
    /// The nearest speed to that many radians a second, saturating.
    #[must_use]
    pub fn from_radians_per_second(speed: f64) -> Self {
        Self(libm::round(speed / RADIANS) as i32)
    }
}

/// The sensor's clock, ms. It wraps after 49.7 days.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceTime(pub u32);

impl DeviceTime {
    /// Milliseconds from `earlier` to this time, right for times less than 24 days apart, across the wrap too.
    #[must_use]
    pub const fn since(self, earlier: Self) -> i32 {
        self.0.wrapping_sub(earlier.0).cast_signed()
    }
}

/// Radians of a thousandth of a degree.
const RADIANS: f64 = core::f64::consts::PI / 180e3;

/// Thousandths of a degree of a whole turn.
const TURN: f64 = 360e3;
