//! What a localiser makes of a gyro in drives.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localize, Localizer, Misuse, Mode, PoseFix, Reason};
use agv_core::maps::Landmark;
use agv_core::measurement::{GyroSample, Time, WheelReading, WheelSample};
use agv_core::odometry::{GyroErrors, GyroParameters};

use super::drive::{Drive, Wrong, fitted, parameters};
use super::random::FITTED;

#[test]
fn a_standing_vehicle_learns_the_bias() {
    let mut drive = fitted(1);
    drive.sees = false;
    drive.stand(30.0);
    let errors = drive.localizer.gyro_errors().unwrap();
    // 0.005 deg/s/sqrt(Hz) over 29.5 s.
    assert!((errors.bias - drive.bias).abs() < 4.0 * 8.7e-5 / 29.5_f64.sqrt(), "{errors:?}");
    assert!(drive.heading_error().abs() < 1e-9, "a vehicle that stands does not turn");
    assert_eq!(drive.said().reason, Reason::NoLandmarks);
}

#[test]
fn landmarks_teach_a_driving_vehicle_bias_and_scale() {
    let mut drive = fitted(2);
    for turn in [0.4, -0.4, 0.4, -0.4] {
        drive.go(16.0, 0.6, turn, |_| false);
    }
    let errors = drive.localizer.gyro_errors().unwrap();
    assert!((errors.bias - drive.bias).abs() < 3e-4, "{errors:?}");
    assert!((errors.scale - drive.scale).abs() < 1e-3, "{errors:?}");
    assert!(drive.heading_error().abs() < 2e-3, "{} {:?}", drive.heading_error(), drive.said());
    let said = drive.said();
    assert_eq!((said.mode, said.reason), (Mode::Reflectors, Reason::None));
}

#[test]
fn without_landmarks_the_heading_is_the_gyros() {
    for seed in 3..9 {
        let mut drive = fitted(seed);
        drive.stand(40.0);
        let before = drive.heading_error();
        drive.sees = false;
        drive.go(12.0, 1.0, 0.02, |_| false);
        let grown = (drive.heading_error() - before).to_degrees();
        assert!(grown.abs() < 0.1, "{seed}: {grown} deg");
        let mut wheels = Drive::new(seed, GyroParameters { is_fitted: false, ..FITTED });
        wheels.stand(40.0);
        let before = wheels.heading_error();
        wheels.sees = false;
        wheels.go(12.0, 1.0, 0.02, |_| false);
        let by_wheels = (wheels.heading_error() - before).to_degrees();
        assert!(by_wheels.abs() > 0.5, "the wheels alone are off by what their sizes differ: {by_wheels} deg");
    }
}

#[test]
fn slip_of_a_wheel_is_told_within_three_tenths_of_a_metre_and_ends() {
    for seed in 10..20 {
        let mut drive = fitted(seed);
        drive.stand(5.0);
        drive.go(4.0, 0.8, 0.1, |drive| {
            assert!(!matches!(drive.said().reason, Reason::WheelsSlip | Reason::GyroFault), "{:?}", drive.said());
            false
        });
        drive.sees = false;
        drive.wrong.slip = 0.2;
        let heading = drive.heading_error();
        let from = drive.truth;
        assert!(drive.go(1.0, 0.8, 0.0, |drive| drive.said().reason == Reason::WheelsSlip));
        let way = from.between(&drive.truth).x;
        assert!(way <= 0.3, "{seed}: told after {way} m");
        drive.go(1.0, 0.8, 0.0, |_| false);
        assert!((drive.heading_error() - heading).abs() < 2e-3, "the gyro is believed");
        let bound = drive.said().level.heading;
        assert!(drive.heading_error().abs() < bound, "{bound}");
        drive.wrong.slip = 0.0;
        drive.sees = true;
        drive.go(3.0, 0.8, 0.0, |_| false);
        assert_ne!(drive.said().reason, Reason::WheelsSlip, "{:?}", drive.said());
    }
}

#[test]
fn a_gyro_that_fails_is_told_and_the_wheels_are_believed() {
    let failures = [
        Wrong { is_frozen: true, ..Wrong::default() },
        Wrong { is_silent: true, ..Wrong::default() },
        Wrong { is_clipped: true, ..Wrong::default() },
    ];
    for wrong in failures {
        let mut drive = fitted(30);
        drive.stand(5.0);
        drive.go(2.0, 0.8, 0.0, |_| false);
        drive.sees = false;
        drive.wrong = wrong;
        let heading = drive.heading_error();
        assert!(drive.go(0.3, 0.8, 0.2, |drive| drive.said().reason == Reason::GyroFault), "{:?}", drive.said());
        drive.go(4.0, 0.8, 0.2, |_| false);
        // A tenth of a second of a wrong rate, and what the wheels' sizes differ on 3.4 m.
        assert!((drive.heading_error() - heading).abs() < 0.02 + 0.006 + 0.01, "{}", drive.heading_error());
        assert!(drive.heading_error().abs() < drive.said().level.heading);
        drive.wrong = Wrong::default();
        drive.go(2.0, 0.8, 0.0, |_| false);
        assert_ne!(drive.said().reason, Reason::GyroFault);
    }
}

#[test]
fn a_bias_that_jumps_is_bounded_while_driving_and_told_at_rest() {
    let mut drive = fitted(40);
    drive.stand(20.0);
    drive.go(5.0, 0.8, 0.0, |_| false);
    drive.sees = false;
    drive.wrong.jump = 0.5_f64.to_radians();
    drive.go(8.0, 0.8, 0.0, |drive| {
        let (error, level) = (drive.heading_error().abs(), drive.said().level.heading);
        assert!(error < level, "{error} {level}");
        false
    });
    let before = drive.heading_error();
    assert!(before.abs() > 0.05, "it has turned the pose: {before}");
    assert!(drive.go(2.0, 0.0, 0.0, |drive| drive.said().reason == Reason::GyroFault), "{:?}", drive.said());
    drive.stand(3.0);
    let errors = drive.localizer.gyro_errors().unwrap();
    assert!((errors.bias - drive.bias - drive.wrong.jump).abs() < 3e-4, "{errors:?}");
}

