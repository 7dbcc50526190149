//! The localiser as a whole: what it says of itself, and that nothing from outside can hurt it.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::geometry::Pose;
use agv_core::localizer::{
    CapacitiesOf, Event, Localizer, Mode, OutputPredictor, Parameters, PoseFix, PoseOutput, Reason,
};
use agv_core::maps::{Landmark, LandmarkKind, Verdict};
use agv_core::measurement::{
    EncoderFault, EncoderFaults, EncoderSample, LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan, Time,
};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_core::sensing::{ReflectorDetection, falko};
use proptest::prelude::*;

type Small = Localizer<CapacitiesOf<360, 64, 64, 32>>;

const TICK: f64 = 1e-4;

fn parameters() -> Parameters {
    let vehicle = Vehicle::Tricycle(Tricycle {
        wheelbase: 1.5,
        drive_scale: TICK,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_16,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    });
    Parameters::new(vehicle, Pose::new(0.9, 0.0, 0.0))
}

/// Reflectors in two uneven rows along a straight way.
fn reflectors() -> Vec<Landmark> {
    (0..24u16)
        .map(|id| Landmark {
            id,
            kind: LandmarkKind::Reflector,
            x: f64::from(id) * 3.1 + f64::from(id % 5) * 0.37 - 5.0,
            y: if id % 2 == 0 { 4.0 + f64::from(id % 3) } else { -3.5 - f64::from(id % 4) * 0.6 },
            deviation: 0.002,
        })
        .collect()
}

/// A vehicle that drives straight at 1 m/s from the origin, 100 encoder samples and 8 revolutions a second.
struct Drive {
    localizer: Box<Small>,
    step: u64,
    /// How far the true vehicle is beside what its encoders say, m.
    offset: f64,
    /// Encoder samples for which the vehicle has stood, before it drove.
    stood: u64,
    /// Where the laser really is in R.
    laser: Pose,
}

impl Drive {
    fn start() -> Self {
        let mut localizer = Box::new(Small::new(parameters()));
        localizer.add_landmarks(&reflectors()).unwrap();
        Self { localizer, step: 0, offset: 0.0, stood: 0, laser: *parameters().lasers.first() }
    }

    fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.step * 10_000)
    }

    fn truth(&self, time: Time) -> Pose {
        Pose::new(time.since(Time::from_micros(1_000_000 + self.stood * 10_000)), self.offset, 0.0)
    }

    fn set_pose(&mut self, pose: Pose) -> PoseOutput {
        let fix = PoseFix { time: self.time(), pose, position_deviation: 0.02, heading_deviation: 0.005 };
        self.localizer.handle(&Event::SetPose(fix)).pose
    }

    /// Drives for some revolutions; `sees` says which reflectors are seen, by their ids.
    fn revolutions(&mut self, count: usize, sees: impl Fn(u16) -> bool) -> PoseOutput {
        for _ in 0..count {
            let start = self.travel();
            self.see(start, &sees);
        }
        self.localizer.outputs().pose
    }

    /// Drives for the time of a revolution, and returns when it began.
    fn travel(&mut self) -> Time {
        let start = self.time();
        for _ in 0..12 {
            self.step += 1;
            let drive = ((self.step - self.stood) as f64 * 0.01 / TICK).round() as u32;
            self.localizer.handle(&Event::Encoders(EncoderSample { time: self.time(), drive, steering: 0 }));
        }
        start
    }

    /// Takes the reflectors of the revolution that has just ended.
    fn look(&mut self, sees: impl Fn(u16) -> bool) -> PoseOutput {
        let start = self.time().offset(-0.12);
        self.see(start, &sees);
        self.localizer.outputs().pose
    }

    fn see(&mut self, start: Time, sees: &impl Fn(u16) -> bool) {
        let observations: Vec<_> = reflectors()
            .iter()
            .filter(|reflector| sees(reflector.id))
            .filter_map(|reflector| self.observe(start, reflector))
            .collect();
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    /// A revolution of a vehicle that stands at the origin.
    fn stand(&mut self, sees: impl Fn(u16) -> bool) {
        let start = self.time();
        for _ in 0..12 {
            self.step += 1;
            self.stood += 1;
            self.localizer.handle(&Event::Encoders(EncoderSample { time: self.time(), drive: 0, steering: 0 }));
        }
        let laser = *parameters().lasers.first();
        let observations: Vec<_> = reflectors()
            .iter()
            .filter(|reflector| sees(reflector.id))
            .map(|reflector| laser.inverse_transform(&nalgebra::Vector2::new(reflector.x, reflector.y)))
            .map(|seen| ReflectorObservation {
                time: start.offset(0.06),
                range: seen.norm() as f32,
                bearing: seen.y.atan2(seen.x) as f32,
            })
            .collect();
        self.localizer.handle(&Event::Reflectors(Reflectors::of_first(&observations)));
    }

    fn observe(&self, start: Time, reflector: &Landmark) -> Option<ReflectorObservation> {
        // One look from the middle of the revolution gives the direction, and so the time, well enough.
        let bearing_at = |time: Time| {
            let laser = self.truth(time).compose(&self.laser);
            let seen = laser.inverse_transform(&nalgebra::Vector2::new(reflector.x, reflector.y));
            (seen.norm(), seen.y.atan2(seen.x))
        };
        let turn = bearing_at(start.offset(0.06)).1.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let time = start.offset(0.12 * turn);
        let (range, bearing) = bearing_at(time);
        (range < 12.0).then_some(ReflectorObservation { time, range: range as f32, bearing: bearing as f32 })
    }
}

