//! The odometry of the wheels against the surfaces around the laser, where no landmark is in sight: the truth is kept apart.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Pose, Twist};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Mode, Parameters, PoseFix, PoseOutput, Reason, SlamSlots};
use agv_core::maps::Landmark;
use agv_core::measurement::{PoseIncrement, ReflectorObservation, Reflectors, Time};
use agv_core::odometry::Vehicle;
use agv_core::sources::Contours;

use super::support::stage::reflectors;
use super::support::standing_scan;

const BEAMS: usize = 720;
type Small = Localizer<CapacitiesOf<BEAMS, 64, 16, 4, SlamSlots, Contours<'static, 400, 4096, 20>>>;

const LASER: Pose = Pose { x: 0.4, y: 0.05, theta: 0.2 };

/// Time between two reports of the odometry, each of which has a revolution, us.
const INTERVAL: u64 = 120_000;

/// The motion in a revolution.
const AHEAD: Twist = Twist { x: 0.06, y: 0.0, theta: 0.0 };
const BEND: Twist = Twist { theta: 0.5 * PI / SIDE as f64, ..AHEAD };

/// Revolutions on a straight and in a bend.
const SIDE: usize = 30;

struct Drive {
    localizer: Box<Small>,
    truth: Pose,
    revolutions: u64,
    /// Landmarks in sight.
    in_sight: usize,
    /// What the wheels report of the way.
    scale: f64,
}

impl Drive {
    /// A vehicle that has driven among reflectors for so long that it knows its odometry, and sees none any more.
    fn new(has_contours: bool) -> Self {
        // Three rounds of a square with round corners.
        Self::behind(12, has_contours)
    }

    /// One that has driven so many sides of a square with round corners among reflectors, and sees none any more.
    fn behind(sides: usize, has_contours: bool) -> Self {
        let mut parameters = Parameters::new(Vehicle::Increments, LASER);
        parameters.sources.contours = has_contours;
        let mut localizer = Box::new(Small::new(parameters));
        let landmarks: Vec<Landmark> = reflectors();
        localizer.add_landmarks(&landmarks).unwrap();
        let truth = Pose::new(-0.9, -2.05, 0.0);
        let mut drive = Self { localizer, truth, revolutions: 0, in_sight: landmarks.len(), scale: 1.0 };
        drive.report(&Pose::default());
        let fix = PoseFix { time: drive.time(), pose: truth, position_deviation: 0.01, heading_deviation: 0.002 };
        drive.localizer.handle(&Event::SetPose(fix));
        for _ in 0..sides {
            (0..SIDE).for_each(|_| _ = drive.go(&AHEAD));
            (0..SIDE).for_each(|_| _ = drive.go(&BEND));
        }
        // One after the other comes out of sight: many at once that nothing hides would say that the vehicle was carried.
        while drive.in_sight > 0 {
            drive.in_sight -= 1;
            drive.go(&BEND);
        }
        drive
    }

    fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.revolutions * INTERVAL)
    }

    fn report(&mut self, displacement: &Pose) {
        let increment = PoseIncrement { time: self.time(), displacement: *displacement };
        self.localizer.handle(&Event::Increment(increment));
    }

    /// The reflectors of a revolution that takes no time.
    fn see_reflectors(&mut self) {
        let (sensor, time) = (self.truth.compose(&LASER), self.time());
        let observe = |landmark: &Landmark| {
            let seen = sensor.inverse_transform(&landmark.position());
            ReflectorObservation { time, range: seen.norm() as f32, bearing: seen.y.atan2(seen.x) as f32 }
        };
        let seen: Vec<_> = reflectors().iter().take(self.in_sight).map(observe).collect();
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
    }

    /// The scan of a revolution that takes no time; `change` is done to each range.
    fn see_surfaces(&mut self, change: impl Fn(usize, f64) -> f64) -> PoseOutput {
        let ranges = standing_scan::ranges(&self.truth.compose(&LASER), BEAMS, change);
        self.localizer.handle(&Event::Scan(standing_scan::scan(self.time(), &ranges))).pose
    }

    /// A motion that nothing is seen behind.
    fn move_on(&mut self, twist: &Twist) {
        let step = Pose::exp(twist);
        self.revolutions += 1;
        self.truth = self.truth.compose(&step);
        self.report(&Pose { x: self.scale * step.x, y: self.scale * step.y, ..step });
    }

    fn go_seeing(&mut self, twist: &Twist, change: impl Fn(usize, f64) -> f64) -> PoseOutput {
        self.move_on(twist);
        self.see_reflectors();
        self.see_surfaces(change)
    }

    fn go(&mut self, twist: &Twist) -> PoseOutput {
        self.go_seeing(twist, |_, range| range)
    }

    /// The error of the position over its level, and that level, m.
    fn error_over_level(&self) -> (f64, f64) {
        let said = self.localizer.outputs().pose;
        let error = (said.pose.position() - self.truth.position()).norm();
        (error / said.level.position, said.level.position)
    }
}

