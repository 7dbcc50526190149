//! Unbroken surfaces: where one ends, neighbourhoods end too.

use crate::geometry::ScanPoint;
use crate::sensing::PointScan;

/// Absent returns that are bridged between two returns of one surface.
const BRIDGED: usize = 2;

/// Beams between the returns from which a range is extrapolated; two steps damp the noise, more would cut small faces.
const BASELINE: usize = 2;

/// How far the surface of each beam goes on without a break.
#[derive(Clone, Debug)]
pub(super) struct Runs<const BEAMS: usize> {
    /// Beams before each beam that lie on its surface, absent ones between them included.
    before: [u16; BEAMS],
    /// The same after each beam.
    after: [u16; BEAMS],
}

impl<const BEAMS: usize> Runs<BEAMS> {
    pub(super) const fn new() -> Self {
        Self { before: [0; BEAMS], after: [0; BEAMS] }
    }

    /// Beams before `index` on the same surface.
    pub(super) fn before(&self, index: usize) -> usize {
        self.before.get(index).copied().map_or(0, usize::from)
    }

    /// Beams after `index` on the same surface.
    pub(super) fn after(&self, index: usize) -> usize {
        self.after.get(index).copied().map_or(0, usize::from)
    }

    /// Finds the surfaces of a scan; a surface ends where the range departs from it by more than `jump` (m).
    pub(super) fn find(&mut self, scan: &PointScan<BEAMS>, crosses_seam: bool, jump: f32) {
        let beams = Beams { ranges: &scan.ranges, points: &scan.points, crosses_seam };
        let count = scan.ranges.len();
        let most = count.saturating_sub(1);
        self.before.fill(0);
        self.after.fill(0);
        // The second lap carries a surface across the seam.
        let laps = if crosses_seam { 2 } else { 1 };
        for step in 0..laps * count {
            let index = if step < count { step } else { step - count };
            let Some(gap) = beams.gap_before(index) else { continue };
            let Some(previous) = beams.back(index, gap) else { continue };
            let is_continued =
                if step < count { !beams.is_broken(previous, index, jump) } else { self.before(index) > 0 };
            if is_continued {
                let length = (self.before(previous) + gap).min(most);
                if let Some(slot) = self.before.get_mut(index) {
                    *slot = length as u16;
                }
            } else if step >= count {
                break;
            }
        }
        for step in 0..laps * count {
            let index = count - 1 - if step < count { step } else { step - count };
            let before = self.before(index);
            if before == 0 {
                continue;
            }
            let Some(gap) = beams.gap_before(index) else { continue };
            let Some(previous) = beams.back(index, gap) else { continue };
            let length = (self.after(index) + gap).min(most);
            if let Some(slot) = self.after.get_mut(previous) {
                *slot = length as u16;
            }
        }
    }
}

/// Ranges by beam, around the circle or not.
#[derive(Clone, Copy)]
pub(super) struct Beams<'a> {
    pub ranges: &'a [f32],
    pub points: &'a [ScanPoint],
    pub crosses_seam: bool,
}

impl Beams<'_> {
    /// The beam `steps` before `index`.
    pub(super) fn back(&self, index: usize, steps: usize) -> Option<usize> {
        if steps <= index {
            Some(index - steps)
        } else if self.crosses_seam && steps <= index + self.ranges.len() {
            Some(index + self.ranges.len() - steps)
        } else {
            None
        }
    }

    /// The beam `steps` after `index`.
    pub(super) fn forth(&self, index: usize, steps: usize) -> Option<usize> {
        let sum = index + steps;
        if sum < self.ranges.len() {
            Some(sum)
        } else if self.crosses_seam && sum < 2 * self.ranges.len() {
            Some(sum - self.ranges.len())
        } else {
            None
        }
    }

    /// Range of a beam, m; None if it is absent.
    pub(super) fn range(&self, index: usize) -> Option<f32> {
        self.ranges.get(index).copied().filter(|range| *range > 0.0)
    }

    /// Distance of a return from the origin of the points, m; None if it is absent.
    fn distance(&self, index: usize) -> Option<f32> {
        self.range(index)?;
        self.points.get(index).map(|point| point.norm()).filter(|distance| *distance > 0.0)
    }

    /// Steps back to the nearest present return. None if `index` itself is absent, or if too many are.
    fn gap_before(&self, index: usize) -> Option<usize> {
        self.range(index)?;
        if index > 0 && self.range(index - 1).is_some() {
            return Some(1);
        }
        (1..=BRIDGED + 1).find(|gap| self.back(index, *gap).and_then(|previous| self.range(previous)).is_some())
    }

    /// Whether two neighbouring returns lie on different surfaces: neither surface, continued straight, meets the other
    /// return.
    fn is_broken(&self, earlier: usize, later: usize, jump: f32) -> bool {
        let (Some(first), Some(second)) = (self.range(earlier), self.range(later)) else { return true };
        if libm::fabsf(second - first) <= jump {
            return false;
        }
        // Across the seam of a moving sensor ranges jump though the surface does not; corrected points do not.
        let (Some(first), Some(second)) = (self.distance(earlier), self.distance(later)) else { return true };
        if libm::fabsf(second - first) <= jump {
            return false;
        }
        let gap = if later > earlier { later - earlier } else { later + self.ranges.len() - earlier };
        let continues = |from: f32, inner: Option<usize>, target: f32| {
            let inner = inner.and_then(|index| self.distance(index));
            inner.is_some_and(|inner| {
                // Along a straight line the inverse range is linear in the bearing, up to its square.
                let slope = (1.0 / from - 1.0 / inner) / BASELINE as f32;
                let inverse = 1.0 / from + slope * gap as f32;
                inverse > 0.0 && libm::fabsf(1.0 / inverse - target) <= jump
            })
        };
        !(continues(first, self.back(earlier, BASELINE), second)
            || continues(second, self.forth(later, BASELINE), first))
    }
}