#[test]
fn nothing_is_said_of_the_pose_before_one_is_given() {
    let mut drive = Drive::start();
    let output = drive.revolutions(3, |_| true);
    assert_eq!((output.mode, output.reason), (Mode::NotLocalised, Reason::NoPose));
    assert!(drive.localizer.outputs().uses.is_empty());
}

#[test]
fn reflectors_correct_a_start_beside_the_truth() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::new(0.04, -0.03, 0.008));
    let output = drive.revolutions(8, |_| true);
    assert_eq!((output.mode, output.reason), (Mode::Reflectors, Reason::None));
    let truth = drive.truth(output.time);
    let error = (output.pose.x - truth.x).hypot(output.pose.y - truth.y);
    assert!(error < 0.004 && output.pose.theta.abs() < 1e-3, "{error} m, {} rad", output.pose.theta);
    assert!(output.acceptance > 0.99 && output.dead_reckoning_distance < 0.2);
}

#[test]
fn a_vehicle_that_stands_among_reflectors_says_when_its_pose_is_good() {
    let mut drive = Drive::start();
    let told = drive.set_pose(Pose::new(0.04, -0.03, 0.008));
    assert!(!told.is_good());
    let mut revolutions = 0;
    while !drive.localizer.outputs().pose.is_good() {
        drive.stand(|id| id < 8);
        revolutions += 1;
        assert!(revolutions < 40, "{:?}", drive.localizer.outputs().pose);
    }
    assert!(revolutions > 1, "one revolution is not enough");
    let pose = drive.localizer.outputs().pose.pose;
    assert!(pose.x.hypot(pose.y) < 0.005 && pose.theta.abs() < 0.524e-3, "{pose:?}");
    // Without reflectors it stays so only for a while.
    assert!(!drive.revolutions(40, |_| false).is_good());
}

#[test]
fn corrections_are_said_and_leave_no_step_in_the_smooth_pose() {
    let mut drive = Drive::start();
    let start = Pose::new(0.04, -0.03, 0.008);
    assert_eq!(drive.set_pose(start).correction, 0.0);
    // Straight on by what the encoders say since their first sample, whatever the reflectors do.
    let smooth = |drive: &Drive| start.compose(&Pose::new((drive.step - 1) as f64 * 0.01, 0.0, 0.0));
    let is_smooth = |drive: &Drive, output: &PoseOutput| {
        let off = smooth(drive).between(&output.smooth);
        off.x.hypot(off.y) < 2.0 * TICK && off.theta.abs() < 1e-9
    };
    drive.revolutions(1, |_| false);
    let before = drive.localizer.outputs().pose;
    assert!(is_smooth(&drive, &before) && before.correction == 0.0 && !before.has_jumped());
    let after = drive.look(|_| true);
    let moved = (after.pose.x - before.pose.x).hypot(after.pose.y - before.pose.y);
    assert!(is_smooth(&drive, &after) && after.has_jumped() && (after.correction - moved).abs() < 1e-9, "{after:?}");
    for _ in 0..20 {
        let output = drive.revolutions(1, |_| true);
        assert!(is_smooth(&drive, &output), "{output:?}");
    }
    assert!(!drive.localizer.outputs().pose.has_jumped());
    // Both together are the pose.
    let output = drive.localizer.outputs().pose;
    let together = output.smooth_offset().compose(&output.smooth);
    assert!((together.x - output.pose.x).hypot(together.y - output.pose.y) < 1e-9);
}

