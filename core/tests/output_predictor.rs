//! The pose for now from the localiser's last one and the motions since, worked out step by step.

use agv_core::filter::Ekf;
use agv_core::geometry::Pose;
use agv_core::localizer::{Mode, OutputPredictor, Parameters, PoseOutput, PredictionState, Reason};
use agv_core::measurement::{EncoderFault, EncoderFaults, EncoderSample, Time};
use agv_core::odometry::{CounterRange, Motion, Tricycle, Vehicle};
use nalgebra::Matrix3;

fn parameters() -> Parameters {
    let vehicle = Vehicle::Tricycle(Tricycle {
        wheelbase: 1.5,
        drive_scale: 1e-4,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_16,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    });
    Parameters::new(vehicle, Pose::new(0.9, 0.0, 0.0))
}

fn time(micros: u64) -> Time {
    Time::from_micros(1_000_000 + micros)
}

fn sample(step: u64) -> EncoderSample {
    EncoderSample { time: time(10_000 * step), drive: (step * (90 + step)) as u32, steering: (20 * step) as u32 }
}

/// The motions between the samples.
fn motions(count: u64) -> Vec<Motion> {
    let Parameters { vehicle, odometry_noise, integration, .. } = parameters();
    let Vehicle::Tricycle(tricycle) = vehicle else { return Vec::new() };
    (1..=count)
        .map(|step| {
            let angle = |step: u64| 0.02 * step as f64;
            let ticks = sample(step).drive - sample(step - 1).drive;
            let control = agv_core::odometry::Control {
                distance: 1e-4 * f64::from(ticks),
                steering_start: angle(step - 1),
                steering_end: angle(step),
            };
            Motion {
                start: sample(step - 1).time,
                end: sample(step).time,
                displacement: control.displacement(tricycle.wheelbase, integration),
                covariance: odometry_noise.of_control(&control, tricycle.wheelbase, 0.01),
                distance: control.distance,
            }
        })
        .collect()
}

fn base(at: Time) -> PoseOutput {
    let output =
        PoseOutput { normalised_square: 1.7, ..super::pose_output::sure_of([4e-4, 1e-4, 3e-4, 1e-5, -2e-5, 1e-4]) };
    let (pose, smooth) = (Pose::new(2.0, 1.0, 0.4), Pose::new(1.5, 1.2, 0.3));
    PoseOutput { time: at, pose, smooth, dead_reckoning_distance: 0.1, correction: 0.004, acceptance: 0.8, ..output }
}

fn predictor(count: u64) -> OutputPredictor {
    let mut predictor = OutputPredictor::new(&parameters());
    for step in 0..=count {
        predictor.encoders(&sample(step));
    }
    predictor
}

fn assert_is(said: Option<PoseOutput>, base: &PoseOutput, since: &[Motion]) {
    let [xx, xy, yy, xh, yh, hh] = base.covariance;
    let covariance = Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh);
    let mut state = Ekf::with_covariance(base.pose, &covariance);
    for motion in since {
        state.predict(motion);
    }
    let Some(said) = said else { return assert_eq!(said, Some(*base)) };
    let off = state.pose.between(&said.pose);
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{:?} {:?}", said.pose, state.pose);
    for (said, expected) in said.covariance.iter().zip(state.covariance_entries()) {
        assert!((said - expected).abs() < 1e-15);
    }
    // The smooth pose moves as the pose does.
    let off = base.pose.between(&said.pose).between(&base.smooth.between(&said.smooth));
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{off:?}");
    let way: f64 = since.iter().map(|motion| motion.distance).sum();
    assert_eq!(said.time, since.last().map_or(base.time, |motion| motion.end));
    // The bound grows with what is less sure, and never shrinks.
    let larger =
        |entries: &[f64; 6]| 0.5 * (entries[0] + entries[2]) + (0.5 * (entries[0] - entries[2])).hypot(entries[1]);
    let [before, after] = [&base.covariance, &said.covariance].map(|entries| larger(entries).sqrt());
    let grown = (7.45 * (after - before)).max(0.0) + base.level.heading * way;
    // Of a motion that is partly known all of the distance counts.
    let more = said.level.position - base.level.position - grown;
    assert!((-1e-9..0.011 * base.level.heading).contains(&more), "{:?} {grown}", said.level);
    let grown = 7.15 * (said.covariance[5].sqrt() - base.covariance[5].sqrt());
    assert!((said.level.heading - base.level.heading - grown).abs() < 1e-9, "{:?} {grown}", said.level);
    let PoseOutput { pose, covariance, smooth, time, dead_reckoning_distance, level, .. } = said;
    assert!((dead_reckoning_distance - 0.1 - way).abs() < 0.011, "{dead_reckoning_distance} {way}");
    assert_eq!(said, PoseOutput { pose, covariance, smooth, time, dead_reckoning_distance, level, ..*base });
}

