//! Whether the map is of two surveys that do not lie together: again and again, some of its landmarks fit the pose, and others are elsewhere.
//! Which of the two is right nobody can tell, and who finds itself anew among those of one survey sees nothing of it. So the
//! verdict holds as long as the map.
//!
//! A sequential test (E. S. Page, "Continuous inspection schemes", Biometrika 41, 1954).

use serde::{Deserialize, Serialize};

use crate::geometry::Point;
use crate::state::ProtectionLevel;

/// Distance between two looks, m: nearer ones see the same false reflectors.
const APART: f64 = 0.5;
/// How often a look finds two groups: by chance, and in a map of two surveys where both are in sight.
const BY_CHANCE: f64 = 0.01;
const IN_TWO_SURVEYS: f64 = 0.5;
/// Looks without a false verdict that are asked for: those of 1000 km.
const LOOKS: f64 = 2e6;
/// Landmarks that fit, and that are elsewhere, at least, and of both together: fewer tell nothing.
const LEAST: usize = 2;
const LEAST_SEEN: usize = 4;

/// What one event has seen of the map.
#[derive(Clone, Copy, Debug)]
pub struct Groups {
    /// Landmarks that fit the pose.
    pub fitting: usize,
    /// Landmarks that are elsewhere.
    pub displaced: usize,
    /// How far those are elsewhere that do not fit, m, and that over their distance, rad; means.
    pub apart: ProtectionLevel,
}

/// The evidence so far.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct MapVerdict {
    /// Distance since the last look, m.
    driven: f64,
    /// Logarithm of how much likelier two surveys are.
    evidence: f64,
    /// Largest distance between the groups since there is evidence.
    apart: ProtectionLevel,
    /// Where they were seen last, in W, m, once there is a verdict.
    seam: Option<Point>,
}

impl MapVerdict {
    /// Nothing is known against the map.
    pub const NONE: Self = Self { driven: 0.0, evidence: 0.0, apart: ProtectionLevel::NONE, seam: None };

    /// Takes a distance, m.
    pub fn travel(&mut self, distance: f64) {
        self.driven += distance;
    }

    /// Takes what one event has seen from `place` in W, m.
    pub fn look(&mut self, groups: &Groups, place: Point) {
        if self.driven < APART || groups.fitting + groups.displaced < LEAST_SEEN {
            return;
        }
        self.driven = 0.0;
        let is_torn = groups.fitting >= LEAST && groups.displaced >= LEAST;
        let ratio = if is_torn { IN_TWO_SURVEYS / BY_CHANCE } else { (1.0 - IN_TWO_SURVEYS) / (1.0 - BY_CHANCE) };
        let enough = libm::log(LOOKS);
        self.evidence = (self.evidence + libm::log(ratio)).clamp(0.0, enough);
        if is_torn {
            self.apart = self.apart.or(&groups.apart);
            if self.evidence >= enough || self.seam.is_some() {
                self.seam = Some(place);
            }
        }
        if self.evidence == 0.0 && self.seam.is_none() {
            self.apart = ProtectionLevel::NONE;
        }
    }

    /// By how much the bound of a pose at `place` in W is wider: two surveys that are turned against each other part with every metre.
    #[must_use]
    pub fn widening(&self, place: Point) -> ProtectionLevel {
        let Some(seam) = self.seam else { return ProtectionLevel::NONE };
        let ProtectionLevel { position, heading } = self.apart;
        ProtectionLevel { position: position + heading * (place - seam).norm(), heading }
    }
}
