//! Unbroken surfaces: where one ends, neighbourhoods end too.

use crate::geometry::ScanPoint;
use crate::sensing::PointView;

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

    /// Those of the first `count` beams.
    pub(super) fn lengths(&self, count: usize) -> Lengths<'_> {
        // No scan has more beams than there is room for.
        Lengths {
            before: self.before.get(..count).unwrap_or_default(),
            after: self.after.get(..count).unwrap_or_default(),
        }
    }

    /// No surface ends but where the field of view does.
    pub(super) fn set_unbroken(&mut self, count: usize, crosses_seam: bool) {
        let most = count.saturating_sub(1);
        let lengths = self.before.iter_mut().zip(&mut self.after).take(count);
        for (index, (before, after)) in lengths.enumerate() {
            // No scan has more beams than that.
            let (earlier, later) = if crosses_seam { (most, most) } else { (index, most - index) };
            (*before, *after) = (earlier as u16, later as u16);
        }
    }

    /// Finds the surfaces of a scan; a surface ends where the range departs from it by more than `jump` (m).
    pub(super) fn find(&mut self, scan: &PointView<'_>, crosses_seam: bool, jump: f32) {
        let beams = Beams { ranges: scan.ranges, points: scan.points, crosses_seam };
        let count = beams.ranges.len();
        // No scan has more beams than there is room for.
        let (Some(before), Some(after)) = (self.before.get_mut(..count), self.after.get_mut(..count)) else { return };
        before.fill(0);
        after.fill(0);
        let is_return = |range: &f32| *range > 0.0;
        let Some(head) = beams.ranges.iter().position(is_return) else { return };
        let mut last = (head, beams.ranges.get(head).copied().unwrap_or_default());
        let (mut first, head) = (head, last);
        for (index, &range) in beams.ranges.iter().enumerate() {
            if is_return(&range) {
                if !beams.is_linked(index.wrapping_sub(last.0), last.1, (index, range), jump) {
                    set(before, after, beams.ranges, (first, last.0), (0, 0));
                    first = index;
                }
                last = (index, range);
            }
        }
        let whole = count.saturating_sub(1);
        let (last, last_range) = last;
        let steps = count + head.0 - last;
        if !crosses_seam || !beams.is_linked(steps, last_range, head, jump) {
            set(before, after, beams.ranges, (first, last), (0, 0));
        } else if first == head.0 {
            set(before, after, beams.ranges, (first, last), (whole, whole));
        } else {
            // The last surface and the first one are one.
            let end = head.0 + after.get(head.0).copied().map_or(0, usize::from);
            set(before, after, beams.ranges, (head.0, end), (count + head.0 - first, 0));
            set(before, after, beams.ranges, (first, last), (0, count + end - last));
        }
    }
}

/// Sets how far the surface of the returns from beam `first` to `last` goes on, if there are `lead` beams of it before them and
/// `trail` after them.
#[inline]
fn set(
    before: &mut [u16],
    after: &mut [u16],
    ranges: &[f32],
    (first, last): (usize, usize),
    (lead, trail): (usize, usize),
) {
    let most = ranges.len().saturating_sub(1) as u32;
    let beams = first..last + 1;
    let (Some(before), Some(after)) = (before.get_mut(beams.clone()), after.get_mut(beams.clone())) else { return };
    let ranges = ranges.get(beams).unwrap_or_default();
    // No scan has more beams than these numbers count.
    let (mut passed, mut left) = (lead as u32, (trail + last - first) as u32);
    for ((before, after), range) in before.iter_mut().zip(after).zip(ranges) {
        let is_return = *range > 0.0;
        *before = if is_return { passed.min(most) as u16 } else { 0 };
        *after = if is_return { left.min(most) as u16 } else { 0 };
        (passed, left) = (passed.wrapping_add(1), left.wrapping_sub(1));
    }
}

/// How far the surface of each beam of a scan goes on without a break.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths<'a> {
    /// Beams before each beam on its surface.
    pub before: &'a [u16],
    /// Beams after each beam on its surface.
    pub after: &'a [u16],
}

/// Ranges by beam, around the circle or not.
#[derive(Clone, Copy, Debug)]
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

    /// Whether a return lies on the same surface as the last one before it, so many beams earlier, with that range (m).
    #[inline]
    fn is_linked(&self, steps: usize, last: f32, (index, range): (usize, f32), jump: f32) -> bool {
        steps <= BRIDGED + 1 && (libm::fabsf(range - last) <= jump || !self.is_broken(index, steps, jump))
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