#[test]
fn a_pose_of_a_clock_that_is_ahead_is_given_up_when_the_odometry_speaks() {
    let mut drive = Drive::start();
    drive.revolutions(4, |_| true);
    let last = drive.localizer.outputs().pose;
    let fix =
        PoseFix { time: last.time.offset(5.0), pose: last.pose, position_deviation: 0.01, heading_deviation: 0.003 };
    drive.localizer.handle(&Event::SetPose(fix));
    let said = drive.revolutions(1, |_| false);
    assert_eq!((said.mode, said.reason), (Mode::Lost, Reason::NoPose));
    // One of now is taken.
    let said = drive.set_pose(last.pose);
    assert!(said.time < fix.time && said.mode != Mode::Lost, "{said:?}");
}

#[test]
fn a_jump_is_told_to_who_asks_later() {
    let mut drive = Drive::start();
    let mut predictor: OutputPredictor = OutputPredictor::new(&parameters());
    assert_eq!((drive.localizer.outputs().pose.resets, drive.localizer.outputs().pose.last_reset), (0, 0.0));
    let given = drive.set_pose(Pose::new(0.04, -0.03, 0.008));
    assert_eq!((given.resets, given.last_reset), (1, 0.0));
    let before = drive.revolutions(1, |_| false);
    assert_eq!(before.resets, 1);
    let after = drive.look(|_| true);
    let moved = (after.pose.x - before.pose.x).hypot(after.pose.y - before.pose.y);
    // The encoders say something before anybody asks.
    drive.revolutions(1, |_| false);
    predictor.update(&drive.localizer.outputs().pose, &drive.localizer.odometry_bias());
    for told in [drive.localizer.outputs().pose, predictor.output().unwrap()] {
        assert!(!told.has_jumped() && moved > PoseOutput::NOTABLE_CORRECTION);
        assert_eq!((told.resets, told.last_reset), (2, moved as f32));
    }
    // Small corrections are none.
    assert_eq!(drive.revolutions(20, |_| true).resets, 2);
    let last = drive.localizer.outputs().pose;
    let put = drive.set_pose(Pose { x: last.pose.x + 3.0, y: last.pose.y - 4.0, theta: 0.0 });
    assert!(put.resets == 3 && (put.last_reset - 5.0).abs() < 1e-5, "{put:?}");
    for _ in 0..256 {
        drive.set_pose(Pose::default());
    }
    assert_eq!(drive.localizer.outputs().pose.resets, 3);
}

#[test]
fn every_reflector_is_used_at_its_own_time() {
    // At 1 m/s the vehicle moves 12 cm within a revolution; noise-free observations leave millimetres only if each is
    // taken from where the vehicle was.
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(40, |_| true);
    let worst = drive.localizer.outputs().uses.iter().map(|used| used.residual[0].abs()).fold(0.0, f64::max);
    assert!(worst < 0.003, "{worst} m");
}

#[test]
fn without_landmarks_it_reckons_and_says_how_far() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(8, |_| true);
    let before = drive.localizer.outputs().pose;
    let output = drive.revolutions(40, |_| false);
    assert_eq!((output.mode, output.reason), (Mode::DeadReckoning, Reason::NoLandmarks));
    assert!((output.dead_reckoning_distance - 4.8).abs() < 0.15, "{}", output.dead_reckoning_distance);
    assert!(output.covariance[2] > 4.0 * before.covariance[2]);
    // Landmarks come back: so does the mode.
    assert_eq!(drive.revolutions(4, |_| true).mode, Mode::Reflectors);
    let mut reckoned = Drive::start();
    let mut strict = parameters();
    strict.limits.lost_after = 3.0;
    *reckoned.localizer = Small::new(strict);
    reckoned.set_pose(Pose::default());
    let output = reckoned.revolutions(30, |_| false);
    assert_eq!((output.mode, output.reason), (Mode::Lost, Reason::NoLandmarks));
}