#[test]
fn a_gyro_that_is_switched_off_changes_no_bit() {
    let poses = |gyro: GyroParameters, is_on: bool| {
        let mut drive = fitted(50);
        let mut parameters = parameters(gyro);
        parameters.sources.gyro = is_on;
        *drive.localizer = Localizer::new(parameters);
        let landmarks: Vec<Landmark> =
            drive.reflectors.iter().zip(0..).map(|(place, id)| Landmark::reflector(id, *place, 0.002)).collect();
        drive.localizer.add_landmarks(&landmarks).unwrap();
        let fix = PoseFix { time: drive.now(), pose: drive.truth, position_deviation: 0.02, heading_deviation: 0.01 };
        drive.localizer.handle(&Event::SetPose(fix));
        let mut poses = Vec::new();
        drive.go(3.0, 0.8, 0.2, |drive| {
            poses.push(drive.said());
            false
        });
        poses
    };
    let without = poses(GyroParameters { is_fitted: false, ..FITTED }, true);
    assert_eq!(without, poses(FITTED, false));
    assert_ne!(without, poses(FITTED, true));
}

#[test]
fn a_gyro_that_nobody_knows_is_a_misuse() {
    let mut drive = Drive::new(60, GyroParameters::default());
    let time = drive.now().offset(0.01);
    assert_eq!(drive.localizer.handle(&Event::Gyro(GyroSample { time, rate: 0.0 })).misuse, Some(Misuse::WrongVehicle));
}

/// What a controller sees of the localiser that it was lent.
#[test]
fn a_localiser_that_was_lent_says_what_it_has_learned_of_the_gyro() {
    fn errors(localizer: impl Localize) -> Option<GyroErrors> {
        localizer.prediction_state().gyro
    }
    for is_fitted in [false, true] {
        let mut localizer: Box<Localizer> =
            Box::new(Localizer::new(parameters(GyroParameters { is_fitted, ..FITTED })));
        for step in 0..200 {
            let time = Time::from_micros(1_000_000 + 10_000 * step);
            localizer.handle(&Event::Gyro(GyroSample { time, rate: 0.004 + 1e-5 * (step % 3) as f64 }));
            localizer.handle(&Event::Wheels(WheelSample { time, wheels: [WheelReading::default(); 4] }));
            if step == 2 {
                let pose = Pose::default();
                localizer.handle(&Event::SetPose(PoseFix {
                    time,
                    pose,
                    position_deviation: 0.01,
                    heading_deviation: 0.01,
                }));
            }
        }
        let learned = localizer.gyro_errors();
        assert_eq!(learned.is_some(), is_fitted);
        assert!(learned.is_none_or(|learned| (learned.bias - 0.00401).abs() < 2e-4), "{learned:?}");
        assert_eq!(errors(&mut *localizer), learned);
    }
}

/// What the turns of the way behind have in common with the bias says nothing of a pose that somebody gives.
#[test]
fn a_given_pose_that_is_wrong_teaches_the_gyro_nothing() {
    let mut drive = fitted(4);
    drive.sees = false;
    drive.go(10.0, 0.5, 0.3, |_| false);
    let pose = Pose { theta: drive.truth.theta + 0.05, ..drive.truth };
    let fix = PoseFix { time: drive.now(), pose, position_deviation: 0.05, heading_deviation: 0.09 };
    drive.localizer.handle(&Event::SetPose(fix));
    let before = drive.localizer.gyro_errors().unwrap();
    drive.revolve();
    let after = drive.localizer.gyro_errors().unwrap();
    assert!(drive.heading_error().abs() < 0.02, "the heading is put right: {}", drive.heading_error());
    assert!(
        (after.bias - before.bias).abs() < 1e-6 && (after.scale - before.scale).abs() < 1e-6,
        "{before:?} {after:?}"
    );
}

/// Whether a vehicle without odometry stands, nobody knows.
#[test]
fn while_the_wheels_tell_nothing_no_bias_is_learnt() {
    use agv_core::measurement::{EncoderFault, EncoderFaults};
    let mut drive = fitted(5);
    drive.sees = false;
    drive.stand(5.0);
    let mut before = None;
    for step in 1..=20 {
        let time = drive.now().offset(0.01 * f64::from(step));
        let faults = EncoderFaults { time, drive: Some(EncoderFault::Late), steering: None };
        drive.localizer.handle(&Event::EncoderFaults(faults));
        before = before.or(drive.localizer.gyro_errors());
        let rate = drive.told + 1e-4 * f64::from(step % 2);
        drive.localizer.handle(&Event::Gyro(GyroSample { time: time.offset(0.005), rate }));
    }
    assert_eq!(before, drive.localizer.gyro_errors());
}

/// A vehicle that turns on the spot as slowly as the bias may be does not stand.
#[test]
fn a_slow_turn_is_not_taken_for_the_bias() {
    let mut drive = fitted(6);
    drive.sees = false;
    drive.go(2.0, 0.3, 0.0, |_| false);
    let before = drive.localizer.gyro_errors().unwrap().bias;
    drive.go(10.0, 0.0, 0.01, |_| false);
    let after = drive.localizer.gyro_errors().unwrap().bias;
    assert!((after - before).abs() < 1e-3, "{before} {after}");
}
