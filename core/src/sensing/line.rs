//! Straight lines through points, and their intersection.

use crate::geometry::ScanPoint;

/// How many points the expected noise weighs in the estimate of a line's noise; sides of a corner can be as short as
/// two or three points, whose own scatter says little.
const PRIOR_WEIGHT: f32 = 8.0;

/// Sums over points, relative to a point nearby so that single precision suffices.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moments {
    pub count: f32,
    sum: ScanPoint,
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Moments {
    #[inline]
    pub(crate) fn add(&mut self, point: ScanPoint) {
        self.count += 1.0;
        self.sum += point;
        self.xx += point.x * point.x;
        self.xy += point.x * point.y;
        self.yy += point.y * point.y;
    }

    /// The line with the smallest sum of squared distances. None for fewer than two distinct points.
    pub(crate) fn line(&self) -> Option<Line> {
        if self.count < 2.0 {
            return None;
        }
        let centroid = self.sum / self.count;
        let xx = self.xx - self.sum.x * centroid.x;
        let xy = self.xy - self.sum.x * centroid.y;
        let yy = self.yy - self.sum.y * centroid.y;
        let (difference, twice) = (xx - yy, 2.0 * xy);
        let spread = libm::sqrtf(difference * difference + twice * twice);
        if spread <= 1e-9 {
            return None;
        }
        // Half of the angle whose cosine and sine these are, without trigonometry.
        let (cosine, sine) = (difference / spread, twice / spread);
        let along = if cosine >= 0.0 {
            let half = libm::sqrtf(0.5 * (1.0 + cosine));
            ScanPoint::new(half, 0.5 * sine / half)
        } else {
            let half = libm::sqrtf(0.5 * (1.0 - cosine));
            ScanPoint::new(0.5 * sine / half, half)
        };
        let trace = xx + yy;
        let across = (0.5 * (trace - spread)).max(0.0);
        Some(Line { centroid, along, count: self.count, squares: across, spread: 0.5 * (trace + spread) })
    }
}

/// A line through points, in the frame of the moments.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub centroid: ScanPoint,
    /// Unit direction.
    pub along: ScanPoint,
    pub count: f32,
    /// Sum of squared distances from the line, m^2.
    pub squares: f32,
    /// Sum of squared distances from the centroid along the line, m^2.
    pub spread: f32,
}

impl Line {
    /// Unit normal.
    pub(crate) fn normal(&self) -> ScanPoint {
        ScanPoint::new(-self.along.y, self.along.x)
    }

    /// Mean square distance of the points from the line, m^2.
    pub(crate) fn mean_square(&self) -> f32 {
        self.squares / self.count
    }

    /// Variance of one point across the line, m^2, if a range has `range_variance` along the unit vector `ray`.
    fn point_variance(&self, ray: ScanPoint, range_variance: f32) -> f32 {
        let share = self.normal().dot(&ray);
        let expected = range_variance * (share * share).max(0.01);
        (PRIOR_WEIGHT * expected + self.squares) / (PRIOR_WEIGHT + self.count - 2.0)
    }

    /// Variance across the line of its position abreast of `point`, m^2.
    pub(crate) fn variance_at(&self, point: ScanPoint, ray: ScanPoint, range_variance: f32) -> f32 {
        let lever = (point - self.centroid).dot(&self.along);
        self.point_variance(ray, range_variance) * (1.0 / self.count + lever * lever / self.spread)
    }

    /// Where two lines meet. None if they are parallel.
    pub(crate) fn intersection(&self, other: &Line) -> Option<ScanPoint> {
        let determinant = self.along.x * other.along.y - self.along.y * other.along.x;
        if libm::fabsf(determinant) < 1e-6 {
            return None;
        }
        let between = other.centroid - self.centroid;
        let share = (between.x * other.along.y - between.y * other.along.x) / determinant;
        Some(self.centroid + self.along * share)
    }
}

/// Covariance xx, xy, yy, m^2, of the intersection of two lines whose positions have the given variances across.
pub(crate) fn intersection_covariance(first: (&Line, f32), second: (&Line, f32)) -> [f32; 3] {
    let (a, b) = (first.0.along, second.0.along);
    let determinant = a.x * b.y - a.y * b.x;
    let scale = 1.0 / (determinant * determinant);
    // An error across one line moves the intersection along the other one.
    let (va, vb) = (first.1 * scale, second.1 * scale);
    [va * b.x * b.x + vb * a.x * a.x, va * b.x * b.y + vb * a.x * a.y, va * b.y * b.y + vb * a.y * a.y]
}

/// Largest eigenvalue of a covariance xx, xy, yy.
pub(crate) fn largest_variance(covariance: [f32; 3]) -> f32 {
    let [xx, xy, yy] = covariance;
    let difference = xx - yy;
    0.5 * (xx + yy + libm::sqrtf(difference * difference + 4.0 * xy * xy))
}