#[test]
fn a_vehicle_that_was_carried_away_is_lost_and_can_be_put_back() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(8, |_| true);
    drive.offset = 0.6;
    let mut revolutions = 0;
    while drive.localizer.outputs().pose.mode != Mode::Lost {
        revolutions += 1;
        assert!(revolutions < 6, "it still believes its pose");
        drive.revolutions(1, |_| true);
    }
    assert_eq!(drive.localizer.outputs().pose.reason, Reason::MotionDisagrees);
    // It stays lost, however well a later scan may fit.
    drive.offset = 0.0;
    assert_eq!(drive.revolutions(4, |_| true).mode, Mode::Lost);
    let here = drive.truth(drive.time());
    drive.set_pose(here);
    assert_eq!(drive.revolutions(4, |_| true).mode, Mode::Reflectors);
}

/// A scan of a revolution that has just ended: of walls without features, and of the reflectors that are seen.
fn scan_of(start: Time, seen: &[ReflectorObservation]) -> (Vec<f32>, Vec<u16>) {
    let mut ranges = vec![0.0; 360];
    let mut intensities = vec![0; 360];
    for one in seen {
        let beam = (one.time.since(start) / BEAM).round() as usize % 360;
        ranges[beam] = one.range;
        intensities[beam] = 200;
    }
    (ranges, intensities)
}

/// Time between two beams of a scan of 360, s.
const BEAM: f64 = 0.12 / 360.0;

fn scan<'a>(start: Time, ranges: &'a [f32], intensities: &'a [u16]) -> Event<'a> {
    let bearing_step = std::f64::consts::TAU / 360.0;
    Event::Scan(Scan {
        laser: LaserId::FIRST,
        start,
        beam_interval: BEAM,
        first_bearing: 0.0,
        bearing_step,
        ranges,
        intensities,
    })
}

#[test]
fn a_vehicle_that_was_carried_away_is_lost_though_each_revolution_has_a_scan_too() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    let revolution = |drive: &mut Drive| {
        let start = drive.time();
        drive.revolutions(1, |_| true);
        let (ranges, _) = scan_of(start, &[]);
        drive.localizer.handle(&scan(start, &ranges, &[])).pose
    };
    for _ in 0..8 {
        assert_eq!(revolution(&mut drive).mode, Mode::Reflectors);
    }
    drive.offset = 0.6;
    let told = (0..6).map(|_| revolution(&mut drive)).find(|output| output.mode == Mode::Lost);
    assert_eq!(told.map(|output| output.reason), Some(Reason::MotionDisagrees));
}

#[test]
fn a_vehicle_that_was_carried_away_is_lost_where_its_reflectors_are_found_in_scans() {
    let mut drive = Drive::start();
    let mut parameters = parameters();
    parameters.reflectors.detection = Some(ReflectorDetection::default());
    // A beam a degree.
    parameters.reflectors.bearing_deviation = 0.01;
    *drive.localizer = Small::new(parameters);
    drive.localizer.add_landmarks(&reflectors()).unwrap();
    drive.set_pose(Pose::default());
    let revolution = |drive: &mut Drive| {
        let start = drive.travel();
        let seen: Vec<_> = reflectors().iter().filter_map(|reflector| drive.observe(start, reflector)).collect();
        let (ranges, intensities) = scan_of(start, &seen);
        drive.localizer.handle(&scan(start, &ranges, &intensities)).pose
    };
    for _ in 0..8 {
        assert_eq!(revolution(&mut drive).mode, Mode::Reflectors);
    }
    drive.offset = 0.6;
    let told = (0..6).map(|_| revolution(&mut drive)).find(|output| output.mode == Mode::Lost);
    assert_eq!(told.map(|output| output.reason), Some(Reason::MotionDisagrees));
}

