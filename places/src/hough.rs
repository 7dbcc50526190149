//! Association of keypoints by votes for the transform between two scans (affine Hough transform, K 4.1.3).

use super::correspondence::{Correspondence, align_correspondences};
use agv_core::geometry::{Point, Pose, RigidFit, ScanPoint};
use agv_core::sensing::Keypoint;

/// Cells along each axis of the plane.
const CELLS: usize = 100;

/// The space of transforms that is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoughParameters {
    /// Size of a cell along each axis, m (K 4.2.2: 0.1); with 100 cells the space reaches 50 cells to each side.
    pub cell: f32,
    /// Step of the rotation, rad (K 4.2.2: 0.04).
    pub rotation_step: f32,
    /// Largest rotation to each side, rad (K 4.2.2: a quarter turn).
    pub largest_rotation: f32,
}

impl Default for HoughParameters {
    fn default() -> Self {
        Self { cell: 0.1, rotation_step: 0.04, largest_rotation: core::f32::consts::FRAC_PI_2 }
    }
}

/// Memory of the search: one slice of the space. The printed space of three dimensions is looked at one rotation after
/// another, which gives the same votes from 10 kB.
#[derive(Clone, Debug)]
pub struct AffineHough {
    votes: [u8; CELLS * CELLS],
}

impl Default for AffineHough {
    fn default() -> Self {
        Self { votes: [0; CELLS * CELLS] }
    }
}

/// Most rotations that are tried to each side.
const MOST_ROTATIONS: i16 = 512;

impl AffineHough {
    /// Finds the cell with the most pairs of keypoints, and fits the pose of the source in the target to them. None
    /// if no cell has two pairs. Of each scan the first 256 keypoints take part: a [`Correspondence`] numbers no more.
    pub fn associate(
        &mut self,
        source: &[Keypoint],
        target: &[Keypoint],
        parameters: &HoughParameters,
    ) -> Option<RigidFit> {
        let rotations = ((parameters.largest_rotation / parameters.rotation_step) as i16).clamp(0, MOST_ROTATIONS);
        let (mut most, mut winner) = (1, None);
        for rotation in -rotations..=rotations {
            self.votes.fill(0);
            each_vote(source, target, parameters, rotation, |_, cell| {
                if let Some(votes) = self.votes.get_mut(cell) {
                    *votes = votes.saturating_add(1);
                    if *votes > most {
                        most = *votes;
                        winner = Some((rotation, cell));
                    }
                }
            });
        }
        let (rotation, winner) = winner?;
        let mut pairs = heapless::Vec::<Correspondence, 64>::new();
        each_vote(source, target, parameters, rotation, |pair, cell| {
            if cell == winner {
                let _ = pairs.push(pair);
            }
        });
        // Pairs of one cell agree to half a cell around the rotation of its slice; the fit may do better but never worse.
        let alignment = align_correspondences(source, target, pairs.iter().copied())?;
        let theta = f64::from(rotation) * f64::from(parameters.rotation_step);
        let turned = agv_core::geometry::difference(alignment.pose.theta, theta);
        if libm::fabs(turned) <= 0.5 {
            return Some(alignment);
        }
        let centre = |index: usize| f64::from((index as f32 + 0.5 - 0.5 * CELLS as f32) * parameters.cell);
        let position = Point::new(centre(winner % CELLS), centre(winner / CELLS));
        Some(RigidFit { pose: Pose::new(position.x, position.y, theta), ..alignment })
    }
}

/// Calls `vote` with each pair of keypoints and the cell (4.4) it votes for at this rotation.
fn each_vote(
    source: &[Keypoint],
    target: &[Keypoint],
    parameters: &HoughParameters,
    rotation: i16,
    mut vote: impl FnMut(Correspondence, usize),
) {
    let (sine, cosine) = libm::sincosf(f32::from(rotation) * parameters.rotation_step);
    let per_metre = 1.0 / parameters.cell;
    for (from, keypoint) in (0..=u8::MAX).zip(source) {
        let point = keypoint.position;
        let turned = ScanPoint::new(cosine * point.x - sine * point.y, sine * point.x + cosine * point.y);
        for (to, other) in (0..=u8::MAX).zip(target) {
            let shift = (other.position - turned) * per_metre + ScanPoint::repeat(0.5 * CELLS as f32);
            let is_inside = |value: f32| value >= 0.0 && value < CELLS as f32;
            if is_inside(shift.x) && is_inside(shift.y) {
                let cell = shift.y as usize * CELLS + shift.x as usize;
                vote(Correspondence { source: from, target: to }, cell);
            }
        }
    }
}
