//! What a fit takes of a drive.

use agv_core::geometry::Pose;
use agv_core::odometry::WheelMotion;

/// What all wheels did between two rows of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelStep {
    /// End of the step on the odometry's clock, s; its begin is the end of the step before, of the first one zero.
    pub end: f64,
    /// One for each wheel of the vehicle.
    pub motions: Vec<WheelMotion>,
}

/// Where something on the vehicle was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedPose {
    /// On the clock of the poses, s since the first pose of the drive.
    pub time: f64,
    /// Position in any fixed frame, m.
    pub x: f64,
    /// Position in any fixed frame, m.
    pub y: f64,
    /// Heading without jumps, rad.
    pub heading: f64,
}

/// One drive: wheels on their clock, poses on theirs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WheelDrive {
    /// In order of time.
    pub steps: Vec<WheelStep>,
    /// In order of time.
    pub poses: Vec<TimedPose>,
}

impl WheelDrive {
    /// A drive with poses whose headings may jump by whole turns.
    #[must_use]
    pub fn new(steps: Vec<WheelStep>, poses: impl IntoIterator<Item = (f64, Pose)>) -> Self {
        let mut last: Option<f64> = None;
        let unwrapped = |(time, pose): (f64, Pose)| {
            let heading = last.map_or(pose.theta, |last| last + agv_core::geometry::difference(pose.theta, last));
            last = Some(heading);
            TimedPose { time, x: pose.x, y: pose.y, heading }
        };
        Self { steps, poses: poses.into_iter().map(unwrapped).collect() }
    }
}
