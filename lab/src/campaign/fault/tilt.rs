//! A laser whose plane is tilted, before surfaces that stand upright.

use agv_core::geometry::Point;
use agv_host_sim::recording::RecordedScan;

/// The plane's tilt.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tilt {
    /// Direction of S in which it looks down.
    towards: Point,
    cosine: f64,
    /// How far the laser has moved that way, m.
    shift: f64,
}

impl Tilt {
    /// A tilt about a point so far below the laser, m.
    pub(super) fn new(deg: f64, towards_deg: f64, height: f64) -> Self {
        let (sine, cosine) = libm::sincos(towards_deg.to_radians());
        let angle = deg.to_radians();
        Self { towards: Point::new(cosine, sine), cosine: libm::cos(angle), shift: height * libm::sin(angle) }
    }

    /// Where something upright is seen that a level laser sees there (S, m): the plane meets it further along its slope.
    pub(super) fn seen(&self, point: &Point) -> Point {
        let along = point.dot(&self.towards) - self.shift;
        let across = self.towards.perp(point);
        let left = Point::new(-self.towards.y, self.towards.x);
        self.towards * (along / self.cosine) + left * across
    }

    /// The scan of a tilted laser: each return goes to the beam that sees it, and of two the nearer stays.
    pub(super) fn spoil_scan(&self, scan: &mut RecordedScan) {
        let count = scan.ranges.len();
        let mut ranges = vec![0.0_f32; count];
        for (beam, range) in scan.ranges.iter().enumerate().filter(|(_, range)| **range > 0.0) {
            let (sine, cosine) = libm::sincos(scan.first_bearing + beam as f64 * scan.bearing_step);
            let seen = self.seen(&(Point::new(cosine, sine) * f64::from(*range)));
            let steps = libm::round((libm::atan2(seen.y, seen.x) - scan.first_bearing) / scan.bearing_step) as i64;
            let Some(place) = ranges.get_mut(steps.rem_euclid(count.max(1) as i64) as usize) else { continue };
            let distance = seen.norm() as f32;
            if *place <= 0.0 || distance < *place {
                *place = distance;
            }
        }
        scan.ranges = ranges;
    }
}
