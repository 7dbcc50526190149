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

    /// Beams before and after each of the first `count` beams on the same surface.
    pub(super) fn lengths(&self, count: usize) -> impl Iterator<Item = (u16, u16)> {
        self.before.iter().copied().zip(self.after.iter().copied()).take(count)
    }

    /// Finds the surfaces of a scan; a surface ends where the range departs from it by more than `jump` (m).
    pub(super) fn find(&mut self, scan: &PointScan<BEAMS>, crosses_seam: bool, jump: f32) {
        let beams = Beams { ranges: &scan.ranges, points: &scan.points, crosses_seam };
        let count = beams.ranges.len();
        // No scan has more beams than there is room for.
        let (Some(before), Some(after)) = (self.before.get_mut(..count), self.after.get_mut(..count)) else { return };
        let most = count.saturating_sub(1);

        let mut last = if crosses_seam { beams.before_first() } else { None };
        for (index, (&range, before)) in beams.ranges.iter().zip(before.iter_mut()).enumerate() {
            let linked = last.filter(|last| {
                range > 0.0
                    && last.steps <= BRIDGED + 1
                    && (libm::fabsf(range - last.range) <= jump || !beams.is_broken(index, last.steps, jump))
            });
            *before = linked.map_or(0, |last| last.length_from(most));
            last = Return::nearest(last, range, *before);
        }
        if crosses_seam {
            // The second lap carries a surface across the seam.
            for (&range, before) in beams.ranges.iter().zip(before.iter_mut()) {
                if range > 0.0 {
                    let Some(linked) = last.filter(|_| *before > 0) else { break };
                    *before = linked.length_from(most);
                }
                last = Return::nearest(last, range, *before);
            }
        }

        let mut next = None::<Return>;
        for lap in 0..if crosses_seam { 2 } else { 1 } {
            for ((&range, &before), after) in beams.ranges.iter().zip(before.iter()).zip(after.iter_mut()).rev() {
                let linked = next.filter(|_| range > 0.0);
                *after = linked.map_or(0, |next| next.length_from(most));
                next = Return::nearest(next, range, *after).filter(|next| next.steps > 1 || before > 0);
                if lap > 0 && next.is_none() {
                    break;
                }
            }
        }
    }
}

/// The nearest return on the way through the beams.
#[derive(Clone, Copy)]
struct Return {
    /// Beams since then.
    steps: usize,
    /// Range, m.
    range: f32,
    /// Beams on its surface that were passed before.
    length: u16,
}

impl Return {
    /// The nearest return after one more beam.
    #[inline]
    fn nearest(last: Option<Self>, range: f32, length: u16) -> Option<Self> {
        if range > 0.0 {
            Some(Self { steps: 1, range, length })
        } else {
            last.map(|last| Self { steps: last.steps + 1, ..last })
        }
    }

    /// Beams on the surface up to here, if it goes on.
    #[inline]
    fn length_from(self, most: usize) -> u16 {
        (usize::from(self.length) + self.steps).min(most) as u16
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

    /// The last return of the scan, as seen from its first beam.
    fn before_first(&self) -> Option<Return> {
        let steps = (1..=BRIDGED + 1).find(|steps| self.back(0, *steps).and_then(|beam| self.range(beam)).is_some())?;
        let range = self.range(self.back(0, steps)?)?;
        Some(Return { steps, range, length: 0 })
    }

    /// Whether the return of a beam lies on another surface than the one `gap` beams before, from whose range it departs by
    /// more than `jump` (m): neither surface, continued straight, meets the other return.
    fn is_broken(&self, later: usize, gap: usize, jump: f32) -> bool {
        let Some(earlier) = self.back(later, gap) else { return true };
        // Across the seam of a moving sensor ranges jump though the surface does not; corrected points do not.
        let (Some(first), Some(second)) = (self.distance(earlier), self.distance(later)) else { return true };
        if libm::fabsf(second - first) <= jump {
            return false;
        }
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
