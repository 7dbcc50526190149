//! How many pairs of reflectors are how far apart.

use super::squared_distance::{bucket, buckets, width};
use crate::geometry::Point;

/// A factor of two of squared distance is divided into 16.
const BITS: u32 = 4;

const BUCKETS: usize = buckets(BITS);

/// Number of pairs by squared distance.
#[derive(Clone, Debug)]
pub(super) struct DistanceHistogram {
    counts: [u32; BUCKETS],
}

impl DistanceHistogram {
    pub(super) const fn new() -> Self {
        Self { counts: [0; BUCKETS] }
    }

    /// Counts all pairs of the positions, m.
    pub(super) fn build(&mut self, positions: impl Iterator<Item = Point> + Clone) {
        self.counts = [0; BUCKETS];
        for (number, one) in positions.clone().enumerate() {
            for other in positions.clone().take(number) {
                if let Some(count) = self.counts.get_mut(bucket((one - other).norm_squared() as f32, BITS)) {
                    *count += 1;
                }
            }
        }
    }

    /// About how many pairs have a squared distance of `square`, give or take `margin`, m^2.
    #[inline]
    pub(super) fn count(&self, square: f32, margin: f32) -> f32 {
        let place = bucket(square, BITS);
        self.counts.get(place).map_or(0.0, |count| *count as f32 * 2.0 * margin / width(place, BITS))
    }
}
