//! A pose that only the odometry moves.

use crate::filter::Timeline;
use crate::geometry::Pose;
use crate::measurement::Time;

/// Follows the odometry from the last given pose on. What lies between it and the pose in W is the correction by
/// landmarks, so a controller that steers by it feels no step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SmoothPose {
    time: Time,
    pose: Pose,
    /// The smooth frame in W, as it was at the last publication.
    offset: Pose,
}

impl SmoothPose {
    pub(super) fn new(time: Time, pose: Pose) -> Self {
        Self { time, pose, offset: Pose::default() }
    }

    pub(super) fn pose(&self) -> Pose {
        self.pose
    }

    /// Goes on to the present of the timeline, whose pose in W is given. Returns by how far landmarks have moved that
    /// since the last call, m.
    pub(super) fn follow<const PAST: usize>(&mut self, timeline: &Timeline<PAST>, pose: &Pose) -> f64 {
        let now = timeline.now();
        if now > self.time {
            for motion in timeline.motions(self.time, now) {
                self.pose = self.pose.compose(&motion.displacement);
            }
            self.time = now;
        }
        let expected = self.offset.compose(&self.pose);
        self.offset = pose.compose(&self.pose.inverse());
        libm::hypot(pose.x - expected.x, pose.y - expected.y)
    }
}
