//! How well reflectors determine a pose: the bound that no unbiased estimate of one revolution beats (Cramer and Rao).

use agv_core::geometry::Point;
use agv_core::localizer::ReflectorParameters;
use nalgebra::{Matrix2x3, Matrix3, RowVector3};

/// Standard deviation of a surveyed reflector's place along each axis, m.
const SURVEY_DEVIATION: f64 = 0.005;

/// Information along the least known direction, of that along the best known one, at which nothing is known of the former.
const LEAST_STRENGTH: f64 = 1e-9;

/// Expected standard deviations of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Determination {
    /// Of the position, along its worst axis, m.
    pub position: f64,
    /// Of the heading, rad.
    pub heading: f64,
}

/// What a revolution that sees these reflectors says of a pose at `place`: ranges and bearings with the sensor's noise,
/// and places of the reflectors as good as a survey. None if they do not determine it.
#[must_use]
pub fn determination(place: &Point, seen: &[Point], noise: &ReflectorParameters) -> Option<Determination> {
    let mut information = Matrix3::zeros();
    for reflector in seen {
        let offset = reflector - place;
        let range = offset.norm();
        if range <= 0.0 {
            continue;
        }
        // Range and bearing by x, y and heading.
        let by_range = RowVector3::new(-offset.x / range, -offset.y / range, 0.0);
        let by_bearing = RowVector3::new(offset.y / (range * range), -offset.x / (range * range), -1.0);
        let jacobian = Matrix2x3::from_rows(&[by_range, by_bearing]);
        let survey = SURVEY_DEVIATION * SURVEY_DEVIATION;
        let variances = [
            noise.range_deviation * noise.range_deviation + survey,
            noise.bearing_deviation * noise.bearing_deviation + survey / (range * range),
        ];
        for (row, variance) in jacobian.row_iter().zip(variances) {
            information += row.transpose() * row / variance;
        }
    }
    // Two numbers of one reflector do not determine three, whatever rounding leaves of the third.
    let strengths = information.symmetric_eigenvalues();
    if strengths.min() <= LEAST_STRENGTH * strengths.max() {
        return None;
    }
    let covariance = information.try_inverse().filter(|covariance| covariance.iter().all(|value| value.is_finite()))?;
    let [xx, xy, yy] = [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]];
    let worst = 0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy);
    Some(Determination { position: worst.max(0.0).sqrt(), heading: covariance[(2, 2)].max(0.0).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: ReflectorParameters =
        ReflectorParameters { range_deviation: 0.01, bearing_deviation: 0.001, detection: None };

    #[test]
    fn a_ring_of_reflectors_gives_what_its_symmetry_says() {
        for (count, radius) in [(4_u32, 5.0), (12, 20.0)] {
            let ring: Vec<Point> = (0..count)
                .map(|index| f64::from(index) / f64::from(count) * std::f64::consts::TAU)
                .map(|angle| Point::new(3.0 + radius * angle.cos(), -7.0 + radius * angle.sin()))
                .collect();
            let found = determination(&Point::new(3.0, -7.0), &ring, &NOISE).unwrap();
            let range = NOISE.range_deviation.powi(2) + SURVEY_DEVIATION.powi(2);
            let bearing = NOISE.bearing_deviation.powi(2) + (SURVEY_DEVIATION / radius).powi(2);
            // Half of the reflectors' ranges, and half of their bearings, tell of each axis; all bearings of the heading.
            let position = (2.0 / f64::from(count) / (1.0 / range + 1.0 / (radius * radius * bearing))).sqrt();
            let heading = (bearing / f64::from(count)).sqrt();
            assert!((found.position - position).abs() < 1e-9 && (found.heading - heading).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn one_reflector_determines_nothing() {
        let place = Point::new(0.0, 0.0);
        assert_eq!(determination(&place, &[], &NOISE), None);
        assert_eq!(determination(&place, &[Point::new(5.0, 0.0)], &NOISE), None);
        assert!(determination(&place, &[Point::new(5.0, 0.0), Point::new(0.0, 5.0)], &NOISE).unwrap().position < 0.02);
    }
}
