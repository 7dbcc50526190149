//! What rounding may have taken from a covariance.

use nalgebra::Matrix3;

/// A correlation, or the determinant of the correlations, may be beyond what is possible by so much: more than rounding does
/// to a sound covariance, and less than anybody notices.
const SLACK: f64 = 1e-9;

/// Mends a symmetric covariance that rounding has made indefinite, as it does where an observation is surer than the state by
/// ten orders of magnitude. One that is sound keeps its bits.
///
/// A variance below zero is known no better than rounding, and has no correlations. Correlations that cannot be true
/// together are halved, after which they can.
pub(super) fn make_positive_semidefinite(covariance: &mut Matrix3<f64>) {
    if is_sound(covariance) {
        return;
    }
    let (mut xx, mut yy, mut hh) = (covariance.m11, covariance.m22, covariance.m33);
    let (mut xy, mut xh, mut yh) = (covariance.m12, covariance.m13, covariance.m23);
    if xx < 0.0 {
        (xx, xy, xh) = (-xx, 0.0, 0.0);
    }
    if yy < 0.0 {
        (yy, xy, yh) = (-yy, 0.0, 0.0);
    }
    if hh < 0.0 {
        (hh, xh, yh) = (-hh, 0.0, 0.0);
    }
    let (x, y, h) = (libm::sqrt(xx), libm::sqrt(yy), libm::sqrt(hh));
    let within = |both: f64, most: f64| both.max(-most).min(most);
    (xy, xh, yh) = (within(xy, x * y), within(xh, x * h), within(yh, y * h));
    *covariance = Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh);
    // Of three correlations between -1 and 1 the least eigenvalue is -1 or more. With half of each it is 0 or more.
    if !is_sound(covariance) {
        (xy, xh, yh) = (0.5 * xy, 0.5 * xh, 0.5 * yh);
        *covariance = Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh);
    }
}

fn is_sound(covariance: &Matrix3<f64>) -> bool {
    let (xx, yy, hh) = (covariance.m11, covariance.m22, covariance.m33);
    let (xy, xh, yh) = (covariance.m12, covariance.m13, covariance.m23);
    let fits = |first: f64, second: f64, both: f64| both * both <= first * second * (1.0 + SLACK);
    let determinant = xx * (yy * hh - yh * yh) - xy * (xy * hh - yh * xh) + xh * (xy * yh - yy * xh);
    xx >= 0.0
        && yy >= 0.0
        && hh >= 0.0
        && fits(xx, yy, xy)
        && fits(xx, hh, xh)
        && fits(yy, hh, yh)
        && determinant >= -SLACK * (xx * yy * hh)
}