#[test]
fn motions_behind_the_pose_are_added_and_those_before_are_not() {
    let all = motions(12);
    for behind in 0..=12 {
        let mut predictor = predictor(12);
        let base = base(sample(behind).time);
        predictor.update(&base, &PredictionState::default());
        assert_is(predictor.output(), &base, &all[behind as usize..]);
        // And samples that come later.
        predictor.encoders(&sample(13));
        let all = motions(13);
        assert_is(predictor.output(), &base, &all[behind as usize..]);
    }
}

#[test]
fn of_a_motion_that_is_partly_known_the_rest_counts() {
    let all = motions(12);
    let mut predictor = predictor(12);
    let base = base(time(74_000));
    predictor.update(&base, &PredictionState::default());
    let mut since = vec![all[7].split(base.time).1];
    since.extend(&all[8..]);
    assert_is(predictor.output(), &base, &since);
    // A pose that is newer than all samples is said as it is.
    let ahead = PoseOutput { time: time(125_000), ..base };
    predictor.update(&ahead, &PredictionState::default());
    assert_is(predictor.output(), &ahead, &[]);
}

#[test]
fn it_forgets_no_motion_when_there_are_more_than_it_has_room_for() {
    let mut predictor: OutputPredictor<5> = OutputPredictor::new(&parameters());
    for step in 0..=12 {
        predictor.encoders(&sample(step));
    }
    assert_eq!(predictor.output(), None, "the localiser has said nothing");
    let base = base(sample(0).time);
    predictor.update(&base, &PredictionState::default());
    let said = predictor.output().unwrap();
    let all = motions(12);
    let expected = all.iter().fold(base.pose, |pose, motion| pose.compose(&motion.displacement));
    let off = expected.between(&said.pose);
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{:?} {expected:?}", said.pose);
    let way: f64 = all.iter().map(|motion| motion.distance).sum();
    assert!((said.dead_reckoning_distance - 0.1 - way).abs() < 1e-9);
}

#[test]
fn a_fault_of_an_encoder_is_said_until_the_next_sample() {
    let late = Some(EncoderFault::Late);
    for (drive, steering, reason) in
        [(late, None, Reason::DriveEncoder), (None, late, Reason::SteeringEncoder), (late, late, Reason::DriveEncoder)]
    {
        for (mode, is_localised) in [
            (Mode::NotLocalised, false),
            (Mode::Lost, false),
            (Mode::Reflectors, true),
            (Mode::Degraded, true),
            (Mode::DeadReckoning, true),
        ] {
            let mut predictor = predictor(4);
            predictor.update(&PoseOutput { mode, ..base(sample(4).time) }, &PredictionState::default());
            let said = |predictor: &OutputPredictor| predictor.output().map(|output| (output.mode, output.reason));
            assert_eq!(said(&predictor), Some((mode, Reason::None)));
            predictor.doubt_encoders(&EncoderFaults { time: time(45_000), drive, steering });
            let expected = if is_localised { (Mode::WithoutOdometry, reason) } else { (mode, Reason::None) };
            assert_eq!(said(&predictor), Some(expected), "{mode:?}");
            // What the counters did meanwhile is no motion: it goes on as before, by 5 ms until the fault, and by 45 ms until the next sample.
            let x = |predictor: &OutputPredictor| predictor.output().map_or(f64::NAN, |output| output.pose.x);
            let (first, before) = (base(sample(4).time).pose.x, x(&predictor));
            predictor.encoders(&sample(9));
            assert_eq!(said(&predictor), Some((mode, Reason::None)));
            let after = x(&predictor);
            assert!(
                before > first && ((after - before) / (before - first) - 9.0).abs() < 0.1,
                "{first} {before} {after}"
            );
            predictor.encoders(&sample(10));
            assert!(x(&predictor) > after);
        }
    }
    // That nothing is wrong interrupts nothing.
    let mut predictor = predictor(4);
    let base = base(sample(4).time);
    predictor.update(&base, &PredictionState::default());
    predictor.doubt_encoders(&EncoderFaults::default());
    predictor.encoders(&sample(5));
    assert_is(predictor.output(), &base, &motions(5)[4..]);
}

