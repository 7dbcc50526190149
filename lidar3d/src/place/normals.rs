//! Surface normals from the neighbours in the rings (M 5.1.2.2).

use crate::cloud::Cloud;

/// Which neighbours of a point span its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    /// Angle to the left and right neighbours, rad. M takes five columns of an HDL-64E at 5 Hz, 0.45 degrees; with fewer
    /// columns the nearest whole number of them, at least one, is taken.
    pub angle: f32,
    /// Rings to the upper and lower neighbours: two on an HDL-64E, whose two sides alternate.
    pub rings: usize,
    /// Greatest distance to a neighbour, m.
    pub reach: f32,
    /// Least distance from the sensor, m.
    pub near: f32,
    /// Greatest distance from the sensor, m.
    pub far: f32,
}

/// Rings, least and greatest distance are M's. M states no reach, and an angle for columns of 0.09 degrees; both are
/// those with the greatest recall at full precision among 70 pairs when one half of the map of the Moosmann route (its key
/// scans of the first 150 m) is asked about the other: no query of that route was looked at.
impl Default for Neighbours {
    fn default() -> Self {
        Self { angle: 1.24_f32.to_radians(), rings: 2, reach: 2.0, near: 3.0, far: 50.0 }
    }
}

impl Neighbours {
    /// Columns to the left and right neighbours, of so many in a turn.
    pub(super) fn columns(&self, columns: usize) -> usize {
        libm::roundf(self.angle * columns as f32 / core::f32::consts::TAU).max(1.0) as usize
    }

    /// Whether a point is neither too near nor too far.
    pub(super) fn takes(&self, point: &[f32; 3]) -> bool {
        let squared = dot(*point, *point);
        squared >= self.near * self.near && squared <= self.far * self.far
    }
}

/// Calls `take` with the vertical part of each normal, -1 to 1.
pub fn vertical_parts(cloud: &Cloud<'_>, neighbours: &Neighbours, mut take: impl FnMut(f32)) {
    surfaces(cloud, neighbours, |_, [_, _, vertical]| take(vertical));
}

/// Calls `take` with each point, m, and its normal, of length one; all normals of a surface point to the same side of it.
pub fn surfaces(cloud: &Cloud<'_>, neighbours: &Neighbours, mut take: impl FnMut([f32; 3], [f32; 3])) {
    let columns = cloud.columns();
    let step = neighbours.columns(columns);
    if step >= columns {
        return;
    }
    for ring in neighbours.rings..cloud.rings().saturating_sub(neighbours.rings) {
        let (above, here, below) =
            (cloud.ring(ring - neighbours.rings), cloud.ring(ring), cloud.ring(ring + neighbours.rings));
        for (column, (point, (up, down))) in here.iter().zip(above.iter().zip(below)).enumerate() {
            let (Some(point), Some(up), Some(down)) = (point, up, down) else { continue };
            if !neighbours.takes(point) {
                continue;
            }
            let left = if column < step { column + columns - step } else { column - step };
            let right = if column + step >= columns { column + step - columns } else { column + step };
            let (Some(Some(left)), Some(Some(right))) = (here.get(left), here.get(right)) else { continue };
            let [right, up, left, down] = [right, up, left, down].map(|end| minus(*end, *point));
            if [right, up, left, down].iter().any(|arm| dot(*arm, *arm) > neighbours.reach * neighbours.reach) {
                continue;
            }
            let mut sum = [0.0; 3];
            for (one, other) in [(right, up), (up, left), (left, down), (down, right)] {
                let normal = cross(one, other);
                let length = libm::sqrtf(dot(normal, normal));
                if length > 0.0 {
                    sum = [sum[0] + normal[0] / length, sum[1] + normal[1] / length, sum[2] + normal[2] / length];
                }
            }
            let length = libm::sqrtf(dot(sum, sum));
            if length > 0.0 {
                take(*point, sum.map(|value| value / length));
            }
        }
    }
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
