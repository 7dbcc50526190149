//! What became of a drive.

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{Localizer, Mode, Outputs, Reason, VehicleCapacities};
use agv_core::state::PoseOutput;

use super::simulator::{Drive, Given, Happened, is_odometry, time};

/// Counts and largest values over a drive.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// Outputs with a pose that is claimed.
    pub outputs: usize,
    /// When it was lost first, s, and why.
    pub lost: Option<(f64, Reason)>,
    /// Outputs whose error is above the level, of the localiser and of its predictor.
    pub above: usize,
    pub above_predicted: usize,
    /// Largest error over the level.
    pub ratio: f64,
    /// Outputs whose level is within the limits of travel.
    pub travel: usize,
    /// Outputs with a level above 1 m.
    pub wide: usize,
    pub errors: Vec<f64>,
    pub last_error: f64,
    pub last_level: f64,
    pub modes: Vec<(Mode, Reason)>,
    /// Largest distance of the predictor from the localiser at the same time, m and rad, and how far its level is below, m and rad.
    pub predictor_off: (f64, f64),
    pub predictor_below: (f64, f64),
}

fn off(said: &PoseOutput, truth: &Pose) -> (f64, f64) {
    ((said.pose.x - truth.x).hypot(said.pose.y - truth.y), difference(said.pose.theta, truth.theta).abs())
}

fn ratio((position, heading): (f64, f64), said: &PoseOutput) -> f64 {
    (position / said.level.position).max(heading / said.level.heading)
}

impl Course {
    pub fn has(&self, mode: Mode) -> bool {
        self.modes.iter().any(|(seen, _)| *seen == mode)
    }

    fn add(&mut self, arrival: f64, outputs: &Outputs, happened: &Happened) {
        let said = &outputs.pose;
        match said.mode {
            Mode::NotLocalised => return,
            Mode::Lost => {
                self.lost.get_or_insert((arrival, said.reason));
                return;
            }
            _ => {}
        }
        if self.modes.last() != Some(&(said.mode, said.reason)) {
            self.modes.push((said.mode, said.reason));
        }
        let error = off(said, &happened.truth(said.time));
        let ratio = ratio(error, said);
        self.outputs += 1;
        self.above += usize::from(ratio > 1.0);
        self.ratio = self.ratio.max(ratio);
        self.travel += usize::from(said.level.position <= 0.15 && said.level.heading <= 2.0_f64.to_radians());
        self.wide += usize::from(said.level.position > 1.0);
        self.errors.push(error.0);
        (self.last_error, self.last_level) = (error.0, said.level.position);
    }

    fn compare(&mut self, given: &Given, happened: &Happened) {
        let said = &given.localizer.outputs().pose;
        let Some(predicted) = given.predictor.output() else { return };
        if matches!(said.mode, Mode::NotLocalised | Mode::Lost)
            || matches!(predicted.mode, Mode::NotLocalised | Mode::Lost)
        {
            return;
        }
        let error = off(&predicted, &happened.truth(predicted.time));
        self.above_predicted += usize::from(ratio(error, &predicted) > 1.0);
        if predicted.time == said.time {
            let (position, heading) = off(&predicted, &said.pose);
            self.predictor_off = (self.predictor_off.0.max(position), self.predictor_off.1.max(heading));
            let below = (said.level.position - predicted.level.position, said.level.heading - predicted.level.heading);
            self.predictor_below = (self.predictor_below.0.max(below.0), self.predictor_below.1.max(below.1));
        }
    }
}

/// Drives it with the parameters of the vehicle, told where it starts.
pub fn course(drive: &Drive) -> Course {
    course_by(drive, Box::new(Localizer::<VehicleCapacities>::new(drive.parameters())), |_, _| {}).0
}

/// The same with a localiser of one's own; `look` is given each output and its arrival.
pub fn course_by(
    drive: &Drive,
    localizer: Box<Localizer<VehicleCapacities>>,
    mut look: impl FnMut(f64, &Outputs),
) -> (Course, Given) {
    let happened = drive.happen();
    let mut given = Given::new(localizer);
    given.localizer.add_landmarks(&drive.reflectors).unwrap();
    let mut course = Course::default();
    let mut is_told = false;
    for (arrival, told) in &happened.events {
        given.take(told);
        if !is_told && is_odometry(told) {
            is_told = true;
            given.set_pose(time(0.0), &happened.truth(time(0.0)));
        }
        course.add(*arrival, given.localizer.outputs(), &happened);
        course.compare(&given, &happened);
        look(*arrival, given.localizer.outputs());
    }
    assert!(is_told && course.outputs + usize::from(course.lost.is_some()) > 0, "nothing was driven");
    (course, given)
}
