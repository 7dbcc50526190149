//! The vehicle's parameters from a drive: steering offsets, drive scale, wheelbase and the laser's pose (K chapter 2).
//!
//! A drive is cut into segments, each in one sense of travel. A [`SegmentBuilder`] turns the encoders' samples into sums
//! as they come; no sample is stored. [`calibrate`] takes the segments with the motion that the laser has seen in each.

mod arc;
mod calibrator;
mod conditioning;
mod extrinsic;
mod intrinsic;
mod intrinsic_asymmetric;
mod intrinsic_standard;
mod observability;
mod outliers;
mod registration;
mod segment;

pub use calibrator::{CALIBRATION_SEGMENTS, Calibrator, CalibratorError};
pub use conditioning::Conditioning;
pub use extrinsic::{Extrinsic, MountingSide, laser_pose};
pub use intrinsic::{Intrinsic, Offsets};
pub use intrinsic_asymmetric::intrinsic_asymmetric;
pub use intrinsic_standard::intrinsic_standard;
pub use observability::Unobservable;
pub use outliers::{OutlierFlags, outliers};
pub use registration::{Registered, Registration};
pub use segment::{Segment, SegmentBuilder};

/// What is solved for, and under which assumptions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Problem {
    /// One steering offset or one for each sense of travel.
    pub offsets: Offsets,
    /// Distance from the rear axle to the driving wheel's steering axis, m, as it is assumed (K: L).
    pub wheelbase: f64,
    /// Whether the wheelbase that the laser's motion suggests replaces the assumed one.
    pub is_wheelbase_free: bool,
    /// On which side of R the laser is known to be.
    pub side: Option<MountingSide>,
}

/// What a drive says of its vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Steering offsets and drive scale.
    pub intrinsic: Intrinsic,
    /// The laser's pose, and what the wheelbase seems to be.
    pub extrinsic: Extrinsic,
    /// Wheelbase that the figures above rest on, m.
    pub wheelbase: f64,
    /// How well the segments tell the intrinsic parameters apart.
    pub conditioning: Conditioning,
}

impl Calibration {
    /// Distance travelled by the driving wheel for one tick, m (K 2.15, 2.27: s_w).
    #[must_use]
    pub fn drive_scale(&self) -> f64 {
        self.intrinsic.turn_scale * self.wheelbase
    }

    /// Standard deviation of the drive scale, m for a tick; with a free wheelbase, its uncertainty is in it.
    #[must_use]
    pub fn drive_scale_deviation(&self, is_wheelbase_free: bool) -> f64 {
        let turn = self.wheelbase * self.intrinsic.deviations().z;
        let base = if is_wheelbase_free { self.intrinsic.turn_scale * self.extrinsic.wheelbase_deviation } else { 0.0 };
        libm::hypot(turn, base)
    }
}

/// Intrinsic parameters from the rotations of the segments, then the laser's pose from their translations.
///
/// # Errors
/// [`Unobservable`] says what the segments cannot tell.
pub fn calibrate(segments: &[Segment], problem: &Problem) -> Result<Calibration, Unobservable> {
    let intrinsic = match problem.offsets {
        Offsets::Common => intrinsic_standard(segments)?,
        Offsets::ForEachSense => intrinsic_asymmetric(segments)?,
    };
    let mut wheelbase = problem.wheelbase;
    let mut extrinsic = laser_pose(segments, &intrinsic, wheelbase, problem.side)?;
    if problem.is_wheelbase_free {
        wheelbase = extrinsic.wheelbase;
        extrinsic = laser_pose(segments, &intrinsic, wheelbase, problem.side)?;
    }
    Ok(Calibration { intrinsic, extrinsic, wheelbase, conditioning: Conditioning::of(segments) })
}