#[test]
fn a_pose_that_rests_on_landmarks_is_dead_reckoning_from_half_a_metre_on() {
    let mut parameters = parameters();
    parameters.limits.dead_reckoning_from = 0.5;
    for mode in [Mode::Reflectors, Mode::Features, Mode::Mixed, Mode::Degraded, Mode::Lost] {
        let mut predictor: OutputPredictor = OutputPredictor::new(&parameters);
        predictor.encoders(&sample(0));
        let base = PoseOutput { mode, dead_reckoning_distance: 0.45, ..base(sample(0).time) };
        predictor.update(&base, &PredictionState::default());
        // 5 cm more are 500 ticks: sample 5 is at 475, and sample 6 at 576.
        for step in 1..=12 {
            predictor.encoders(&sample(step));
            let rests = matches!(mode, Mode::Reflectors | Mode::Features | Mode::Mixed);
            let expected =
                if rests && step > 5 { (Mode::DeadReckoning, Reason::NoLandmarks) } else { (mode, Reason::None) };
            let said = predictor.output().map(|output| (output.mode, output.reason));
            assert_eq!(said, Some(expected), "sample {step}");
        }
    }
}

#[test]
fn speeds_and_increments_move_the_pose_from_the_first_output_on() {
    use agv_core::measurement::{PoseIncrement, SpeedSample};
    use agv_core::odometry::TricycleSpeed;
    let laser = Pose::new(0.9, 0.0, 0.0);
    let mut predictor: OutputPredictor = OutputPredictor::new(&Parameters::new(Vehicle::Increments, laser));
    let step = Pose::new(0.01, 0.0, 0.002);
    let increment = |number: u64| PoseIncrement { time: time(10_000 * number), displacement: step };
    predictor.increment(&increment(0));
    assert!(!predictor.has_output() && predictor.output().is_none());
    predictor.update(&base(time(0)), &PredictionState::default());
    assert!(predictor.has_output());
    predictor.increment(&increment(1));
    let off = base(time(0)).pose.compose(&step).between(&predictor.output().expect("there is one").pose);
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{off:?}");

    let vehicle = TricycleSpeed { wheelbase: 1.5, steering_offset: 0.0 };
    let mut predictor: OutputPredictor = OutputPredictor::new(&Parameters::new(Vehicle::TricycleSpeed(vehicle), laser));
    let sample = |number: u64| SpeedSample { time: time(10_000 * number), speed: 0.8, steering: 0.0 };
    predictor.speed(&sample(0));
    predictor.update(&base(time(0)), &PredictionState::default());
    predictor.speed(&sample(1));
    let off = base(time(0)).pose.between(&predictor.output().expect("there is one").pose);
    assert!((off.x - 8e-3).abs() < 1e-12 && off.y.abs() < 1e-12 && off.theta.abs() < 1e-12, "{off:?}");
}

#[test]
fn at_the_limit_of_dead_reckoning_itself_the_pose_rests_on_landmarks() {
    let mut parameters = parameters();
    parameters.limits.dead_reckoning_from = 0.5;
    for (distance, mode) in [(0.5, Mode::Reflectors), (0.5000001, Mode::DeadReckoning)] {
        let mut predictor: OutputPredictor = OutputPredictor::new(&parameters);
        predictor.encoders(&sample(0));
        let base = PoseOutput { mode: Mode::Reflectors, dead_reckoning_distance: distance, ..base(sample(0).time) };
        predictor.update(&base, &PredictionState::default());
        assert_eq!(predictor.output().map(|output| output.mode), Some(mode), "{distance}");
    }
}

/// What is published before anybody listens to the log rests on no event that the log lacks.
#[test]
fn faults_carry_no_pose_on_that_nobody_knows() {
    let mut predictor: OutputPredictor = OutputPredictor::new(&parameters());
    let unknown = PoseOutput { mode: Mode::NotLocalised, reason: Reason::NoPose, ..base(Time::default()) };
    predictor.update(&unknown, &PredictionState::default());
    for step in 0..200 {
        predictor.doubt_encoders(&EncoderFaults {
            time: time(10_000 * step),
            drive: Some(EncoderFault::Missing),
            steering: None,
        });
    }
    assert_eq!(predictor.output(), Some(unknown));
}
