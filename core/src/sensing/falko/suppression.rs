//! Which of several candidates close to each other stays (K 3.1.1).

use crate::sensing::PointView;
use crate::sensing::neighbourhood::beams_within;

/// How good a candidate is; of two candidates the one with the smaller cost stays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    /// Infinite for beams that are no candidates.
    pub cost: f32,
    /// Decides between equal costs; the larger stays.
    pub height: f32,
}

impl Cost {
    pub(super) const NONE: Self = Self { cost: f32::INFINITY, height: 0.0 };

    pub(super) fn is_candidate(&self) -> bool {
        self.cost < f32::INFINITY
    }
}

/// Whether candidate `index` has no better one nearer than `radius` (m).
///
/// Order of beams decides only between candidates that are alike in cost and height, and then by which one comes
/// first within the neighbourhood, so that the start of a full circle plays no part.
pub(super) fn is_best_within(
    scan: &PointView<'_>,
    costs: &[Cost],
    index: usize,
    radius: f32,
    crosses_seam: bool,
) -> bool {
    let (Some(own), Some(&centre), Some(&range)) = (costs.get(index), scan.points.get(index), scan.ranges.get(index))
    else {
        return false;
    };
    let count = costs.len();
    let reach = usize::from(beams_within(radius / range, scan.bearing_step)).min(count.saturating_sub(1) / 2);
    let squared_radius = radius * radius;
    let beaten = |other: usize, wins_ties: bool| {
        let Some(cost) = costs.get(other).filter(|cost| cost.is_candidate()) else { return false };
        let is_better = cost.cost < own.cost
            || (cost.cost == own.cost && (cost.height > own.height || (cost.height == own.height && wins_ties)));
        is_better && scan.points.get(other).is_some_and(|point| (point - centre).norm_squared() < squared_radius)
    };
    let wrapped = |steps: usize| if crosses_seam { steps % count } else { steps };
    for steps in 1..=reach {
        let earlier = if steps <= index || crosses_seam { Some(wrapped(index + count - steps) % count) } else { None };
        if earlier.is_some_and(|earlier| beaten(earlier, true)) || beaten(wrapped(index + steps), false) {
            return false;
        }
    }
    true
}

/// The reference program's walk: calls `keep` with the beam of each candidate that stays, in order.
///
/// `worst` is the largest cost of the scan; beams that are no candidates count as that bad.
pub(super) fn walk(
    scan: &PointView<'_>,
    costs: &[Cost],
    radius: f32,
    worst: f32,
    share: f32,
    mut keep: impl FnMut(usize),
) {
    let merit = |index: usize| {
        let cost = costs.get(index).filter(|cost| cost.is_candidate());
        cost.map_or(0.0, |cost| worst - cost.cost)
    };
    let least = libm::floorf(worst * (1.0 - share));
    let count = costs.len();
    let (mut index, mut best) = (0, 0);
    // Each turn moves on by at least one beam.
    for _ in 0..count {
        if index >= count {
            break;
        }
        let range = scan.ranges.get(index).copied().unwrap_or(0.0);
        let sine = if range > radius { radius / range } else { 0.8 };
        let window = if range > 0.0 { (libm::asinf(sine) / scan.bearing_step) as usize } else { 0 }.min(count);
        let mut start = index;
        if best + window < index {
            start = index.saturating_sub(window);
            best = index;
        }
        let mut peak = index;
        for other in start..(index + window + 1).min(count) {
            if merit(other) > merit(peak) {
                peak = other;
            }
        }
        if merit(peak) >= merit(best) {
            best = peak;
        }
        if best == index && merit(index) > least {
            keep(index);
        }
        index = if peak > index { peak } else { index + 1 };
    }
}
