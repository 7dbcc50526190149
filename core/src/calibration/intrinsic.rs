//! Steering offsets and drive scale, with their uncertainty.

use nalgebra::{Matrix3, Vector3};

use super::observability::{SMALLEST_STEERING_DEVIATION, SMALLEST_WAY, Unobservable};
use super::segment::Segment;

/// How many steering offsets the vehicle has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offsets {
    /// One: the standard calibration (K 2.2.1).
    Common,
    /// One for each sense of travel: the asymmetric calibration (K 2.2.2).
    ForEachSense,
}

/// Intrinsic parameters. The rotations give the drive scale only as its quotient by the wheelbase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsic {
    /// How many offsets were solved for.
    pub offsets: Offsets,
    /// Steering offset forward, rad (K: alpha_F).
    pub offset_forward: f64,
    /// Steering offset backward, rad (K: alpha_B).
    pub offset_backward: f64,
    /// Drive scale by wheelbase, rad for a tick (K: s_w / L).
    pub turn_scale: f64,
    /// Covariance of the three above, from the residuals.
    pub covariance: Matrix3<f64>,
    /// Standard deviation of the rotations' residuals, rad.
    pub rotation_deviation: f64,
}

impl Intrinsic {
    /// The offset that counts in a segment, rad.
    #[must_use]
    pub fn offset(&self, is_backward: bool) -> f64 {
        if is_backward { self.offset_backward } else { self.offset_forward }
    }

    /// Standard deviations: offset forward (rad), offset backward (rad), turn scale (rad for a tick).
    #[must_use]
    pub fn deviations(&self) -> Vector3<f64> {
        self.covariance.diagonal().map(|variance| libm::sqrt(variance.max(0.0)))
    }

    /// Rotation that the laser has seen minus the one that the encoders claim, rad.
    #[must_use]
    pub fn residual(&self, segment: &Segment) -> f64 {
        segment.rotation - segment.turned(self.offset(segment.is_backward()), self.turn_scale)
    }

    /// The parameters with the covariance that their residuals imply.
    pub(super) fn with_residuals(
        segments: &[Segment],
        offsets: Offsets,
        [offset_forward, offset_backward, turn_scale]: [f64; 3],
    ) -> Result<Self, Unobservable> {
        let mut intrinsic = Self {
            offsets,
            offset_forward,
            offset_backward,
            turn_scale,
            covariance: Matrix3::zeros(),
            rotation_deviation: 0.0,
        };
        let mut information = Matrix3::zeros();
        let mut squares = 0.0;
        for segment in segments {
            let is_backward = segment.is_backward();
            let (sine, cosine) = libm::sincos(intrinsic.offset(is_backward));
            let by_offset = turn_scale * (segment.cosine * cosine - segment.sine * sine);
            let by_scale = segment.sine * cosine + segment.cosine * sine;
            // The turn scale in units of itself, or the matrix would be badly scaled.
            let by_scale = by_scale * turn_scale;
            let gradient = match (offsets, is_backward) {
                (Offsets::Common, _) => Vector3::new(by_offset, 0.0, by_scale),
                (Offsets::ForEachSense, false) => Vector3::new(by_offset, 0.0, by_scale),
                (Offsets::ForEachSense, true) => Vector3::new(0.0, by_offset, by_scale),
            };
            information += gradient * gradient.transpose();
            let residual = intrinsic.residual(segment);
            squares += residual * residual;
        }
        let unknowns = match offsets {
            Offsets::Common => {
                information.m22 = 1.0;
                2
            }
            Offsets::ForEachSense => 3,
        };
        let freedom = segments.len().saturating_sub(unknowns).max(1) as f64;
        let variance = squares / freedom;
        let mut covariance = information.try_inverse().ok_or(Unobservable::OneSteeringAngle)? * variance;
        let units = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, turn_scale));
        covariance = units * covariance * units;
        if offsets == Offsets::Common {
            covariance.m12 = covariance.m11;
            covariance.m21 = covariance.m11;
            covariance.m22 = covariance.m11;
            covariance.m23 = covariance.m13;
            covariance.m32 = covariance.m13;
        }
        intrinsic.covariance = covariance;
        intrinsic.rotation_deviation = libm::sqrt(variance);
        let is_finite = [offset_forward, offset_backward, turn_scale].iter().all(|value| value.is_finite())
            && covariance.iter().all(|value| value.is_finite());
        if is_finite { Ok(intrinsic) } else { Err(Unobservable::NotFinite) }
    }
}

/// Normal equations of the rotations (K 2.11 to 2.13): the entries of the symmetric matrix, and the right side.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Normal {
    pub sine_sine: f64,
    pub sine_cosine: f64,
    pub cosine_cosine: f64,
    pub sine_rotation: f64,
    pub cosine_rotation: f64,
    pub count: usize,
}

impl Normal {
    /// The sums over those segments.
    pub fn of<'a>(segments: impl Iterator<Item = &'a Segment>) -> Self {
        let mut sums = Self::default();
        for segment in segments {
            sums.sine_sine += segment.sine * segment.sine;
            sums.sine_cosine += segment.sine * segment.cosine;
            sums.cosine_cosine += segment.cosine * segment.cosine;
            sums.sine_rotation += segment.sine * segment.rotation;
            sums.cosine_rotation += segment.cosine * segment.rotation;
            sums.count += 1;
        }
        sums
    }

    /// Greater and smaller eigenvalue of the matrix.
    pub fn eigenvalues(&self) -> (f64, f64) {
        let trace = self.sine_sine + self.cosine_cosine;
        let spread = libm::hypot(self.sine_sine - self.cosine_cosine, 2.0 * self.sine_cosine);
        let greater = 0.5 * (trace + spread);
        // The determinant over the greater one does not cancel as half the difference does.
        let determinant = self.sine_sine * self.cosine_cosine - self.sine_cosine * self.sine_cosine;
        (greater, if greater > 0.0 { (determinant / greater).max(0.0) } else { 0.0 })
    }

    /// Whether the steering angles differ and the wheel moves (K propositions 2.4.1, 2.4.2).
    pub fn check(&self, one_angle: Unobservable) -> Result<(), Unobservable> {
        let (greater, smaller) = self.eigenvalues();
        if !(greater.is_finite() && self.sine_rotation.is_finite() && self.cosine_rotation.is_finite()) {
            return Err(Unobservable::NotFinite);
        }
        if self.count < 2 {
            return Err(one_angle);
        }
        if greater < SMALLEST_WAY * SMALLEST_WAY {
            return Err(Unobservable::NoMotion);
        }
        if smaller < SMALLEST_STEERING_DEVIATION * SMALLEST_STEERING_DEVIATION * greater {
            return Err(one_angle);
        }
        Ok(())
    }
}
