//! What a laser sees that is not there, and what it does not see.

use agv_core::geometry::wrap;
use agv_core::measurement::ReflectorObservation;
use agv_host_sim::simulate::random::Random;
use serde::{Deserialize, Serialize};

use super::measured::FARTHEST;

/// What is wrong with what is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ViewError {
    /// Behind three reflectors of ten there is another one, so many metres further: glass.
    Echoes,
    /// So many reflections move with the vehicle: foil on its load.
    LoadShines,
    /// Nothing is seen beyond 30 m less that share of them.
    NearOnly,
    /// That share of what is seen is 2 m away: fog.
    Fog,
    /// So many degrees of each revolution are lost, elsewhere in each.
    Gap,
    /// That share of the revolutions shows what the one before has shown.
    Repeats,
    /// A third of the reflectors is half hidden, so that its middle is seen so many metres aside.
    HalfHidden,
}

/// Where fog is seen, m, with its deviation (PX4-SITL_gazebo-classic, pull request 725).
const FOG: (f64, f64) = (2.0, 0.1);
/// Between the gaps of two revolutions, and two reflections of the load, rad: the golden angle, which spreads them over all directions.
const GOLDEN: f64 = 2.399_963_229_728_653;
/// Share of the reflectors behind which there is glass.
const BEHIND_GLASS: f64 = 0.3;

/// Where the first reflection of the load is, rad and m, and how much further the next one, m.
const LOAD: (f64, f64) = (2.0, 0.8);
const LOAD_APART: f64 = 0.21;

impl ViewError {
    /// Whether a distance and a bearing, rad, of the revolution with that number are lost. Surfaces are seen further than reflectors, but none
    /// is lost where the size is nought.
    pub(super) fn hides(self, size: f64, (range, bearing): (f64, f64), number: u64) -> bool {
        match self {
            Self::NearOnly => size > 0.0 && range > FARTHEST * (1.0 - size),
            Self::Gap => (bearing - GOLDEN * number as f64).rem_euclid(std::f64::consts::TAU) < size.to_radians(),
            _ => false,
        }
    }

    /// What is seen where fog is.
    pub(super) fn fog(random: &mut Random) -> f64 {
        FOG.0 + FOG.1 * random.normal()
    }

    /// Bearings and distances of what is seen beside, or behind, what was seen.
    pub(super) fn added(self, size: f64, seen: &[ReflectorObservation], random: &mut Random) -> Vec<(f64, f64)> {
        match self {
            Self::Echoes => seen
                .iter()
                .filter(|_| size > 0.0 && random.happens(BEHIND_GLASS))
                .map(|seen| (f64::from(seen.bearing), f64::from(seen.range) + size))
                .collect(),
            Self::LoadShines => (0..size as u32)
                .map(f64::from)
                .map(|number| (wrap(LOAD.0 + GOLDEN * number), LOAD.1 + LOAD_APART * number))
                .collect(),
            _ => Vec::new(),
        }
    }
}
