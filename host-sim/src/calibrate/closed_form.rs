//! The core's closed forms over windows, with a search for the steering ratio.

use agv_core::calibration::{Calibration, MountingSide, Offsets, Problem, Segment, Unobservable, calibrate};
use agv_core::odometry::Tricycle;

use super::model::VehicleModel;
use super::window::Window;

/// Which closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClosedForm {
    /// One steering offset or two.
    pub offsets: Offsets,
    /// Whether the wheelbase is estimated.
    pub is_wheelbase_free: bool,
    /// On which side the laser is.
    pub side: Option<MountingSide>,
}

/// Rounds in which the nominal vehicle becomes the found one, so that steering may change within windows.
const ROUNDS: usize = 3;

/// Segments of the windows, relative to a nominal vehicle.
#[must_use]
pub fn segments(windows: &[Window], nominal: &Tricycle, steering_ratio: f64) -> Vec<Segment> {
    windows.iter().map(|window| window.segment(nominal, steering_ratio)).collect()
}

/// The model that a closed form stands for.
#[must_use]
pub fn model(calibration: &Calibration, steering_ratio: f64) -> VehicleModel {
    VehicleModel {
        offset_forward: calibration.intrinsic.offset_forward,
        offset_backward: calibration.intrinsic.offset_backward,
        drive_scale: calibration.drive_scale(),
        wheelbase: calibration.wheelbase,
        steering_ratio,
        laser: calibration.extrinsic.laser,
    }
}

/// Solves with a given steering ratio.
///
/// # Errors
/// [`Unobservable`].
pub fn solve(
    windows: &[Window],
    nominal: &Tricycle,
    form: &ClosedForm,
    steering_ratio: f64,
) -> Result<Calibration, Unobservable> {
    let mut vehicle = *nominal;
    let problem = Problem {
        offsets: form.offsets,
        wheelbase: nominal.wheelbase,
        is_wheelbase_free: form.is_wheelbase_free,
        side: form.side,
    };
    let mut calibration = calibrate(&segments(windows, &vehicle, steering_ratio), &problem)?;
    for _ in 1..ROUNDS {
        // The steps of a window are already stretched by the ratio.
        vehicle = Tricycle { steering_scale: nominal.steering_scale, ..model(&calibration, 1.0).apply(nominal) };
        calibration = calibrate(&segments(windows, &vehicle, steering_ratio), &problem)?;
    }
    Ok(calibration)
}

/// A rotation that is off by one radian costs as much as a position that is off by this, m.
const LEVER: f64 = 1.0;

/// The steering ratio between `low` and `high` with the smallest residuals, by trial in equal proportions and then by
/// golden section.
///
/// # Errors
/// [`Unobservable`] if no ratio gives a solution.
pub fn steering_ratio(
    windows: &[Window],
    nominal: &Tricycle,
    form: &ClosedForm,
    [low, high]: [f64; 2],
) -> Result<f64, Unobservable> {
    const TRIALS: i32 = 60;
    const SECTIONS: usize = 40;
    let mut reason = Unobservable::TooFewSegments;
    let mut cost = |power: f64| match solve(windows, nominal, form, power.exp()) {
        Ok(found) => {
            let rotation = LEVER * found.intrinsic.rotation_deviation;
            rotation.powi(2) + found.extrinsic.position_deviation.powi(2)
        }
        Err(error) => {
            reason = error;
            f64::INFINITY
        }
    };
    let step = (high / low).ln() / f64::from(TRIALS);
    let best = (0..=TRIALS)
        .map(|trial| low.ln() + step * f64::from(trial))
        .map(|power| (power, cost(power)))
        .min_by(|first, second| first.1.total_cmp(&second.1));
    let Some((centre, _)) = best.filter(|best| best.1.is_finite()) else {
        return Err(reason);
    };
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    let (mut low, mut high) = (centre - step, centre + step);
    for _ in 0..SECTIONS {
        let (first, second) = (high - golden * (high - low), low + golden * (high - low));
        if cost(first) < cost(second) { high = second } else { low = first }
    }
    Ok((0.5 * (low + high)).exp())
}
