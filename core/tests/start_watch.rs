//! A laser that is knocked while the vehicle does not know where it is: the truth is kept apart.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::geometry::{Pose, Twist};
use agv_core::localizer::{Event, Mode, PoseFix, PoseOutput};
use agv_core::maps::Landmark;
use agv_core::measurement::{PoseIncrement, ReflectorObservation, Reflectors, Time};

use super::support::stage::{LASER, Small, parameters, reflectors};
use super::support::standing_scan;

const BEAMS: usize = 720;

/// Time between two reports of the odometry, each of which has a revolution, us.
const INTERVAL: u64 = 120_000;

/// The motion in a revolution.
const STANDING: Twist = Twist { x: 0.0, y: 0.0, theta: 0.0 };
const AHEAD: Twist = Twist { x: 0.06, ..STANDING };
const BEND: Twist = Twist { theta: 0.05, ..AHEAD };

/// What the laser tells in a revolution.
#[derive(Clone, Copy, PartialEq)]
enum Tells {
    Both,
    Reflectors,
    Surfaces,
}

struct Start {
    localizer: Box<Small>,
    truth: Pose,
    laser: Pose,
    revolutions: u64,
    tells: Tells,
}

impl Start {
    /// A vehicle that has stood for a second, and does not know where it is.
    fn new(tells: Tells) -> Self {
        let mut localizer = Box::new(Small::new(parameters()));
        localizer.add_landmarks(&reflectors()).unwrap();
        let mut start = Self { localizer, truth: Pose::new(-0.9, -2.05, 0.1), laser: LASER, revolutions: 0, tells };
        (0..8).for_each(|_| _ = start.go(&STANDING));
        start
    }

    fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.revolutions * INTERVAL)
    }

    /// A motion, and a revolution behind it that takes no time.
    fn go(&mut self, twist: &Twist) -> PoseOutput {
        let displacement = Pose::exp(twist);
        self.revolutions += 1;
        self.truth = self.truth.compose(&displacement);
        let (time, sensor) = (self.time(), self.truth.compose(&self.laser));
        self.localizer.handle(&Event::Increment(PoseIncrement { time, displacement }));
        let observe = |landmark: &Landmark| {
            let seen = sensor.inverse_transform(&landmark.position());
            ReflectorObservation { time, range: seen.norm() as f32, bearing: seen.y.atan2(seen.x) as f32 }
        };
        let is_localised = self.localizer.outputs().pose.mode != Mode::NotLocalised;
        let is_told = self.tells != Tells::Surfaces || is_localised;
        let seen: Vec<_> = reflectors().iter().filter(|_| is_told).map(observe).collect();
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
        if self.tells == Tells::Reflectors {
            return self.localizer.outputs().pose;
        }
        let ranges = standing_scan::ranges(&sensor, BEAMS, |_, range| range);
        self.localizer.handle(&Event::Scan(standing_scan::scan(time, &ranges))).pose
    }

    /// Gives the pose that a search among the reflectors finds: where the vehicle would be if the laser were where it is believed.
    fn find(&mut self) {
        let pose = self.truth.compose(&self.laser).compose(&LASER.inverse());
        let fix = PoseFix { time: self.time(), pose, position_deviation: 0.014, heading_deviation: 0.003 };
        self.localizer.handle(&Event::SetPose(fix));
    }

    /// The error of the position and its level, m.
    fn error_and_level(&self) -> (f64, f64) {
        let said = self.localizer.outputs().pose;
        ((said.pose.position() - self.truth.position()).norm(), said.level.position)
    }
}

#[test]
fn a_laser_that_is_knocked_before_the_first_pose_is_within_the_level() {
    for tells in [Tells::Both, Tells::Reflectors, Tells::Surfaces] {
        for (x, y) in [(-0.6, -0.5), (0.5, 0.6)] {
            let mut start = Start::new(tells);
            start.laser = Pose { x: LASER.x + x, y: LASER.y + y, ..LASER };
            (0..3).for_each(|_| _ = start.go(&STANDING));
            start.find();
            for motion in [&AHEAD; 20].into_iter().chain([&BEND; 60]) {
                start.go(motion);
                let (error, level) = start.error_and_level();
                assert!(error > 0.3 && error < level, "{x}: {error} of {level}");
            }
        }
    }
}

#[test]
fn one_that_moves_with_the_vehicle_is_believed() {
    let mut start = Start::new(Tells::Both);
    for motion in [&AHEAD; 10].into_iter().chain([&BEND; 10]) {
        start.go(motion);
    }
    start.find();
    // That of a clock that may be late by 0.2 s, as it was found on the way.
    let level = (0..8).map(|_| start.go(&AHEAD)).last().unwrap().level.position;
    assert!(level < 0.6, "{level}");
}

/// What was seen before a pause of the odometry is not compared with what is seen behind it.
#[test]
fn a_vehicle_whose_odometry_was_silent_is_believed() {
    let mut start = Start::new(Tells::Both);
    start.revolutions += 20;
    start.truth = start.truth.compose(&Pose::new(0.5, 0.0, 0.2));
    (0..4).for_each(|_| _ = start.go(&STANDING));
    start.find();
    // That of a clock that may be late by 0.2 s, as it was found on the way.
    let level = (0..8).map(|_| start.go(&AHEAD)).last().unwrap().level.position;
    assert!(level < 0.6, "{level}");
}
