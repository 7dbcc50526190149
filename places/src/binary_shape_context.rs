//! Binary shape context: which cells of a polar grid around a keypoint hold a point (BSC, K 3.2.1).

use agv_core::geometry::ScanPoint;
use agv_core::sensing::falko::Sectors;
use agv_core::sensing::{Keypoint, PointScan, visit_around};

/// Which of the 8 x 16 cells around a keypoint hold a point (K 3.11).
///
/// Cells are counted from the corner's own orientation (K 3.2.3), before they are quantised: turning the scan leaves the
/// descriptor as it is, where shifting a finished grid would lose up to half a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BinaryShapeContext(u128);

impl BinaryShapeContext {
    /// Rings of the grid, r_n.
    pub const RINGS: u8 = 8;
    /// Sectors of the grid, alpha_n.
    pub const SECTORS: u8 = 16;
    /// Number of cells.
    pub const CELLS: u32 = Self::RINGS as u32 * Self::SECTORS as u32;

    /// Describes the surroundings of a keypoint of `scan` within `radius` (m) of its beam's return. `sectors` has
    /// [`Self::SECTORS`] sectors; surplus ones are not looked at.
    #[must_use]
    pub fn describe<const BEAMS: usize>(
        scan: &PointScan<BEAMS>,
        keypoint: &Keypoint,
        radius: f32,
        sectors: &Sectors,
    ) -> Self {
        let (sine, cosine) = libm::sincosf(keypoint.orientation);
        let origin = sectors.origin(ScanPoint::new(cosine, sine));
        let scale = f32::from(Self::RINGS) / radius;
        let mut cells = 0_u128;
        visit_around(scan, usize::from(keypoint.beam), radius, |relative| {
            // A point on the rim belongs to the last ring.
            let ring = ((relative.norm() * scale) as u32).min(u32::from(Self::RINGS) - 1);
            let sector = sectors.index(origin, relative) as u32 % u32::from(Self::SECTORS);
            cells |= 1 << (ring * u32::from(Self::SECTORS) + sector);
        });
        Self(cells)
    }

    /// Whether a cell holds a point; cells count ring by ring from the inside.
    #[must_use]
    pub fn is_occupied(&self, ring: u8, sector: u8) -> bool {
        let cell = u32::from(ring) * u32::from(Self::SECTORS) + u32::from(sector);
        cell < Self::CELLS && self.0 >> cell & 1 == 1
    }

    /// Number of cells in which two descriptors differ (K 3.12).
    #[must_use]
    pub fn distance(&self, other: &Self) -> u32 {
        (self.0 ^ other.0).count_ones()
    }
}