#[test]
fn a_wheel_that_slips_where_no_landmark_is_in_sight_is_within_the_level() {
    for scale in [0.1, 0.5, 0.8, 1.5] {
        let (mut held, mut blind) = (Drive::new(true), Drive::new(false));
        let mut most = [0.0_f64; 2];
        (held.scale, blind.scale) = (scale, scale);
        for _ in 0..30 {
            for (drive, most) in [&mut held, &mut blind].into_iter().zip(&mut most) {
                drive.go(&BEND);
                *most = most.max(drive.error_over_level().0);
            }
        }
        assert!(most[0] < 1.0, "{scale}: {most:?}");
        assert!(most[1] > 1.0, "the wheels alone are within it at {scale}: {most:?}");
        let said = held.localizer.outputs().pose;
        assert_eq!(said.reason, Reason::OdometryDisagrees, "{scale}");
    }
}

#[test]
fn an_odometry_in_order_has_the_level_that_it_has_without_surfaces() {
    let (mut by_surfaces, mut blind) = (Drive::new(true), Drive::new(false));
    for revolution in 0..60 {
        let said = by_surfaces.go(&BEND);
        blind.go(&BEND);
        let (level, without) = (by_surfaces.error_over_level().1, blind.error_over_level().1);
        assert!(level < without + 0.005, "{revolution}: {level} {without}");
        assert_ne!(said.reason, Reason::OdometryDisagrees, "{revolution}");
    }
}

/// Range of a beam in a corridor along the way of a vehicle in its middle, m.
fn corridor(beam: usize, _: f64) -> f64 {
    let bearing = beam as f64 * TAU / BEAMS as f64 - PI + LASER.theta;
    let side = if bearing > 0.0 { 2.0 - LASER.y } else { 2.0 + LASER.y };
    (side / bearing.sin().abs()).min(25.0)
}

/// An odometry that is hardly known may be wrong by much; surfaces show how far it leads the pose away.
#[test]
fn surfaces_bound_an_odometry_that_is_hardly_known() {
    let (mut by_surfaces, mut blind) = (Drive::behind(1, true), Drive::behind(1, false));
    let level = |drive: &mut Drive| (0..60).map(|_| drive.go(&BEND)).last().unwrap().level.position;
    let (level, without) = (level(&mut by_surfaces), level(&mut blind));
    assert!(level < 0.6 * without, "{level} {without}");
    for scale in [0.85, 0.95, 1.05, 1.15] {
        let mut drive = Drive::behind(1, true);
        drive.scale = scale;
        for revolution in 0..60 {
            drive.go(&BEND);
            let (error, level) = drive.error_over_level();
            assert!(error < 1.0, "{scale} {revolution}: {error} of {level}");
        }
    }
}

/// Along a corridor only the wheels tell how far it goes.
#[test]
fn along_a_corridor_surfaces_bound_no_odometry() {
    let (mut by_surfaces, mut blind) = (Drive::behind(1, true), Drive::behind(1, false));
    let level = |drive: &mut Drive| (0..60).map(|_| drive.go_seeing(&AHEAD, corridor)).last().unwrap().level.position;
    let (level, without) = (level(&mut by_surfaces), level(&mut blind));
    assert!(level >= without, "{level} {without}");
}

