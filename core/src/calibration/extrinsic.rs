//! The laser's pose from the translations of the segments (K 2.3).

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use super::intrinsic::{Intrinsic, Offsets};
use super::observability::Unobservable;
use super::segment::Segment;
use crate::geometry::Pose;

/// On which side of R the laser is known to be. K takes it as in front (K 2.3: phi_1 >= 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MountingSide {
    /// In front of the rear axle.
    Front,
    /// Behind it.
    Rear,
    /// To the left of the vehicle's axis.
    Left,
    /// To the right.
    Right,
}

impl MountingSide {
    fn holds(self, position: &Vector2<f64>) -> bool {
        match self {
            Self::Front => position.x >= 0.0,
            Self::Rear => position.x <= 0.0,
            Self::Left => position.y >= 0.0,
            Self::Right => position.y <= 0.0,
        }
    }
}

/// The laser's pose and what goes with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrinsic {
    /// Pose of S in R (K: l).
    pub laser: Pose,
    /// Covariance of x, y, heading: from the residuals, and from the intrinsic parameters' uncertainty.
    pub covariance: Matrix3<f64>,
    /// Wheelbase that makes the free norm of the rotation part one, m: the norm is the assumed wheelbase over the true.
    pub wheelbase: f64,
    /// Its standard deviation, m.
    pub wheelbase_deviation: f64,
    /// Free norm of the rotation part of the unconstrained solution (K: phi_ang).
    pub free_norm: f64,
    /// Standard deviation of a coordinate of the residuals, m.
    pub position_deviation: f64,
    /// Sum of squared residuals of the solution, and of the other root, m^2.
    pub costs: [f64; 2],
}

impl Extrinsic {
    /// Standard deviations: x, y (m), heading (rad).
    #[must_use]
    pub fn deviations(&self) -> Vector3<f64> {
        self.covariance.diagonal().map(|variance| libm::sqrt(variance.max(0.0)))
    }

    /// Position error of a segment (K 2.29), in R at its start, m.
    #[must_use]
    pub fn residual(&self, segment: &Segment, intrinsic: &Intrinsic, wheelbase: f64) -> Vector2<f64> {
        position_error(segment, intrinsic, wheelbase, &self.laser)
    }
}

fn rotation(angle: f64) -> Matrix2<f64> {
    let (sine, cosine) = libm::sincos(angle);
    Matrix2::new(cosine, -sine, sine, cosine)
}

/// The complex product: `first` turned and stretched by `second` (K 2.4: R(first) second).
fn product(first: &Vector2<f64>, second: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(first.x * second.x - first.y * second.y, first.x * second.y + first.y * second.x)
}

/// The complex product with the conjugate of `first` (K: R^T(first) second).
fn conjugate_product(first: &Vector2<f64>, second: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(first.x * second.x + first.y * second.y, first.x * second.y - first.y * second.x)
}

fn position_error(segment: &Segment, intrinsic: &Intrinsic, wheelbase: f64, laser: &Pose) -> Vector2<f64> {
    let moved = segment.arc(intrinsic.offset(segment.is_backward()), intrinsic.turn_scale, wheelbase).position;
    let place = Vector2::new(laser.x, laser.y);
    place + rotation(laser.theta) * segment.sensor - moved - rotation(segment.rotation) * place
}

/// Sums of the extrinsic problem. Turning and stretching the plane are complex numbers here, so the matrix of K 2.32 is
/// two by two: `[turned, mixed; conjugate of mixed, travelled]`.
#[derive(Default)]
struct Sums {
    /// K 2.33: m_1.
    turned: f64,
    /// K 2.34, 2.35: m_2 and m_3.
    mixed: Vector2<f64>,
    /// K 2.36: m_4.
    travelled: f64,
    /// K 2.37: p_1, p_2.
    place: Vector2<f64>,
    /// K 2.37: p_3, p_4.
    heading: Vector2<f64>,
}

impl Sums {
    fn of(segments: &[Segment], intrinsic: &Intrinsic, wheelbase: f64) -> Self {
        let mut sums = Self::default();
        for segment in segments {
            let moved = segment.arc(intrinsic.offset(segment.is_backward()), intrinsic.turn_scale, wheelbase).position;
            let (sine, cosine) = libm::sincos(segment.rotation);
            let lever = Vector2::new(1.0 - cosine, -sine);
            sums.turned += 2.0 * (1.0 - cosine);
            sums.mixed += conjugate_product(&lever, &segment.sensor);
            sums.travelled += segment.sensor.norm_squared();
            sums.place += conjugate_product(&lever, &moved);
            sums.heading += conjugate_product(&segment.sensor, &moved);
        }
        sums
    }
}

/// Smallest sum of squared chords of the rotations, and of squared travels of the laser (m^2), that count.
const SMALLEST_TURN: f64 = 1e-3;
const SMALLEST_TRAVEL: f64 = 1e-4;