#[test]
fn a_start_that_is_unsure_is_no_reason_to_doubt_the_laser() {
    // One reflector in sight, so that the way has to show where the vehicle is; beside a well of offsets that the
    // stated deviations allow.
    for step in 0..24_u32 {
        let angle = f64::from(step) * 0.9;
        let (deviation, heading_deviation) = (0.3, 0.05);
        let mut drive = Drive::start();
        let pose =
            Pose::new(1.2 * deviation * angle.cos(), deviation * angle.sin(), heading_deviation * (3.0 * angle).cos());
        let fix = PoseFix { time: drive.time(), pose, position_deviation: deviation, heading_deviation };
        drive.localizer.handle(&Event::SetPose(fix));
        for revolution in 0..80_u16 {
            let seen = 2 + revolution / 20;
            let output = drive.revolutions(1, |id| id == seen);
            assert_ne!(output.reason, Reason::LaserMoved, "{step}, {revolution}");
        }
        let output = drive.localizer.outputs().pose;
        let truth = drive.truth(output.time);
        let error = (output.pose.x - truth.x).hypot(output.pose.y - truth.y);
        assert!(
            output.mode == Mode::Reflectors && error < 0.1,
            "{step}: {error} m, {:?} {:?}",
            output.mode,
            output.reason
        );
    }
}

#[test]
fn after_a_jump_to_the_side_the_laser_is_doubted_if_the_jump_is_sure() {
    for (position_deviation, reason) in [(0.02, Reason::LaserMoved), (0.3, Reason::None)] {
        let mut drive = Drive::start();
        drive.set_pose(Pose::default());
        drive.revolutions(8, |_| true);
        drive.offset = 0.6;
        drive.revolutions(6, |_| true);
        assert_eq!(drive.localizer.outputs().pose.reason, Reason::MotionDisagrees);
        let pose = drive.truth(drive.time());
        let fix = PoseFix { time: drive.time(), pose, position_deviation, heading_deviation: 0.005 };
        drive.localizer.handle(&Event::SetPose(fix));
        assert_eq!(drive.revolutions(4, |_| true).reason, reason);
    }
}

#[test]
fn a_laser_that_looks_askew_is_doubted() {
    for degrees in [-1.0_f64, 1.0] {
        let mut drive = Drive::start();
        drive.laser.theta = degrees.to_radians();
        // By what it sees, the vehicle stands askew.
        drive.set_pose(Pose::new(0.0, 0.0, degrees.to_radians()));
        let is_doubted = (0..40).any(|_| drive.revolutions(1, |_| true).reason == Reason::LaserMoved);
        assert!(is_doubted, "{degrees}: {:?}", drive.localizer.outputs().pose);
    }
}

#[test]
fn what_a_long_way_out_and_back_adds_up_to_is_no_knock() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(8, |_| true);
    // Twelve metres on and twelve back, with nothing to see: it ends where it began, but for what the wheels slid.
    for step in 0..2400 {
        drive.step += 1;
        if step >= 1200 {
            drive.stood += 2;
        }
        let ticks = ((drive.step as f64 - drive.stood as f64) * 0.01 / TICK).round() as u32;
        let sample = EncoderSample { time: drive.time(), drive: ticks, steering: 0 };
        drive.localizer.handle(&Event::Encoders(sample));
    }
    drive.offset = 0.1;
    for _ in 0..10 {
        let output = drive.revolutions(1, |_| true);
        assert_eq!((output.mode, output.reason), (Mode::Reflectors, Reason::None));
    }
}

#[test]
fn some_false_reflectors_change_nothing() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(4, |_| true);
    for index in 0..20 {
        let ghost = ReflectorObservation {
            time: drive.time(),
            range: 2.0 + 0.3 * (index % 7) as f32,
            bearing: 0.9 * (index % 5) as f32 - 1.3,
        };
        let outputs = drive.localizer.handle(&Event::Reflectors(Reflectors::of_first(&[ghost])));
        assert_ne!(outputs.uses[0].verdict, Verdict::Accepted);
        assert_eq!(drive.revolutions(1, |_| true).mode, Mode::Reflectors);
    }
    let output = drive.localizer.outputs().pose;
    assert!((output.pose.x - drive.truth(output.time).x).abs() < 0.003);
}

