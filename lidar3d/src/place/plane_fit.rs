//! Surface normals from planes through the neighbours (M 5.1.2.1).
//!
//! Slower than the neighbours in the rings alone, and less disturbed by the noise of a single return.

use super::normals::Neighbours;
use crate::cloud::Cloud;

/// Points that a plane is fitted to, at least.
const LEAST_POINTS: u16 = 5;
/// Greatest share of the least eigenvalue in the sum of all: more is no surface.
const LARGEST_ROUGHNESS: f32 = 0.1;

/// Calls `take` with each point, m, and the normal of the plane through all returns within the angle, the rings and the
/// reach of its neighbours; it has length one and faces the sensor.
pub fn fitted_surfaces(cloud: &Cloud<'_>, neighbours: &Neighbours, mut take: impl FnMut([f32; 3], [f32; 3])) {
    let columns = cloud.columns();
    let step = neighbours.columns(columns);
    if 2 * step >= columns {
        return;
    }
    for ring in neighbours.rings..cloud.rings().saturating_sub(neighbours.rings) {
        for (column, point) in cloud.ring(ring).iter().enumerate() {
            let Some(point) = point.filter(|point| neighbours.takes(point)) else { continue };
            let mut moments = Moments::default();
            for near in ring - neighbours.rings..=ring + neighbours.rings {
                let around = cloud.ring(near).iter().cycle().skip(column + columns - step).take(2 * step + 1);
                for other in around.flatten() {
                    let arm = [other[0] - point[0], other[1] - point[1], other[2] - point[2]];
                    if squared(arm) <= neighbours.reach * neighbours.reach {
                        moments.add(arm);
                    }
                }
            }
            let Some(normal) = moments.normal() else { continue };
            let away = normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] > 0.0;
            take(point, if away { normal.map(|value| -value) } else { normal });
        }
    }
}

fn squared([x, y, z]: [f32; 3]) -> f32 {
    x * x + y * y + z * z
}

/// Sums over points, seen from the one in the middle, so that they are small.
#[derive(Default)]
struct Moments {
    count: u16,
    sum: [f32; 3],
    /// xx, xy, xz, yy, yz, zz.
    products: [f32; 6],
}

impl Moments {
    fn add(&mut self, [x, y, z]: [f32; 3]) {
        self.count = self.count.saturating_add(1);
        self.sum = [self.sum[0] + x, self.sum[1] + y, self.sum[2] + z];
        let [xx, xy, xz, yy, yz, zz] = self.products;
        self.products = [xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z];
    }

    /// The direction of the least spread: the eigenvector of the covariance with the least eigenvalue. None if the points
    /// are few, in a line, or no surface.
    fn normal(&self) -> Option<[f32; 3]> {
        if self.count < LEAST_POINTS {
            return None;
        }
        let count = f32::from(self.count);
        let [x, y, z] = self.sum.map(|sum| sum / count);
        let [xx, xy, xz, yy, yz, zz] = self.products.map(|product| product / count);
        let spread = [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z];
        let least = least_eigenvalue(&spread);
        let trace = spread[0] + spread[3] + spread[5];
        if least.is_nan() || least > LARGEST_ROUGHNESS * trace {
            return None;
        }
        let [xx, xy, xz, yy, yz, zz] = spread;
        let rows = [[xx - least, xy, xz], [xy, yy - least, yz], [xz, yz, zz - least]];
        // Any two rows span the plane; the two that differ most do it best.
        let crosses = [cross(rows[0], rows[1]), cross(rows[1], rows[2]), cross(rows[2], rows[0])];
        let normal = crosses.into_iter().max_by(|one, other| squared(*one).total_cmp(&squared(*other)))?;
        let length = libm::sqrtf(squared(normal));
        (length > f32::EPSILON * trace * trace).then(|| normal.map(|value| value / length))
    }
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The least eigenvalue of a symmetric matrix, by the trigonometric solution of its cubic (Smith 1961).
fn least_eigenvalue([xx, xy, xz, yy, yz, zz]: &[f32; 6]) -> f32 {
    let mean = (xx + yy + zz) / 3.0;
    let (x, y, z) = (xx - mean, yy - mean, zz - mean);
    let off = xy * xy + xz * xz + yz * yz;
    let scale = libm::sqrtf((x * x + y * y + z * z + 2.0 * off) / 6.0);
    if scale <= 0.0 {
        return mean;
    }
    let determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
    let cosine = (determinant / (2.0 * scale * scale * scale)).clamp(-1.0, 1.0);
    mean + 2.0 * scale * libm::cosf(libm::acosf(cosine) / 3.0 + 2.0 * core::f32::consts::FRAC_PI_3)
}
