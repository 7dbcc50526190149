//! The beams of a scan as candidates for corners (K 3.1.1).

use heapless::Vec;

use super::corner::Corner;
use super::parameters::Parameters;
use super::runs::Lengths;
use super::score::{PairSum, Sectors};
use super::suppression::Cost;
use crate::geometry::ScanPoint;
use crate::sensing::line::Moments;
use crate::sensing::neighbourhood::{Disc, Reach, Side, beams_within, farthest};
use crate::sensing::{Keypoint, KeypointKind, PointView};

/// A scan, and what is asked of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidates<'a> {
    pub scan: &'a PointView<'a>,
    pub runs: Lengths<'a>,
    pub crosses_seam: bool,
    pub parameters: &'a Parameters,
    pub sectors: &'a Sectors,
}

/// Beams whose windows are computed together. One alone would be a chain of waiting for exponentials and quotients, at the end of
/// which the processor guesses wrong where the neighbourhood ends.
const AHEAD: usize = 16;

/// Where neighbours of a candidate may be.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Index of the candidate's beam.
    index: usize,
    /// Its range, m.
    range: f32,
    /// Radius of the disc, m.
    radius: f32,
    /// Shortest base and height of the triangle, m.
    shortest: f32,
    /// Beams before the candidate.
    before: u16,
    /// Beams after it.
    after: u16,
}

/// A candidate's neighbourhood.
#[derive(Clone, Copy, Debug)]
struct Neighbourhood {
    disc: Disc,
    reach: Reach,
    /// Height of the triangle, m.
    height: f32,
}

