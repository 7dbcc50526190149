//! Reflectors seen together, over one revolution or a few.

use heapless::Vec;

use crate::geometry::{Point, Pose, ScanPoint};

/// How precisely reflectors are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectorNoise {
    /// Standard deviation of a range, m.
    pub range: f32,
    /// Standard deviation of a bearing, rad.
    pub bearing: f32,
    /// Standard deviation of a mapped position on each axis, m.
    pub map: f32,
}

impl Default for ReflectorNoise {
    fn default() -> Self {
        Self { range: 0.01, bearing: 0.001, map: 0.003 }
    }
}

/// A reflector in the frame of the snapshot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenReflector {
    /// Position, m.
    pub position: ScanPoint,
    /// Variance of the position on each axis, m^2.
    pub variance: f32,
    /// In how many revolutions it was seen.
    pub times: u8,
    /// How far the vehicle has gone since, m.
    pub gone: f32,
}

/// Up to `SEEN` reflectors in one frame.
#[derive(Clone, Debug, Default)]
pub struct ReflectorSnapshot<const SEEN: usize = 64> {
    reflectors: Vec<SeenReflector, SEEN>,
}

/// Two sightings whose distance is under this many standard deviations are of one reflector.
const SAME: f32 = 4.0;

impl<const SEEN: usize> ReflectorSnapshot<SEEN> {
    /// An empty snapshot.
    #[must_use]
    pub const fn new() -> Self {
        Self { reflectors: Vec::new() }
    }

    /// Forgets all reflectors.
    pub fn clear(&mut self) {
        self.reflectors.clear();
    }

    /// The reflectors.
    #[must_use]
    pub fn reflectors(&self) -> &[SeenReflector] {
        &self.reflectors
    }

    /// Moves the frame by the vehicle's own motion; `shift_variance` (m^2) and `turn_variance` (rad^2) are its errors.
    pub fn travel(&mut self, motion: &Pose, shift_variance: f32, turn_variance: f32) {
        let gone = libm::hypot(motion.x, motion.y) as f32;
        for seen in &mut self.reflectors {
            seen.gone += gone;
            seen.position = motion.inverse_transform(&seen.position.cast()).cast();
            // Half of the error of a turn falls on each axis, on average.
            seen.variance += shift_variance + 0.5 * turn_variance * seen.position.norm_squared();
        }
    }

    /// Forgets the reflectors that were last seen so far behind, m.
    pub fn forget_behind(&mut self, distance: f32) {
        self.reflectors.retain(|seen| seen.gone <= distance);
    }

    /// Adds a reflector at `position` (m, in the frame of the snapshot) that was seen at `range` (m): joins it to one seen
    /// before at the same place. What exceeds the capacity is left out.
    pub fn see(&mut self, position: &Point, range: f64, noise: &ReflectorNoise) {
        let across = range as f32 * noise.bearing;
        let variance = 0.5 * (noise.range * noise.range + across * across) + noise.map * noise.map;
        self.see_landmark(position, variance);
    }

    /// The same for a landmark of any kind whose position has that variance on each axis, m^2, the map's own included.
    pub fn see_landmark(&mut self, position: &Point, variance: f32) {
        let position: ScanPoint = position.cast();
        if !(position.x.is_finite() && position.y.is_finite()) {
            return;
        }
        let known = self
            .reflectors
            .iter_mut()
            .find(|seen| (seen.position - position).norm_squared() < SAME * SAME * (seen.variance + variance));
        if let Some(seen) = known {
            let share = seen.variance / (seen.variance + variance);
            seen.position += (position - seen.position) * share;
            // What map and bearing err does not average out quickly.
            seen.variance = (seen.variance * (1.0 - share)).max(0.5 * variance);
            seen.times = seen.times.saturating_add(1);
            seen.gone = 0.0;
        } else {
            let _ = self.reflectors.push(SeenReflector { position, variance, times: 1, gone: 0.0 });
        }
    }
}
