//! The arctangent as a polynomial: every point of a scan needs it several times, and a library's takes ten times as long.

use core::f32::consts::{FRAC_PI_2, PI, TAU};

/// Coefficients of odd powers from the third on (Abramowitz and Stegun 4.4.49): right to 2e-8 between -1 and 1.
const COEFFICIENTS: [f32; 8] = [
    -0.333_331_45,
    0.199_935_51,
    -0.142_089,
    0.106_562_64,
    -0.075_289_64,
    0.042_909_614,
    -0.016_165_737,
    0.002_866_225_7,
];

/// The bit that says that a number is negative.
const SIGN: u32 = 1 << 31;

/// The angle of a direction against the x axis, rad, -pi to pi, right to 5e-7; 0 of none.
#[inline(always)]
pub(super) fn arctangent(y: f32, x: f32) -> f32 {
    let (across, along) = (libm::fabsf(y), libm::fabsf(x));
    let (less, more) = if across < along { (across, along) } else { (along, across) };
    let ratio = if more > 0.0 { less / more } else { 0.0 };
    let square = ratio * ratio;
    let series = COEFFICIENTS.iter().rev().fold(0.0, |sum, coefficient| (sum + coefficient) * square);
    let angle = ratio + ratio * series;
    let angle = if across < along { angle } else { FRAC_PI_2 - angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    // It is not negative yet: it takes the sign. A library's function for that would be called for each point.
    if more == 0.0 { 0.0 } else { f32::from_bits(angle.to_bits() | y.to_bits() & SIGN) }
}

/// Which part of a turn a direction is counter-clockwise from straight ahead, 0 to 1.
#[inline(always)]
pub(super) fn turn(y: f32, x: f32) -> f32 {
    let turn = arctangent(y, x) / TAU;
    if turn < 0.0 { turn + 1.0 } else { turn }
}

/// In which of so many sectors a part of a turn lies.
#[inline(always)]
pub(super) fn sector_of(turn: f32, sectors: usize) -> usize {
    ((turn * sectors as f32) as usize).min(sectors.saturating_sub(1))
}

/// In which of so many sectors a direction lies, counter-clockwise from straight ahead.
#[cfg(any(test, feature = "std"))]
pub(super) fn sector(y: f32, x: f32, sectors: usize) -> usize {
    sector_of(turn(y, x), sectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arctangent_is_that_of_the_library() {
        let lengths = [1e-6_f32, 0.3, 80.0, 1e6];
        for (number, length) in (0..40_000).flat_map(|number| lengths.map(|length| (number, length))) {
            let angle = (f64::from(number) * 1e-4 - 2.0) * core::f64::consts::PI;
            let (y, x) = ((angle.sin() * f64::from(length)) as f32, (angle.cos() * f64::from(length)) as f32);
            let expected = f64::from(y).atan2(f64::from(x));
            assert!((f64::from(arctangent(y, x)) - expected).abs() < 5e-7, "{y} {x}");
        }
        assert_eq!(arctangent(0.0, 0.0), 0.0);
        assert_eq!(arctangent(0.0, -1.0), PI);
        assert_eq!([arctangent(1.0, 0.0), arctangent(-1.0, 0.0)], [FRAC_PI_2, -FRAC_PI_2]);
        assert_eq!(sector(-1e-12, 1.0, 60), 59);
    }
}