impl Candidates<'_> {
    /// Sets the cost of each beam. Returns the largest one of a candidate.
    pub(super) fn weigh(&self, costs: &mut [Cost]) -> f32 {
        costs.fill(Cost::NONE);
        let (least, farthest) = (self.least(), self.parameters.farthest);
        let mut worst = 0.0_f32;
        let mut windows = Vec::<Window, AHEAD>::new();
        let count = self.scan.ranges.len().min(self.runs.before.len()).min(self.runs.after.len());
        // Three slices that go on together take half as many instructions again.
        for index in 0..count {
            let Some(&range) = self.scan.ranges.get(index) else { break };
            let (Some(&before), Some(&after)) = (self.runs.before.get(index), self.runs.after.get(index)) else {
                break;
            };
            if range > 0.0 && range <= farthest && before.min(after) >= least {
                // There is room whenever it comes here.
                let _ = windows.push(Window { index, range, before, after, radius: 0.0, shortest: 0.0 });
                if windows.is_full() {
                    worst = worst.max(self.weigh_some(&mut windows, costs));
                    windows.clear();
                }
            }
        }
        worst.max(self.weigh_some(&mut windows, costs))
    }

    /// Sets the costs of some beams. Returns the largest one of a candidate.
    fn weigh_some(&self, windows: &mut [Window], costs: &mut [Cost]) -> f32 {
        let mut worst = 0.0_f32;
        for window in &mut *windows {
            window.radius = self.radius(window.range);
        }
        for window in &mut *windows {
            self.narrow(window);
        }
        for window in windows {
            let cost = self.cost(window);
            if cost.is_candidate() {
                worst = worst.max(cost.cost);
                if let Some(slot) = costs.get_mut(window.index) {
                    *slot = cost;
                }
            }
        }
        worst
    }

    /// Radius of a neighbourhood at `range`, m (K 3.1.1); never reaches the sensor.
    fn radius(&self, range: f32) -> f32 {
        let radius = self.parameters.radius_scale * libm::expf(self.parameters.radius_growth * range);
        if radius >= range { 0.8 * range } else { radius }
    }

    /// Fewest neighbours on each side.
    fn least(&self) -> u16 {
        self.parameters.points_a_side.max(1)
    }

    /// Narrows a window that reaches to the ends of the surface to the radius.
    #[inline(always)]
    fn narrow(&self, window: &mut Window) {
        let beams = beams_within(window.radius / window.range, self.scan.bearing_step).min(self.most());
        window.before = window.before.min(beams);
        window.after = window.after.min(beams);
        window.shortest = window.radius / self.parameters.triangle_ratio;
    }

    /// Most neighbours on each side.
    fn most(&self) -> u16 {
        let count = self.scan.ranges.len();
        let most = if self.crosses_seam { count.saturating_sub(1) / 2 } else { count };
        u16::try_from(most).unwrap_or(u16::MAX)
    }

    /// The neighbourhood of a beam. None if the beam is no candidate.
    #[inline(always)]
    fn neighbourhood(&self, window: &Window) -> Option<Neighbourhood> {
        let Window { index, range, radius, before, after, shortest } = *window;
        let disc = Disc { centre: *self.scan.points.get(index)?, range, radius };
        let least = usize::from(self.least());
        let [before, after] = farthest(self.scan, index, (before, after), &disc)?;
        if before.0 < least || after.0 < least {
            return None;
        }
        // The triangle of K 3.1.1, relative to the candidate.
        let base = after.1 - before.1;
        let squared_base = base.norm_squared();
        let doubled_area = before.1.x * after.1.y - before.1.y * after.1.x;
        let is_narrow = squared_base < shortest * shortest;
        let is_flat = doubled_area * doubled_area < shortest * shortest * squared_base;
        if is_narrow || is_flat {
            return None;
        }
        let height = libm::fabsf(doubled_area) / libm::sqrtf(squared_base);
        Some(Neighbourhood { disc, reach: Reach { before: before.0, after: after.0 }, height })
    }

    /// What the detector holds against a beam being a corner.
    fn cost(&self, window: &Window) -> Cost {
        let Some(around) = self.neighbourhood(window) else { return Cost::NONE };
        let index = window.index;
        if self.parameters.gate.is_some() {
            let corner = self.corner(index, &around);
            // The beam whose lines fix the corner best is the one at the corner.
            return corner.map_or(Cost::NONE, |corner| Cost { cost: corner.variance, height: around.height });
        }
        let before = Side::before(self.scan, index, around.reach.before);
        let after = Side::after(self.scan, index, around.reach.after);
        let Some(orientation) = self.orientation(&around, &before, &after) else { return Cost::NONE };
        let origin = self.sectors.origin(orientation);
        let score = [before, after].map(|side| {
            let mut sum = PairSum::new(self.sectors, origin);
            side.visit(&around.disc, |relative| sum.add(relative));
            sum.value()
        });
        Cost { cost: (score[0] + score[1]) as f32, height: around.height }
    }

    /// Direction of the corner (K 3.2.3), not normalised. None if a side has too few points, or if there is none.
    fn orientation(&self, around: &Neighbourhood, before: &Side<'_>, after: &Side<'_>) -> Option<ScanPoint> {
        let least = f32::from(self.parameters.points_a_side.max(1));
        let mut orientation = ScanPoint::zeros();
        for side in [before, after] {
            let (mut count, mut sum) = (0.0_f32, ScanPoint::zeros());
            side.visit(&around.disc, |relative| {
                count += 1.0;
                sum += relative;
            });
            if count < least {
                return None;
            }
            orientation += sum / count;
        }
        (orientation.norm_squared() > 1e-12).then_some(orientation)
    }

    /// The corner between the beams (K 3.1.2). None if the lines do not meet near the candidate, or fail the gate.
    fn corner(&self, index: usize, around: &Neighbourhood) -> Option<Corner> {
        let least = f32::from(self.parameters.points_a_side);
        let fit = |side: Side<'_>| {
            let mut moments = Moments::default();
            side.visit(&around.disc, |relative| moments.add(relative));
            let is_enough = moments.count >= least;
            if self.parameters.lines_include_corner {
                moments.add(ScanPoint::zeros());
            }
            let line = is_enough.then(|| moments.line()).flatten();
            line.filter(|line| self.parameters.gate.is_none_or(|gate| gate.is_straight(line)))
        };
        let before = fit(Side::before(self.scan, index, around.reach.before))?;
        let after = fit(Side::after(self.scan, index, around.reach.after))?;
        let corner = Corner::between(before, after, &around.disc, self.parameters)?;
        let passes =
            self.parameters.gate.is_none_or(|gate| corner.passes(&gate, self.scan.bearing_step * around.disc.range));
        passes.then_some(corner)
    }

    /// Covariance of a corner that is known only to lie near its beam's return, m^2.
    fn own_covariance(&self) -> [f32; 3] {
        let limit = self.parameters.sub_beam_limit;
        let variance = limit * limit / 12.0 + self.parameters.range_deviation * self.parameters.range_deviation;
        [variance, 0.0, variance]
    }

    /// The corner at a candidate. None if its sides do not make one.
    pub(super) fn keypoint(&self, index: usize, score: f32) -> Option<Keypoint> {
        let range = *self.scan.ranges.get(index)?;
        let (before, after) = (*self.runs.before.get(index)?, *self.runs.after.get(index)?);
        let mut window = Window { index, range, radius: self.radius(range), before, after, shortest: 0.0 };
        self.narrow(&mut window);
        let around = self.neighbourhood(&window)?;
        let before = Side::before(self.scan, index, around.reach.before);
        let after = Side::after(self.scan, index, around.reach.after);
        let orientation = self.orientation(&around, &before, &after)?;
        let (position, covariance) = match self.corner(index, &around) {
            Some(corner) => (around.disc.centre + corner.relative, corner.covariance),
            None if self.parameters.gate.is_some() => return None,
            None => (around.disc.centre, self.own_covariance()),
        };
        Some(Keypoint {
            kind: KeypointKind::Corner,
            beam: index as u16,
            position,
            covariance,
            orientation: libm::atan2f(orientation.y, orientation.x),
            radius: around.disc.radius,
            score,
        })
    }
}
