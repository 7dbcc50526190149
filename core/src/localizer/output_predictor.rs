//! The pose for now, while the localiser is still busy with what was true a little earlier.
//!
//! A scan takes the localiser longer than an encoder sample may wait. So the samples wait for the localiser, and this
//! carries its last pose on by them at once: the output predictor of PX4's EKF2 and others, here without states of its
//! own, as the pose is all that is published.

use heapless::Deque;
use nalgebra::Matrix3;

use super::Parameters;
use crate::filter::Ekf;
use crate::measurement::{EncoderFaults, EncoderSample};
use crate::odometry::{Motion, Odometer};
use crate::state::{Mode, PoseOutput, Reason};

/// Carries the localiser's last pose on to the newest encoder sample. Remembers `MOTIONS` motions: with 100 samples a
/// second, the localiser may be behind by as many hundredths of a second.
#[derive(Clone, Debug)]
pub struct OutputPredictor<const MOTIONS: usize = 40> {
    odometer: Odometer,
    motions: Deque<Motion, MOTIONS>,
    base: Option<PoseOutput>,
    state: Ekf,
    faults: EncoderFaults,
}

impl<const MOTIONS: usize> OutputPredictor<MOTIONS> {
    /// A predictor for the vehicle of a localiser with these parameters.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            odometer: Odometer::new(
                parameters.vehicle,
                parameters.odometry_noise,
                parameters.integration,
                parameters.limits.fastest,
            ),
            motions: Deque::new(),
            base: None,
            state: Ekf::new(crate::geometry::Pose::default(), 0.0, 0.0),
            faults: EncoderFaults::default(),
        }
    }

    /// Takes what the localiser said last.
    pub fn update(&mut self, output: &PoseOutput) {
        while self.motions.front().is_some_and(|motion| motion.end <= output.time) {
            self.motions.pop_front();
        }
        self.base = Some(*output);
        let [xx, xy, yy, x_heading, y_heading, heading] = output.covariance;
        let covariance = Matrix3::new(xx, xy, x_heading, xy, yy, y_heading, x_heading, y_heading, heading);
        self.state = Ekf { pose: output.pose, covariance };
        for motion in &self.motions {
            // Of a motion that is partly known the rest counts.
            if motion.start < output.time {
                self.state.predict(&motion.split(output.time).1);
            } else {
                self.state.predict(motion);
            }
        }
    }

    /// Takes a sample of the encoders, at once when it is heard.
    pub fn encoders(&mut self, sample: &EncoderSample) {
        self.faults = EncoderFaults::default();
        let Ok(motion) = self.odometer.encoders(sample) else {
            return;
        };
        if self.motions.is_full() {
            self.motions.pop_front();
        }
        // There is room.
        let _ = self.motions.push_back(motion);
        if self.base.is_some_and(|base| motion.end > base.time) {
            self.state.predict(&motion);
        }
    }

    /// Takes what is wrong with the encoders, at once when it is known.
    pub fn doubt_encoders(&mut self, faults: &EncoderFaults) {
        self.faults = *faults;
        if faults.any() {
            self.odometer.restart();
        }
    }

    /// The pose for now. None before the localiser has said anything.
    #[must_use]
    pub fn output(&self) -> Option<PoseOutput> {
        let base = self.base?;
        let newest = self.motions.back().filter(|motion| motion.end > base.time);
        let way: f64 = self.motions.iter().filter(|motion| motion.end > base.time).map(|motion| motion.distance).sum();
        let is_localised = !matches!(base.mode, Mode::NotLocalised | Mode::Lost);
        let (mode, reason) = match (is_localised, self.faults.drive, self.faults.steering) {
            (true, Some(_), _) => (Mode::WithoutOdometry, Reason::DriveEncoder),
            (true, None, Some(_)) => (Mode::WithoutOdometry, Reason::SteeringEncoder),
            _ => (base.mode, base.reason),
        };
        Some(PoseOutput {
            time: newest.map_or(base.time, |motion| motion.end),
            pose: self.state.pose,
            smooth: base.smooth.compose(&base.pose.between(&self.state.pose)),
            covariance: self.state.covariance_entries(),
            mode,
            reason,
            dead_reckoning_distance: base.dead_reckoning_distance + way,
            ..base
        })
    }
}
