//! A point of a surface with the direction in which the surface faces, as it is computed with and as it is kept.

use serde::{Deserialize, Serialize};

use crate::geometry::{ScanPoint, Transform};

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, m.
    pub position: ScanPoint,
    /// Unit normal, towards where it was seen from; zero for a corner, which has none.
    pub normal: ScanPoint,
}

impl SurfacePoint {
    /// Whether it is a corner: a point that holds in both directions.
    #[must_use]
    pub fn is_corner(&self) -> bool {
        self.normal == ScanPoint::zeros()
    }

    /// Whether both are corners, or face the same way within 32 deg.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        self.normal.dot(&other.normal) > ALIKE as f32 / (UNIT * UNIT) || (self.is_corner() && other.is_corner())
    }

    /// The point in the frame into which a transform leads.
    #[must_use]
    pub fn moved(&self, transform: &Transform) -> Self {
        Self { position: transform.apply(&self.position), normal: transform.apply(&self.normal) - transform.shift() }
    }
}

/// Counts for a metre.
const COUNTS: f32 = 1000.0;

/// Counts for the length of a normal.
const UNIT: f32 = 127.0;

/// Scalar product of two normals, in counts, of which the angle between them is 32 deg.
const ALIKE: i32 = 13_677;

/// A point in 6 bytes: millimetres, and a normal to half a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackedPoint {
    x: i16,
    y: i16,
    normal: [i8; 2],
}

impl PackedPoint {
    /// Packs a point; None if it is further than 32.7 m from its origin along an axis.
    #[must_use]
    pub fn of(point: &SurfacePoint) -> Option<Self> {
        let count = |length: f32| {
            let counts = libm::roundf(length * COUNTS);
            (libm::fabsf(counts) <= f32::from(i16::MAX)).then_some(counts as i16)
        };
        let normal = |share: f32| libm::roundf(share * UNIT) as i8;
        Some(Self {
            x: count(point.position.x)?,
            y: count(point.position.y)?,
            normal: [normal(point.normal.x), normal(point.normal.y)],
        })
    }

    /// Square of the distance from another, mm^2; large if it is large.
    #[must_use]
    #[inline]
    pub(super) fn square(&self, other: &Self) -> u32 {
        let (x, y) = (i32::from(self.x) - i32::from(other.x), i32::from(self.y) - i32::from(other.y));
        // Each is below 2^16.
        x.unsigned_abs().pow(2).saturating_add(y.unsigned_abs().pow(2))
    }

    /// Whether both are corners, or face the same way within 32 deg.
    #[must_use]
    #[inline]
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let [x, y] = self.normal.map(i32::from);
        let [other_x, other_y] = other.normal.map(i32::from);
        x * other_x + y * other_y > ALIKE || (self.normal == [0; 2] && other.normal == [0; 2])
    }

    /// The point as it is computed with.
    #[must_use]
    pub fn unpacked(&self) -> SurfacePoint {
        let length = |counts: i16| f32::from(counts) * (1.0 / COUNTS);
        let share = |counts: i8| f32::from(counts) * (1.0 / UNIT);
        SurfacePoint {
            position: ScanPoint::new(length(self.x), length(self.y)),
            normal: ScanPoint::new(share(self.normal[0]), share(self.normal[1])),
        }
    }
}
