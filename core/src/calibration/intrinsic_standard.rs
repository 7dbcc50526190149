//! One steering offset for both senses of travel (K 2.2.1).

use super::intrinsic::{Intrinsic, Normal, Offsets};
use super::observability::Unobservable;
use super::segment::Segment;

/// Offset and turn scale by linear least squares over the rotations (K 2.10 to 2.15, with sums over samples).
///
/// # Errors
/// [`Unobservable`], see K proposition 2.4.1.
pub fn intrinsic_standard(segments: &[Segment]) -> Result<Intrinsic, Unobservable> {
    let sums = Normal::of(segments.iter());
    if sums.count == 0 {
        return Err(Unobservable::TooFewSegments);
    }
    sums.check(Unobservable::OneSteeringAngle)?;
    let determinant = sums.sine_sine * sums.cosine_cosine - sums.sine_cosine * sums.sine_cosine;
    // K 2.13.
    let first = (sums.cosine_cosine * sums.sine_rotation - sums.sine_cosine * sums.cosine_rotation) / determinant;
    let second = (sums.sine_sine * sums.cosine_rotation - sums.sine_cosine * sums.sine_rotation) / determinant;
    let offset = libm::atan2(second, first);
    Intrinsic::with_residuals(segments, Offsets::Common, [offset, offset, libm::hypot(first, second)])
}
