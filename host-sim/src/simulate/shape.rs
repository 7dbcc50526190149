//! Shapes in the plane of the laser.

use agv_core::geometry::{Point, Pose};

/// A straight piece of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// One end in W, m.
    pub from: Point,
    /// The other end in W, m.
    pub to: Point,
}

/// A round solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Centre in W, m.
    pub centre: Point,
    /// Radius, m.
    pub radius: f64,
}

/// A box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Centre and orientation in W.
    pub pose: Pose,
    /// Extent along the box's first axis, m.
    pub length: f64,
    /// Extent along the box's second axis, m.
    pub width: f64,
}

/// A loaded pallet: a box whose four faces consist of three boards each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pallet {
    /// The box without the boards' offsets.
    pub outline: Rectangle,
    /// How far each board stands out of the outline, m; faces counter-clockwise from the one on the side of the
    /// negative second axis, boards counter-clockwise in each face.
    pub boards: [[f64; 3]; 4],
}

/// The directions from which a flat reflector can be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sector {
    /// Middle of the sector, seen from the reflector in W, rad.
    pub middle: f64,
    /// Half of the sector's width, rad.
    pub half_width: f64,
}

/// An upright cylinder that is wrapped in reflecting foil. It is a solid like any other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// Axis and radius of the cylinder.
    pub body: Circle,
    /// The foil can be detected up to this distance, m.
    pub farthest: f64,
    /// From where the foil can be seen; None for a foil all around.
    pub sector: Option<Sector>,
}

impl Reflector {
    /// Whether the foil is turned to the point `from` (W, m). Says nothing about what stands between.
    #[must_use]
    pub fn faces(&self, from: &Point) -> bool {
        self.sector.is_none_or(|sector| {
            let direction = from - self.body.centre;
            let off = agv_core::geometry::difference(libm::atan2(direction.y, direction.x), sector.middle);
            off.abs() <= sector.half_width
        })
    }

    /// Cosine of the angle between its normal and the ray from `from` (W, m): a flat foil looks to the middle of its sector, one on a
    /// cylinder to wherever it is seen from.
    #[must_use]
    pub fn cosine_of_incidence(&self, from: &Point) -> f64 {
        let direction = from - self.body.centre;
        self.sector.map_or(1.0, |sector| libm::cos(libm::atan2(direction.y, direction.x) - sector.middle))
    }
}

impl Rectangle {
    /// The corners in W, m, counter-clockwise from the one with both coordinates negative.
    #[must_use]
    pub fn corners(&self) -> [Point; 4] {
        let (half_length, half_width) = (0.5 * self.length, 0.5 * self.width);
        [(-half_length, -half_width), (half_length, -half_width), (half_length, half_width), (-half_length, half_width)]
            .map(|(x, y)| self.pose.transform(&Point::new(x, y)))
    }
}

/// A face starts at a corner and has two joints of two points each.
pub(super) const POINTS_A_FACE: usize = 5;

impl Pallet {
    /// The outline with its boards, in W, m, counter-clockwise; every fifth point is a corner.
    #[must_use]
    pub fn polygon(&self) -> [Point; 4 * POINTS_A_FACE] {
        let halves = [0.5 * self.outline.length, 0.5 * self.outline.width];
        let mut points = [Point::zeros(); 4 * POINTS_A_FACE];
        for face in 0..4 {
            // Along the face runs `along`, out of the pallet points `out`; both are axes of the pallet.
            let (sine, cosine) = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][face];
            let (along, out) = (Point::new(cosine, sine), Point::new(sine, -cosine));
            let (half_run, half_depth) = (halves[face % 2], halves[(face + 1) % 2]);
            let boards = self.boards[face];
            let before = self.boards[(face + 3) % 4][2];
            let local = [
                (-half_run - before, boards[0]),
                (-half_run / 3.0, boards[0]),
                (-half_run / 3.0, boards[1]),
                (half_run / 3.0, boards[1]),
                (half_run / 3.0, boards[2]),
            ];
            for (index, (run, offset)) in local.into_iter().enumerate() {
                let point = along * run + out * (half_depth + offset);
                points[face * POINTS_A_FACE + index] = self.outline.pose.transform(&point);
            }
        }
        points
    }
}
