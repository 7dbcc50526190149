//! One point, and what became of the returns that are none.

/// Which of the returns of a firing it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReturnKind {
    /// The packets do not say.
    #[default]
    Unknown,
    /// The nearest one.
    First,
    /// The one behind the nearest.
    Second,
    /// The one of most light.
    Strongest,
    /// The one of the second most light.
    SecondStrongest,
    /// The farthest one.
    Last,
    /// Two returns were asked for, and both are this one.
    Both,
}

impl ReturnKind {
    /// Name, for people and for files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::First => "first",
            Self::Second => "second",
            Self::Strongest => "strongest",
            Self::SecondStrongest => "second strongest",
            Self::Last => "last",
            Self::Both => "both",
        }
    }
}

/// One point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// x, y, z, m.
    pub position: [f32; 3],
    /// When it was measured, after the time that the packet states, ns.
    pub time: i32,
    /// Intensity or reflectivity, in the sensor's own unit.
    pub intensity: u16,
    /// Angle of the head, clockwise seen from above, 0.01 degrees.
    pub azimuth: u16,
    /// Number of the laser, as the maker counts them, from 0.
    pub laser: u8,
    /// Place of the laser among those in use, from the lowest beam up, from 0.
    pub ring: u8,
    /// Which of the returns of its firing it is.
    pub kind: ReturnKind,
}

/// Returns outside of these distances are false.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// Least corrected distance, m.
    pub near: f32,
    /// Greatest corrected distance, m.
    pub far: f32,
}

impl Filter {
    /// Everything that a sensor can state.
    pub const ALL: Self = Self { near: 0.0, far: f32::MAX };
}

/// What became of the returns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Points.
    pub points: u64,
    /// Returns in which nothing was seen.
    pub empty: u64,
    /// Nearer than the filter allows.
    pub near: u64,
    /// Farther than the filter allows.
    pub far: u64,
    /// Of a laser that the sensor does not have, or that is not in use.
    pub unused: u64,
    /// Second returns of a firing that are the first one again.
    pub equal: u64,
}

impl Tally {
    /// All returns.
    #[must_use]
    pub const fn returns(&self) -> u64 {
        self.points + self.empty + self.near + self.far + self.unused + self.equal
    }
}

/// Rings by the number of the laser, from the lowest beam up; lasers that are not in use count for nothing.
pub(crate) fn rings<const LASERS: usize>(elevations: impl Iterator<Item = Option<f64>> + Clone) -> [u8; LASERS] {
    let mut rings = [0; LASERS];
    for (number, (elevation, ring)) in elevations.clone().zip(&mut rings).enumerate() {
        let Some(elevation) = elevation else { continue };
        let is_below = |(other_number, other): &(usize, Option<f64>)| {
            other.is_some_and(|other| other < elevation || (other == elevation && *other_number > number))
        };
        *ring = elevations.clone().take(LASERS).enumerate().filter(is_below).count() as u8;
    }
    rings
}