/// The laser's pose by constrained least squares (K 2.28 to 2.39, with b = -2 mu_2). Of the two roots the one with the
/// lower cost is taken; a stated `side` must agree with it.
///
/// # Errors
/// [`Unobservable`], see K proposition 2.4.3.
pub fn laser_pose(
    segments: &[Segment],
    intrinsic: &Intrinsic,
    wheelbase: f64,
    side: Option<MountingSide>,
) -> Result<Extrinsic, Unobservable> {
    if segments.len() < 2 {
        return Err(Unobservable::TooFewSegments);
    }
    if !(segments.iter().all(Segment::is_finite) && wheelbase.is_finite() && wheelbase > 0.0) {
        return Err(Unobservable::NotFinite);
    }
    let sums = Sums::of(segments, intrinsic, wheelbase);
    if sums.turned < SMALLEST_TURN {
        return Err(Unobservable::NoRotation);
    }
    // K: mu_2 of the decomposition below 2.38, what is left of the travels when the place is free.
    let travelled = sums.travelled - sums.mixed.norm_squared() / sums.turned;
    if travelled < SMALLEST_TRAVEL {
        return Err(Unobservable::NoTranslation);
    }
    let reduced = sums.heading - conjugate_product(&sums.mixed, &sums.place) / sums.turned;
    let length = reduced.norm();
    if !(length.is_finite() && length > 0.0) {
        return Err(Unobservable::NoTranslation);
    }
    // K 2.39: lambda = mu_2 -+ |reduced|, so the rotation part is plus or minus the direction of `reduced`.
    let root = |sign: f64| {
        let direction = reduced * (sign / length);
        let place = (sums.place - product(&sums.mixed, &direction)) / sums.turned;
        let laser = Pose::new(place.x, place.y, libm::atan2(direction.y, direction.x));
        let cost: f64 =
            segments.iter().map(|segment| position_error(segment, intrinsic, wheelbase, &laser).norm_squared()).sum();
        (laser, cost)
    };
    let (first, second) = (root(1.0), root(-1.0));
    let ((laser, cost), (_, other_cost)) = if first.1 <= second.1 { (first, second) } else { (second, first) };
    if side.is_some_and(|side| !side.holds(&Vector2::new(laser.x, laser.y))) {
        return Err(Unobservable::WrongSide);
    }
    let variance = cost / (2 * segments.len()).saturating_sub(3).max(1) as f64;
    let free_norm = length / travelled;
    let free_cost = (cost - travelled * (free_norm - 1.0) * (free_norm - 1.0)).max(0.0);
    let free_variance = free_cost / (2 * segments.len()).saturating_sub(4).max(1) as f64;
    let norm_deviation = libm::sqrt(free_variance / travelled);
    Ok(Extrinsic {
        laser,
        covariance: covariance(segments, intrinsic, wheelbase, &laser, variance)?,
        wheelbase: wheelbase / free_norm,
        wheelbase_deviation: wheelbase / (free_norm * free_norm) * norm_deviation,
        free_norm,
        position_deviation: libm::sqrt(variance),
        costs: [cost, other_cost],
    })
}

fn covariance(
    segments: &[Segment],
    intrinsic: &Intrinsic,
    wheelbase: f64,
    laser: &Pose,
    variance: f64,
) -> Result<Matrix3<f64>, Unobservable> {
    let mut information = Matrix3::zeros();
    let mut influence = Matrix3::zeros();
    let quarter_turned = rotation(laser.theta + core::f64::consts::FRAC_PI_2);
    for segment in segments {
        let by_place = Matrix2::identity() - rotation(segment.rotation);
        let by_heading = quarter_turned * segment.sensor;
        let jacobian = Matrix2x3::from_columns(&[by_place.column(0).into(), by_place.column(1).into(), by_heading]);
        let is_backward = segment.is_backward();
        let by_intrinsic = segment.arc(intrinsic.offset(is_backward), intrinsic.turn_scale, wheelbase).derivative;
        let (by_offset, by_scale) = (by_intrinsic.column(0).into_owned(), by_intrinsic.column(1).into_owned());
        let zero = Vector2::zeros();
        let by_parameters = match (intrinsic.offsets, is_backward) {
            (Offsets::ForEachSense, true) => Matrix2x3::from_columns(&[zero, by_offset, by_scale]),
            _ => Matrix2x3::from_columns(&[by_offset, zero, by_scale]),
        };
        information += jacobian.transpose() * jacobian;
        influence += jacobian.transpose() * by_parameters;
    }
    let inverse = information.try_inverse().ok_or(Unobservable::NoRotation)?;
    let influence = inverse * influence;
    Ok(inverse * variance + influence * intrinsic.covariance * influence.transpose())
}
