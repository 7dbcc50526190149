//! Lengths and axes of two numbers.

/// Length of a vector of everyday size; the hypotenuse that cannot overflow costs several times as much.
pub fn length(x: f64, y: f64) -> f64 {
    libm::sqrt(x * x + y * y)
}

/// Variance along the larger axis of the covariance of two numbers.
pub fn larger_axis(xx: f64, xy: f64, yy: f64) -> f64 {
    0.5 * (xx + yy) + length(0.5 * (xx - yy), xy)
}