#[test]
fn an_impossible_motion_is_said_and_not_believed() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(4, |_| true);
    let before = drive.localizer.outputs().pose;
    drive.step += 1;
    let jump = EncoderSample { time: drive.time(), drive: 90_000, steering: 0 };
    let output = drive.localizer.handle(&Event::Encoders(jump)).pose;
    assert_eq!(output.reason, Reason::OdometryImplausible);
    assert!((output.pose.x - before.pose.x - 0.01).abs() < 0.002);
}

#[test]
fn an_encoder_fault_is_a_mode_whose_uncertainty_covers_what_the_vehicle_does() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    let before = drive.revolutions(4, |_| true);
    let last_step = drive.step;
    let mut output = before;
    // The true vehicle brakes to a standstill with 2 m/s^2 when its encoder fails.
    let mut way = 0.0;
    for step in 1..=40 {
        drive.step += 1;
        let elapsed = f64::from(step) * 0.01;
        way = elapsed - elapsed * elapsed;
        let faults = EncoderFaults { time: drive.time(), drive: Some(EncoderFault::Missing), steering: None };
        output = drive.localizer.handle(&Event::EncoderFaults(faults)).pose;
        assert_eq!((output.mode, output.reason), (Mode::WithoutOdometry, Reason::DriveEncoder));
        assert_eq!(output.time, drive.time());
        let error = (output.pose.x - before.pose.x - way).abs();
        assert!(error <= 3.0 * output.covariance[0].sqrt(), "{step}: {error}");
    }
    assert!(output.covariance[0].sqrt() < 0.2);
    // Sound samples again, the counter having stood still or not: no way is invented.
    let base = (last_step as f64 * 0.01 / TICK).round() as u32 + 77_777;
    for _ in 0..2 {
        drive.step += 1;
        let sample = EncoderSample { time: drive.time(), drive: base, steering: 0 };
        output = drive.localizer.handle(&Event::Encoders(sample)).pose;
    }
    assert_eq!((output.mode, output.reason), (Mode::Reflectors, Reason::None));
    assert!((output.pose.x - before.pose.x - way).abs() <= 3.0 * output.covariance[0].sqrt());
    assert!(output.pose.x - before.pose.x < 0.42);
}

#[test]
fn the_predictor_says_at_once_what_the_localiser_will_say() {
    let mut drive = Drive::start();
    let mut predictor: OutputPredictor = OutputPredictor::new(&parameters());
    let sample = |step: u64| EncoderSample {
        time: Time::from_micros(1_000_000 + step * 10_000),
        drive: (step as f64 * 0.01 / TICK).round() as u32,
        steering: (step % 7) as u32,
    };
    assert_eq!(predictor.output(), None);
    drive.localizer.handle(&Event::Encoders(sample(0)));
    predictor.encoders(&sample(0));
    drive.set_pose(Pose::new(0.1, -0.2, 0.3));
    predictor.update(&drive.localizer.outputs().pose, &drive.localizer.odometry_bias());
    let mut pending = Vec::new();
    for step in 1..200 {
        predictor.encoders(&sample(step));
        pending.push(sample(step));
        let said = predictor.output().unwrap();
        // A localiser that is never busy.
        let mut quick = drive.localizer.clone();
        for sample in &pending {
            quick.handle(&Event::Encoders(*sample));
        }
        let expected = quick.outputs().pose;
        assert_eq!(said.pose, expected.pose, "{step}");
        assert_eq!((said.time, said.covariance), (expected.time, expected.covariance));
        assert!((said.dead_reckoning_distance - expected.dead_reckoning_distance).abs() < 1e-9);
        // The true one is behind by up to 13 samples.
        if step % 13 == 0 {
            for sample in pending.drain(..) {
                drive.localizer.handle(&Event::Encoders(sample));
            }
            predictor.update(&drive.localizer.outputs().pose, &drive.localizer.odometry_bias());
        }
    }
    let faults = EncoderFaults { time: sample(200).time, drive: None, steering: Some(EncoderFault::Late) };
    predictor.doubt_encoders(&faults);
    let said = predictor.output().unwrap();
    assert_eq!((said.mode, said.reason), (Mode::WithoutOdometry, Reason::SteeringEncoder));
}

