//! Names for people.

use agv_core::localizer::{Mode, Reason};
use agv_core::maps::LandmarkKind;

/// Name of a mode.
#[must_use]
pub fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::NotLocalised => "not localised",
        Mode::Reflectors => "reflectors",
        Mode::Features => "features",
        Mode::Mixed => "mixed",
        Mode::DeadReckoning => "dead reckoning",
        Mode::WithoutOdometry => "without odometry",
        Mode::Degraded => "degraded",
        Mode::Lost => "lost",
    }
}

/// Name of a mode in a drive; contours are what its features were if no feature among the landmarks ever led.
#[must_use]
pub fn mode_name_of_drive(mode: Mode, is_by_contours: bool) -> &'static str {
    match mode {
        Mode::Features if is_by_contours => "contours",
        Mode::Mixed if is_by_contours => "reflectors and contours",
        mode => mode_name(mode),
    }
}

/// Name of a reason.
#[must_use]
pub fn reason_name(reason: Reason) -> &'static str {
    match reason {
        Reason::None => "",
        Reason::NoPose => "no pose has been given",
        Reason::NoLandmarks => "no landmarks",
        Reason::LandmarksRejected => "landmarks rejected",
        Reason::InnovationsTooLarge => "innovations too large",
        Reason::Uncertain => "too uncertain",
        Reason::OdometryImplausible => "odometry implausible",
        Reason::DriveEncoder => "the drive encoder has a fault",
        Reason::SteeringEncoder => "the steering encoder has a fault",
        Reason::MotionDisagrees => "laser and odometry saw different motions",
        Reason::LaserMoved => "the laser has moved on the vehicle",
        Reason::OdometryDisagrees => "odometry is not as believed",
        Reason::OdometrySilent => "no odometry",
        Reason::WheelsSlip => "gyro and wheels turn differently",
        Reason::GyroFault => "the gyro has a fault",
    }
}

/// Name of the landmarks of a kind.
#[must_use]
pub fn kind_name(kind: LandmarkKind) -> &'static str {
    match kind {
        LandmarkKind::Reflector => "reflectors",
        LandmarkKind::Corner => "corners",
        LandmarkKind::EndPoint => "end points",
    }
}
