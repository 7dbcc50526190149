//! When two signatures are of the same place: learned from the map, not fixed.

/// Share of the smallest distance between key scans of different places.
const SHARE: f64 = 0.8;

/// The threshold: 0.8 times the smallest distance between two of the map's own key scans that are more than `apart` m
/// from each other. `positions` and the numbers that `distance` takes are of the key scans. None if no two are so far
/// apart.
pub fn from_key_scans(positions: &[[f64; 2]], apart: f64, distance: impl Fn(usize, usize) -> f64) -> Option<f64> {
    let mut least: Option<f64> = None;
    for (one, here) in positions.iter().enumerate() {
        for (other, there) in positions.iter().enumerate().take(one) {
            if libm::hypot(here[0] - there[0], here[1] - there[1]) > apart {
                let found = distance(one, other);
                least = Some(least.map_or(found, |least| least.min(found)));
            }
        }
    }
    least.map(|least| SHARE * least)
}