/// Nothing of what is seen lies on a surface, though nothing is far from one.
fn elsewhere(beam: usize, range: f64) -> f64 {
    range + [-0.35, -0.12, 0.12, 0.35][beam % 4]
}

#[test]
fn what_lies_on_no_surface_for_one_revolution_is_no_motion() {
    let mut drive = Drive::new(true);
    let before = (0..5).map(|_| drive.go(&AHEAD)).last().unwrap().level.position;
    let torn = drive.go_seeing(&AHEAD, elsewhere);
    assert!(torn.level.position > before + 1.0 && torn.mode != Mode::Lost, "{before} {torn:?}");
    let after = (0..2).map(|_| drive.go(&AHEAD)).last().unwrap().level.position;
    assert!(after < before + 0.02, "{before} {after}");
}

#[test]
fn what_lies_on_no_surface_for_two_revolutions_may_be_a_motion_until_a_pose_is_given() {
    let mut drive = Drive::new(true);
    (0..5).for_each(|_| _ = drive.go(&AHEAD));
    (0..2).for_each(|_| _ = drive.go_seeing(&AHEAD, elsewhere));
    let torn = (0..5).map(|_| drive.go(&AHEAD)).last().unwrap();
    assert!(torn.level.position > 1.0 && torn.reason == Reason::OdometryDisagrees, "{torn:?}");
    let fix = PoseFix { time: drive.time(), pose: drive.truth, position_deviation: 0.005, heading_deviation: 0.001 };
    drive.localizer.handle(&Event::SetPose(fix));
    let given = (0..3).map(|_| drive.go(&AHEAD)).last().unwrap();
    assert!(given.reason == Reason::NoLandmarks, "{given:?}");
}

/// One reflector in each of two revolutions is not two, though the scan between them was lost.
#[test]
fn one_reflector_tells_no_pose_though_a_scan_is_lost() {
    let mut drive = Drive::new(true);
    (0..5).for_each(|_| _ = drive.go(&AHEAD));
    (0..2).for_each(|_| _ = drive.go_seeing(&AHEAD, elsewhere));
    drive.in_sight = 1;
    for revolution in 0..3 {
        drive.move_on(&AHEAD);
        drive.see_reflectors();
        let torn = drive.go(&AHEAD);
        assert!(torn.level.position > 1.0, "{revolution}: {torn:?}");
    }
}

#[test]
fn where_landmarks_lead_surfaces_contradict_nothing() {
    let mut drive = Drive::new(true);
    (drive.in_sight, drive.scale) = (3, 0.9);
    for revolution in 0..20 {
        let said = drive.go(&AHEAD);
        assert_eq!(said.mode, Mode::Reflectors, "{revolution}");
        assert_ne!(said.reason, Reason::OdometryDisagrees, "{revolution}");
    }
}

/// A laser that tells nothing does not tell either that the vehicle is pushed.
#[test]
fn the_level_grows_while_the_laser_is_silent() {
    let mut drive = Drive::new(true);
    drive.in_sight = reflectors().len();
    let seen = (0..10).map(|_| drive.go(&Twist::default())).last().unwrap().level;
    let level_after = |drive: &mut Drive, seconds: f64| {
        for _ in 0..(seconds * 1e6) as u64 / INTERVAL {
            drive.revolutions += 1;
            drive.report(&Pose::default());
        }
        drive.localizer.outputs().pose.level
    };
    let soon = level_after(&mut drive, 0.6);
    assert!(soon.position < seen.position + 1e-3, "{seen:?} {soon:?}");
    let later = level_after(&mut drive, 2.4);
    assert!((later.position - seen.position - 0.2).abs() < 0.02, "{seen:?} {later:?}");
    assert!((later.heading - seen.heading - 0.04).abs() < 0.004, "{seen:?} {later:?}");
    let again = drive.go(&Twist::default()).level;
    assert!(again.position < seen.position + 1e-3, "{seen:?} {again:?}");
}
