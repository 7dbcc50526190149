//! Whether the odometry and the laser tell one motion, for every vehicle whose wheels are counted.

use agv_core::odometry::Vehicle;

use super::Finding;
use crate::calibrate::causes::{Cause, Explanation, explain};
use crate::calibrate::laser_motion::laser_motion;
use crate::calibrate::log_input::LogInput;
use crate::calibrate::mending::mended;
use crate::calibrate::wheeled::mistakes::{WheelExplanation, explain_wheels};
use crate::recording::Recording;

/// What was found.
pub(super) struct VehicleCheck {
    /// The log, with what is told of the laser's motion.
    pub input: LogInput,
    /// By reflectors, of a tricycle.
    pub explanations: Vec<Explanation>,
    /// Of any wheels, by what the laser alone says of its motion.
    pub by_wheels: Vec<WheelExplanation>,
}

impl VehicleCheck {
    /// Looks for mistakes; `progress` is called as by [`explain`].
    pub(super) fn new(recording: &Recording, input: LogInput, mut progress: impl FnMut(usize)) -> Self {
        let mut check = Self { input, explanations: Vec::new(), by_wheels: Vec::new() };
        if matches!(recording.parameters.vehicle, Vehicle::Tricycle(_)) {
            check.explanations = explain(&check.input, &mut progress);
        }
        let few = |explanation: &Explanation| matches!(explanation.causes[..], [Cause::FewReflectors(_)]);
        let is_open = check.explanations.is_empty() || check.explanations.iter().any(few);
        if is_open && is_counted(&recording.parameters.vehicle) {
            if let Some(input) = with_laser_motion(&check.input, recording) {
                check.by_wheels = explain_wheels(&input, |done, _| progress(done));
                check.input = input;
            }
            if !check.by_wheels.is_empty() {
                check.explanations.clear();
            }
        }
        check
    }

    /// Whether the vehicle is as it is believed to be.
    pub(super) fn is_sound(&self) -> bool {
        self.explanations.iter().any(|explanation| explanation.causes.is_empty())
            || self.by_wheels.iter().any(|explanation| explanation.mistakes.is_empty())
    }

    /// Whether nothing says whether it is.
    pub(super) fn is_untold(&self) -> bool {
        self.explanations.is_empty() && self.by_wheels.is_empty()
    }

    /// The log of a vehicle that is mended, if settings mend it.
    pub(super) fn mended(&self) -> Option<LogInput> {
        let by_reflectors = || self.explanations.iter().find_map(|explanation| mended(&self.input, explanation));
        let by_wheels = || {
            let is_mendable = |one: &&WheelExplanation| one.is_mendable();
            self.by_wheels.iter().find(is_mendable).map(|one| one.mended.clone())
        };
        by_reflectors().or_else(by_wheels)
    }

    /// The mistakes, in one finding.
    pub(super) fn finding(&self, log: &str) -> Option<Finding> {
        if self.is_untold() || self.is_sound() {
            return None;
        }
        let mut what: Vec<String> = self.explanations.iter().map(ToString::to_string).collect();
        what.extend(self.by_wheels.iter().map(ToString::to_string));
        let remedies = self.explanations.iter().map(|one| one.remedy(log));
        let mut next: Vec<String> = Vec::new();
        for remedy in remedies.chain(self.by_wheels.iter().map(|one| one.remedy(log))) {
            if !next.contains(&remedy) {
                next.push(remedy);
            }
        }
        Some(Finding::new(what.join("; or: "), next.join("; or: ")))
    }
}

fn is_counted(vehicle: &Vehicle) -> bool {
    matches!(vehicle, Vehicle::Tricycle(_) | Vehicle::Wheels(_))
}

/// The log with the motion of the laser by what it sees, where no other instrument has measured it. None if nothing tells it.
pub fn with_laser_motion(input: &LogInput, recording: &Recording) -> Option<LogInput> {
    if input.laser_poses.len() >= FEWEST_POSES {
        return Some(input.clone());
    }
    let poses = laser_motion(recording);
    (poses.len() >= FEWEST_POSES).then(|| LogInput { laser_poses: poses, ..input.clone() })
}

/// Poses that tell a motion.
const FEWEST_POSES: usize = 20;
