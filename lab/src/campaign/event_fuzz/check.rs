//! What holds after every event, whatever it was.

use agv_core::localizer::{LandmarkUse, Limits, Outputs};
use agv_core::maps::Verdict;
use agv_core::state::{Mode, PoseOutput, Reason};
use nalgebra::Matrix3;

/// What does not hold of the outputs; none if all does.
#[must_use]
pub fn violation(outputs: &Outputs, limits: &Limits) -> Option<String> {
    pose(&outputs.pose, limits).or_else(|| outputs.uses.iter().find_map(landmark_use))
}

fn pose(output: &PoseOutput, limits: &Limits) -> Option<String> {
    let PoseOutput { pose, smooth, covariance, mode, reason, .. } = output;
    if !(pose.is_finite() && smooth.is_finite()) {
        return Some(format!("a pose is not finite: {pose:?}, smooth {smooth:?}"));
    }
    if pose.theta.abs() > core::f64::consts::PI {
        return Some(format!("the heading is not wrapped: {}", pose.theta));
    }
    if let Some(found) = self::covariance(covariance) {
        return Some(found);
    }
    // There is no way to a landmark of a vehicle that was nowhere yet.
    let way = output.dead_reckoning_distance;
    if way.is_nan() || way < 0.0 || !output.correction.is_finite() || output.correction < 0.0 {
        return Some(format!("way {way}, correction {}", output.correction));
    }
    if !((0.0..=1.0).contains(&output.acceptance) && (0.0..=f64::MAX).contains(&output.normalised_square)) {
        return Some(format!("acceptance {}, normalised square {}", output.acceptance, output.normalised_square));
    }
    let level = output.level;
    if !(0.0..f64::INFINITY).contains(&level.position) || !(0.0..f64::INFINITY).contains(&level.heading) {
        return Some(format!("{level:?}"));
    }
    if !fits(*mode, *reason) {
        return Some(format!("{mode:?} because of {reason:?}"));
    }
    let [xx, xy, yy, _, _, heading] = *covariance;
    let worst = 0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    let is_sure = worst.sqrt() <= limits.largest_position_deviation * (1.0 + 1e-6)
        && heading.sqrt() <= limits.largest_heading_deviation * (1.0 + 1e-6);
    if !is_sure && !matches!(mode, Mode::Lost | Mode::NotLocalised) {
        return Some(format!("{mode:?} with a covariance of {covariance:?}"));
    }
    None
}

fn fits(mode: Mode, reason: Reason) -> bool {
    match mode {
        Mode::NotLocalised => reason == Reason::NoPose,
        Mode::Reflectors | Mode::Features | Mode::Mixed => {
            matches!(reason, Reason::None | Reason::OdometryDisagrees | Reason::WheelsSlip | Reason::GyroFault)
        }
        Mode::Degraded => matches!(reason, Reason::LaserMoved | Reason::LandmarksRejected),
        Mode::DeadReckoning => matches!(reason, Reason::NoLandmarks | Reason::WheelsSlip | Reason::GyroFault),
        Mode::WithoutOdometry => {
            matches!(
                reason,
                Reason::OdometryImplausible | Reason::DriveEncoder | Reason::SteeringEncoder | Reason::OdometrySilent
            )
        }
        Mode::Lost => matches!(
            reason,
            Reason::LandmarksRejected
                | Reason::InnovationsTooLarge
                | Reason::MotionDisagrees
                | Reason::Uncertain
                | Reason::NoLandmarks
                // The pose that was given is of a time that the odometry has not reached.
                | Reason::NoPose
        ),
    }
}

/// Least eigenvalue of the correlations: what the filter leaves to rounding.
const LEAST: f64 = -1e-4;

/// Symmetric it is by its form; whether it is finite and positive semidefinite.
fn covariance(entries: &[f64; 6]) -> Option<String> {
    let [xx, xy, yy, xh, yh, hh] = *entries;
    let wrong = |what| Some(format!("the covariance is {what}: {entries:?}"));
    if !entries.iter().all(|entry| entry.is_finite()) {
        return wrong("not finite");
    }
    if xx < 0.0 || yy < 0.0 || hh < 0.0 {
        return wrong("negative");
    }
    // Of a matrix with ones on its diagonal, so that units and sizes do not matter.
    let scale = |variance: f64| if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
    let (x, y, h) = (scale(xx), scale(yy), scale(hh));
    if (xx == 0.0 && (xy != 0.0 || xh != 0.0))
        || (yy == 0.0 && (xy != 0.0 || yh != 0.0))
        || (hh == 0.0 && (xh != 0.0 || yh != 0.0))
    {
        return wrong("not positive semidefinite");
    }
    let (xy, xh, yh) = (xy * x * y, xh * x * h, yh * y * h);
    let correlations = Matrix3::new(1.0, xy, xh, xy, 1.0, yh, xh, yh, 1.0);
    if correlations.symmetric_eigenvalues().min() < LEAST {
        return wrong("not positive semidefinite");
    }
    None
}

fn landmark_use(seen: &LandmarkUse) -> Option<String> {
    let numbers = [seen.located, seen.residual, seen.residual_deviation];
    let is_finite = numbers.as_flattened().iter().all(|number| number.is_finite())
        && seen.position.iter().all(|number| number.is_finite());
    let is_sound =
        is_finite && seen.test_ratio >= 0.0 && seen.residual_deviation.iter().all(|deviation| *deviation >= 0.0);
    let fits = seen.verdict != Verdict::Accepted || (seen.landmark.is_some() && seen.test_ratio <= 1.0 + 1e-9);
    (!(is_sound && fits)).then(|| format!("{seen:?}"))
}
