//! A drive through an office as a vehicle records it.

use agv_core::geometry::Pose;
use agv_core::localizer::{Parameters, PoseFix};
use agv_core::measurement::PoseIncrement;
use agv_core::odometry::{OdometryNoise, Vehicle};
use agv_host_sim::mapping::odometry_noise::odometry_noise;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::ReplayError;

use super::slam::OfficeDrive;

/// However long the way from one scan to the next took, s: the increments in between are one here.
const LONGEST_EXTRAPOLATION: f64 = 1e6;

impl OfficeDrive {
    /// The steps of the odometry from each scan of a window to the next.
    #[must_use]
    pub fn steps(&self, (first, last): (usize, usize)) -> Vec<Pose> {
        (first + 1..=last).map(|scan| self.odometry[scan - 1].between(&self.odometry[scan])).collect()
    }

    /// A window as a vehicle with that noise of its odometry records it: it is told the corrected pose of its first scan. All other
    /// parameters are the default ones.
    #[must_use]
    pub fn recording(&self, (first, last): (usize, usize), steps: Vec<Pose>, noise: &OdometryNoise) -> Recording {
        let start = self.scans[first].start;
        let fix = PoseFix { time: start, pose: self.truth[first], position_deviation: 1e-3, heading_deviation: 1e-3 };
        let mut events = vec![RecordedEvent::SetPose(fix)];
        for (scan, displacement) in (first..=last).zip(std::iter::once(Pose::default()).chain(steps)) {
            events.push(RecordedEvent::Increment(PoseIncrement { time: self.scans[scan].start, displacement }));
            events.push(RecordedEvent::Scan(self.scans[scan].clone()));
        }
        // Odometry and corrected poses are those of the laser.
        let mut parameters = Parameters::new(Vehicle::Increments, Pose::default());
        parameters.odometry_noise = *noise;
        parameters.limits.longest_extrapolation = LONGEST_EXTRAPOLATION;
        Recording { parameters, landmarks: Vec::new(), events, truth: Vec::new(), references: Vec::new(), state: None }
    }

    /// The noise of the odometry by what the scans say.
    ///
    /// # Errors
    /// If the drive cannot be replayed.
    pub fn odometry_noise(&self) -> Result<OdometryNoise, ReplayError> {
        let all = (0, self.scans.len() - 1);
        odometry_noise(&self.recording(all, self.steps(all), &OdometryNoise::default()))
    }
}