#[test]
fn the_same_events_give_the_same_bits() {
    let outputs = || {
        let mut drive = Drive::start();
        drive.set_pose(Pose::new(0.04, -0.03, 0.008));
        (0..10).map(|_| drive.revolutions(1, |id| id % 3 != 0)).collect::<Vec<_>>()
    };
    let (first, second) = (outputs(), outputs());
    for (a, b) in first.iter().zip(&second) {
        assert_eq!(a.pose.x.to_bits(), b.pose.x.to_bits());
        assert_eq!(a.covariance.map(f64::to_bits), b.covariance.map(f64::to_bits));
    }
}

/// Any number that a sensor might say, sensible or not.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -50.0f64..50.0,
        1 => any::<f64>(),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(0.0), Just(f64::MAX)],
    ]
}

#[derive(Clone, Debug)]
enum Anything {
    Encoders(u64, u32, u32),
    EncoderFaults(u64, bool, bool),
    Reflectors(Vec<(u64, f32, f32)>),
    Scan(u64, f64, f64, f64, Vec<f32>),
    SetPose(u64, f64, f64, f64, f64, f64),
}

fn any_time() -> impl Strategy<Value = u64> {
    prop_oneof![8 => 0u64..3_000_000, 1 => any::<u64>()]
}

fn anything() -> impl Strategy<Value = Anything> {
    let single = || any_number().prop_map(|number| number as f32);
    prop_oneof![
        6 => (any_time(), any::<u32>(), any::<u32>()).prop_map(|(t, d, s)| Anything::Encoders(t, d, s)),
        4 => (0u64..3_000_000, 0u32..3_000, 0u32..600).prop_map(|(t, d, s)| Anything::Encoders(t, d, s)),
        2 => (any_time(), any::<bool>(), any::<bool>()).prop_map(|(t, d, s)| Anything::EncoderFaults(t, d, s)),
        3 => proptest::collection::vec((any_time(), single(), single()), 0..20)
            .prop_map(Anything::Reflectors),
        2 => (any_time(), any_number(), any_number(), -0.1f64..0.1, proptest::collection::vec(single(), 0..400))
            .prop_map(|(t, interval, first, step, ranges)| Anything::Scan(t, interval, first, step, ranges)),
        1 => (any_time(), any_number(), any_number(), any_number(), any_number(), any_number())
            .prop_map(|(t, x, y, theta, p, h)| Anything::SetPose(t, x, y, theta, p, h)),
    ]
}

proptest! {
    #[test]
    fn no_sequence_of_events_breaks_the_pose(events in proptest::collection::vec(anything(), 1..60)) {
        let mut parameters = parameters();
        parameters.maps.dynamic = true;
        let mut localizer = Box::new(Small::new(parameters));
        localizer.add_landmarks(&reflectors()).unwrap();
        let first = PoseFix {
            time: Time::from_micros(0), pose: Pose::default(), position_deviation: 0.1, heading_deviation: 0.05,
        };
        localizer.handle(&Event::SetPose(first));
        for event in &events {
            let observations: Vec<ReflectorObservation>;
            let event = match event {
                Anything::Encoders(time, drive, steering) => Event::Encoders(EncoderSample {
                    time: Time::from_micros(*time), drive: *drive, steering: *steering,
                }),
                Anything::EncoderFaults(time, drive, steering) => Event::EncoderFaults(EncoderFaults {
                    time: Time::from_micros(*time),
                    drive: drive.then_some(EncoderFault::Missing),
                    steering: steering.then_some(EncoderFault::Frozen),
                }),
                Anything::Reflectors(seen) => {
                    observations = seen.iter().map(|&(time, range, bearing)| ReflectorObservation {
                        time: Time::from_micros(time), range, bearing,
                    }).collect();
                    Event::Reflectors(Reflectors::of_first(&observations))
                }
                Anything::Scan(start, beam_interval, first_bearing, bearing_step, ranges) => Event::Scan(Scan {
laser: LaserId::FIRST,
                    start: Time::from_micros(*start),
                    beam_interval: *beam_interval,
                    first_bearing: *first_bearing,
                    bearing_step: *bearing_step,
                    ranges,
                    intensities: &[],
                }),
                Anything::SetPose(time, x, y, theta, position_deviation, heading_deviation) => {
                    Event::SetPose(PoseFix {
                        time: Time::from_micros(*time),
                        pose: Pose { x: *x, y: *y, theta: *theta },
                        position_deviation: *position_deviation,
                        heading_deviation: *heading_deviation,
                    })
                }
            };
            let output = localizer.handle(&event).pose;
            let [xx, xy, yy, xt, yt, tt] = output.covariance;
            prop_assert!(output.pose.is_finite(), "{:?}", output);
            prop_assert!([xx, xy, yy, xt, yt, tt].iter().all(|entry| entry.is_finite()), "{:?}", output);
            prop_assert!(xx >= 0.0 && yy >= 0.0 && tt >= 0.0);
            // Below the smallest normal number products have no precision left.
            prop_assert!(xx * yy - xy * xy >= -1e-9 * xx * yy - f64::MIN_POSITIVE);
            prop_assert!(localizer.dynamic_landmarks().len() <= 32);
        }
    }
}

