//! The last key scans, each as points in the frame of its own laser.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{PackedPoint, SurfacePoint};
use crate::geometry::{Pose, difference};

/// A scan of the distance behind.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KeyScan<const POINTS: usize> {
    /// Pose of the laser.
    pub pose: Pose,
    /// Standard deviation of its position along an axis, m, and of its heading, rad, where that matters.
    pub deviation: [f32; 2],
    /// Points of its surfaces, in the frame of the laser.
    pub points: Vec<PackedPoint, POINTS>,
}

impl<const POINTS: usize> KeyScan<POINTS> {
    const EMPTY: Self = Self { pose: Pose { x: 0.0, y: 0.0, theta: 0.0 }, deviation: [0.0; 2], points: Vec::new() };
}

/// Distance after which a scan becomes a key scan, m.
const SPACING: f64 = 0.4;

/// Turn after which it does, rad.
const TURN: f64 = 20.0 * core::f64::consts::PI / 180.0;

/// The last `KEYS` key scans of at most `POINTS` points.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KeyRing<const KEYS: usize, const POINTS: usize> {
    keys: Vec<KeyScan<POINTS>, KEYS>,
    /// Number of key scans that were made.
    made: usize,
}

impl<const KEYS: usize, const POINTS: usize> KeyRing<KEYS, POINTS> {
    /// No key scans; never any if there is no room for one.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self { keys: Vec::new(), made: 0 }
    }

    /// Forgets all.
    pub const fn clear(&mut self) {
        self.made = 0;
    }

    /// The newest one.
    #[must_use]
    pub fn newest(&self) -> Option<&KeyScan<POINTS>> {
        self.keys.get(self.made.checked_sub(1)?.checked_rem(KEYS)?)
    }

    /// All of them, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &KeyScan<POINTS>> {
        let first = self.made.saturating_sub(KEYS);
        (first..self.made).filter_map(|number| self.keys.get(number.checked_rem(KEYS)?))
    }

    /// Whether a scan at that pose is far enough from the newest key scan to be the next.
    #[must_use]
    pub fn wants(&self, pose: &Pose) -> bool {
        self.newest().is_none_or(|newest| {
            libm::hypot(pose.x - newest.pose.x, pose.y - newest.pose.y) > SPACING
                || libm::fabs(difference(pose.theta, newest.pose.theta)) > TURN
        })
    }

    /// Keeps a scan in place of the oldest.
    pub fn keep(&mut self, pose: &Pose, deviation: [f32; 2], points: impl Iterator<Item = SurfacePoint>) {
        let Some(place) = self.made.checked_rem(KEYS) else { return };
        if place >= self.keys.len() && self.keys.push(KeyScan::EMPTY).is_err() {
            return;
        }
        let Some(key) = self.keys.get_mut(place) else { return };
        (key.pose, key.deviation) = (*pose, deviation);
        key.points.clear();
        for point in points.filter_map(|point| PackedPoint::of(&point)) {
            // A scan has no more points than a key scan.
            if key.points.push(point).is_err() {
                break;
            }
        }
        // The remainder stays what it is when the count begins anew.
        self.made = if self.made >= 2 * KEYS { self.made - KEYS + 1 } else { self.made + 1 };
    }
}

impl<const KEYS: usize, const POINTS: usize> Default for KeyRing<KEYS, POINTS> {
    fn default() -> Self {
        Self::new()
    }
}
