//! The direction in which the surface around a point faces (geometrical surface relations, GSR, as K 4.1.1 describes it).

use agv_core::geometry::ScanPoint;
use agv_core::sensing::PointScan;

/// Normal of the surface around `position` (m): the direction in which the points within `radius` (m) spread least, towards
/// the sensor, rad. None for fewer than three points.
#[must_use]
pub fn surface_normal<const BEAMS: usize>(scan: &PointScan<BEAMS>, position: ScanPoint, radius: f32) -> Option<f32> {
    let (mut count, mut sum, mut xx, mut xy, mut yy) = (0.0_f32, ScanPoint::zeros(), 0.0, 0.0, 0.0);
    for (point, range) in scan.points.iter().zip(&scan.ranges) {
        let relative = point - position;
        if *range > 0.0 && relative.norm_squared() <= radius * radius {
            count += 1.0;
            sum += relative;
            xx += relative.x * relative.x;
            xy += relative.x * relative.y;
            yy += relative.y * relative.y;
        }
    }
    if count < 3.0 {
        return None;
    }
    let mean = sum / count;
    let along = 0.5 * libm::atan2f(2.0 * (xy - sum.x * mean.y), (xx - sum.x * mean.x) - (yy - sum.y * mean.y));
    let (sine, cosine) = libm::sincosf(along);
    let normal = ScanPoint::new(-sine, cosine);
    let normal = if normal.dot(&position) > 0.0 { -normal } else { normal };
    Some(libm::atan2f(normal.y, normal.x))
}