#[test]
fn all_of_its_memory_fits_a_controller() {
    // What the STM32H743's largest RAM, 512 KiB, has for it.
    let size = size_of::<Localizer>();
    println!("{size} bytes");
    assert!(size <= 352 * 1024, "{size} bytes");
}

#[test]
fn a_given_heading_of_many_turns_is_said_as_one_of_none() {
    let mut drive = Drive::start();
    let output = drive.set_pose(Pose { x: 1.0, y: 2.0, theta: 1000.0 });
    assert_eq!(output.pose, Pose::new(1.0, 2.0, 1000.0));
    assert!(output.pose.theta.abs() < 3.2);
}

#[test]
fn an_increment_of_more_than_half_a_turn_is_no_motion() {
    let mut parameters = parameters();
    parameters.vehicle = Vehicle::Increments;
    for theta in [f64::MAX, -1e3, 3.15] {
        let mut localizer = Box::new(Small::new(parameters));
        let time = |step: u64| Time::from_micros(1_000_000 + step * 10_000);
        let pose = Pose::new(1.0, 2.0, 0.5);
        let fix = PoseFix { time: time(0), pose, position_deviation: 0.02, heading_deviation: 0.005 };
        localizer.handle(&Event::SetPose(fix));
        for (step, theta) in [(0, 0.0), (1, theta)] {
            let displacement = Pose { x: 0.001, y: 0.0, theta };
            localizer.handle(&Event::Increment(PoseIncrement { time: time(step), displacement }));
        }
        let output = localizer.outputs().pose;
        assert_eq!((output.mode, output.reason), (Mode::WithoutOdometry, Reason::OdometryImplausible));
        assert_eq!(output.pose, pose);
    }
}

#[test]
fn a_vehicle_that_is_lost_learns_no_landmarks() {
    let mut drive = Drive::start();
    let mut parameters = parameters();
    parameters.maps.dynamic = true;
    parameters.features.detector = falko::Parameters::thesis();
    parameters.limits.lost_after = 2.0;
    *drive.localizer = Small::new(parameters);
    drive.set_pose(Pose::default());
    // A square room of 5 m whose corners are seen.
    let ranges: Vec<f32> = (0..360)
        .map(|degree| f64::from(degree).to_radians())
        .map(|angle| (2.5 / angle.cos().abs().max(angle.sin().abs())) as f32)
        .collect();
    let look = |drive: &mut Drive| {
        let start = drive.travel();
        drive.localizer.handle(&scan(start, &ranges, &[]));
    };
    look(&mut drive);
    let learnt = drive.localizer.dynamic_landmarks().to_vec();
    assert!(!learnt.is_empty());
    drive.revolutions(30, |_| false);
    assert_eq!(drive.localizer.outputs().pose.mode, Mode::Lost);
    look(&mut drive);
    assert_eq!(drive.localizer.dynamic_landmarks(), learnt);
}
