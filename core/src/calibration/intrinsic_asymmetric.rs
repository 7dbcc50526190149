//! A steering offset for each sense of travel with one drive scale (K 2.2.2).

use super::intrinsic::{Intrinsic, Normal, Offsets};
use super::observability::Unobservable;
use super::segment::Segment;

/// Halvings of the multiplier's interval: enough for the last bit of any start.
const HALVINGS: usize = 1100;

/// One sense of travel in the axes in which its normal equations are diagonal (K 2.23).
struct Diagonal {
    /// Direction of the first axis.
    sine: f64,
    cosine: f64,
    /// Eigenvalues (K: d).
    values: [f64; 2],
    /// Right side in these axes (K: minus c).
    right: [f64; 2],
}

impl Diagonal {
    fn of(sums: &Normal) -> Self {
        let direction = 0.5 * libm::atan2(2.0 * sums.sine_cosine, sums.sine_sine - sums.cosine_cosine);
        let (sine, cosine) = libm::sincos(direction);
        let (greater, smaller) = sums.eigenvalues();
        Self {
            sine,
            cosine,
            values: [greater, smaller],
            right: [
                cosine * sums.sine_rotation + sine * sums.cosine_rotation,
                cosine * sums.cosine_rotation - sine * sums.sine_rotation,
            ],
        }
    }

    /// The solution for a shift of the eigenvalues (K 2.24), in these axes.
    fn shifted(&self, shift: f64) -> [f64; 2] {
        let [greater, smaller] = self.values;
        let [first, second] = self.right;
        [first / (greater + shift), second / (smaller + shift)]
    }

    fn square(&self, shift: f64) -> f64 {
        let [first, second] = self.shifted(shift);
        first * first + second * second
    }

    /// The solution in the axes of K 2.16: scale times cosine and sine of the offset.
    fn solution(&self, shift: f64) -> (f64, f64) {
        let [first, second] = self.shifted(shift);
        (self.cosine * first - self.sine * second, self.sine * first + self.cosine * second)
    }
}

/// Both offsets and the turn scale by least squares over the rotations, under the constraint of one drive scale
/// (K 2.16 to 2.27, with alpha_B = atan2(psi_4, psi_3)). The multiplier is searched by halving, which never leaves its
/// interval (K 2.25).
///
/// # Errors
/// [`Unobservable`], see K proposition 2.4.2: without it the interval may be empty.
pub fn intrinsic_asymmetric(segments: &[Segment]) -> Result<Intrinsic, Unobservable> {
    if segments.is_empty() {
        return Err(Unobservable::TooFewSegments);
    }
    let forward = Normal::of(segments.iter().filter(|segment| !segment.is_backward()));
    let backward = Normal::of(segments.iter().filter(|segment| segment.is_backward()));
    forward.check(Unobservable::OneSteeringAngleForward)?;
    backward.check(Unobservable::OneSteeringAngleBackward)?;
    let (forward, backward) = (Diagonal::of(&forward), Diagonal::of(&backward));
    let multiplier = multiplier(&forward, &backward).ok_or(Unobservable::NoCommonScale)?;
    let (first, second) = forward.solution(multiplier);
    let (third, fourth) = backward.solution(-multiplier);
    let scale = 0.5 * (libm::hypot(first, second) + libm::hypot(third, fourth));
    let parameters = [libm::atan2(second, first), libm::atan2(fourth, third), scale];
    Intrinsic::with_residuals(segments, Offsets::ForEachSense, parameters)
}

/// The root of the constraint inside the interval (K 2.25), where it falls monotonically. None if it has no root there.
fn multiplier(forward: &Diagonal, backward: &Diagonal) -> Option<f64> {
    let constraint = |multiplier: f64| forward.square(multiplier) - backward.square(-multiplier);
    let [_, lowest] = forward.values;
    let [_, highest] = backward.values;
    let (mut low, mut high) = (-lowest, highest);
    // Zero is inside; around it numbers are dense, so a root near it is found to its own last bit.
    let at_zero = constraint(0.0);
    if at_zero > 0.0 {
        low = 0.0;
    } else if at_zero < 0.0 {
        high = 0.0;
    } else {
        return (at_zero == 0.0).then_some(0.0);
    }
    let is_inside = |multiplier: f64| multiplier > -lowest && multiplier < highest;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if constraint(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let root = 0.5 * (low + high);
    let scale = forward.square(root) + backward.square(-root);
    let is_root = libm::fabs(constraint(root)) <= 1e-6 * scale;
    (is_inside(root) && is_root).then_some(root)
}
