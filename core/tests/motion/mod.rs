//! What the localiser makes of the vehicle's motion: at every rate, with gaps, with poses that are told late, and what is
//! published meanwhile.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

mod drive;

use self::drive::{Drive, KINDS, Kind, Path, parameters};
use agv_core::geometry::{Pose, Twist, difference};
use agv_core::localizer::{Event, Mode, OutputPredictor, Reason};
use agv_core::measurement::{EncoderSample, LaserId, Reflectors, Scan, SpeedSample, Time};
use agv_core::sensing::{PointScan, SensorPath};

/// Time after which the pose is as good as it gets, s.
const SETTLED: f64 = 3.0;

#[test]
fn no_motion_is_lost_while_the_laser_is_silent() {
    let path = Path::straight(16.0);
    let cases = KINDS.into_iter().flat_map(|kind| [2.0, 5.0].map(|silence| (kind, silence)));
    for (kind, silence) in cases {
        for slam in [false, true] {
            let mut drive = Drive::start(&path, kind, slam, 100);
            drive.go(SETTLED, |_| {});
            drive.is_laser_silent = true;
            drive.go(silence, |_| {});
            drive.is_laser_silent = false;
            drive.go(1.0, |drive| {
                let error = path.error(&drive.said());
                assert!(error < 0.03, "{error} m after {silence} s, {kind:?} slam {slam}");
            });
            assert_eq!(drive.said().mode, Mode::Reflectors);
        }
    }
}

#[test]
fn an_odometry_that_is_silent_is_told_and_its_motion_is_made_up_for() {
    let path = Path::straight(16.0);
    for kind in KINDS {
        for slam in [false, true] {
            let mut drive = Drive::start(&path, kind, slam, 100);
            drive.go(SETTLED, |_| {});
            assert_eq!(drive.said().mode, Mode::Reflectors);
            drive.is_odometry_silent = true;
            drive.go(0.3, |_| {});
            assert_eq!(drive.said().reason, Reason::OdometrySilent, "{kind:?} slam {slam}");
            drive.go(1.0, |_| {});
            // Landmarks alone lead it on, behind by less than a revolution.
            let said = drive.said();
            assert_eq!(said.mode, Mode::WithoutOdometry, "{kind:?} slam {slam}");
            assert!(drive.time().since(said.time) < 0.26, "it says {said:?} at {:?}", drive.time());
            let error = path.error(&said);
            assert!(error < 0.03, "{error} m, {kind:?} slam {slam}");
            drive.is_odometry_silent = false;
            drive.go(0.5, |drive| {
                let error = path.error(&drive.said());
                assert!(error < 0.03, "{error} m behind the silence, {kind:?} slam {slam}");
            });
            assert_eq!(drive.said().mode, Mode::Reflectors, "{kind:?} slam {slam}");
        }
    }
}

#[test]
fn a_laser_whose_clock_jumps_on_does_not_lead_the_pose_on() {
    let path = Path::straight(16.0);
    for kind in KINDS {
        for ahead in [0.2, 0.5, 0.9] {
            let mut drive = Drive::start(&path, kind, false, 100);
            drive.go(SETTLED, |_| {});
            drive.laser_ahead = ahead;
            drive.go(2.0, |drive| {
                let said = drive.said();
                assert!(said.time <= drive.time(), "{said:?} is of the future, {kind:?}, {ahead} s");
                assert!(path.error(&said) < 0.03, "{} m off, {kind:?}, {ahead} s", path.error(&said));
            });
        }
    }
}

#[test]
fn a_short_silence_of_the_odometry_costs_no_motion() {
    let path = Path::new(16.0, |time| (1.0 - 0.5 * (2.0 * time).sin(), 0.1 * (1.5 * time).sin()));
    for kind in KINDS {
        // It counts on while it is not heard, and no landmark could make up for it.
        let mut drive = Drive::start(&path, kind, false, 100);
        drive.go(SETTLED, |_| {});
        let before = path.error(&drive.said());
        drive.is_odometry_silent = true;
        drive.go(0.2, |_| {});
        drive.is_odometry_silent = false;
        drive.is_laser_silent = true;
        drive.go(0.2, |_| {});
        let error = path.error(&drive.said());
        assert!(error < before + 0.01, "{error} m after {before} m, {kind:?}");
    }
}

#[test]
fn a_long_silence_of_the_odometry_is_no_straight_step_that_is_believed() {
    // A quarter of a circle.
    let path = Path::new(16.0, |_| (1.0, 0.3));
    for kind in KINDS {
        let mut drive = Drive::start(&path, kind, false, 100);
        drive.go(SETTLED, |_| {});
        drive.is_laser_silent = true;
        drive.is_odometry_silent = true;
        drive.go(5.0, |_| {});
        drive.is_odometry_silent = false;
        drive.go(0.5, |_| {});
        let said = drive.said();
        assert_eq!((said.mode, said.reason), (Mode::Lost, Reason::Uncertain), "{kind:?}");
        let deviation = said.covariance[0].min(said.covariance[2]).sqrt();
        let error = path.error(&said);
        assert!(error < 3.0 * deviation, "{error} m, {kind:?} says {deviation} m");
    }
}

#[test]
fn samples_of_another_vehicle_are_told() {
    let path = Path::straight(4.0);
    let mut drive = Drive::start(&path, Kind::Encoders, false, 100);
    drive.go(1.0, |_| {});
    for step in 1..=30 {
        let time = drive.time().offset(f64::from(step) * 0.01);
        drive.localizer.handle(&Event::Speed(SpeedSample { time, speed: 1.0, steering: 0.0 }));
    }
    assert_eq!((drive.said().mode, drive.said().reason), (Mode::WithoutOdometry, Reason::OdometrySilent));
}

#[test]
fn an_odometry_whose_clock_stands_still_is_told_and_a_repeated_sample_is_not() {
    let path = Path::straight(4.0);
    let mut drive = Drive::start(&path, Kind::Encoders, false, 100);
    drive.go(1.0, |_| {});
    let repeated = drive.sample(1_000_000);
    assert_eq!(drive.localizer.handle(&repeated).pose.mode, Mode::Reflectors);
    for _ in 0..30 {
        drive.localizer.handle(&repeated);
    }
    assert_eq!(drive.said().mode, Mode::WithoutOdometry);
    drive.go(0.1, |_| {});
    assert_eq!(drive.said().mode, Mode::Reflectors);
}

#[test]
fn a_pose_of_a_moment_ago_is_carried_on_by_what_the_odometry_said_since() {
    let path = Path::new(16.0, |time| (1.5, 0.1 * (1.5 * time).sin()));
    for kind in KINDS {
        for slam in [false, true] {
            let mut drive = Drive::start(&path, kind, slam, 100);
            drive.is_laser_silent = true;
            drive.go(3.0, |_| {});
            let before = drive.said();
            let said = drive.set_pose(0.5);
            assert!(said.time >= before.time, "from {:?} back to {:?}", before.time, said.time);
            let error = path.error(&said);
            assert!(error < 0.005, "{error} m, {kind:?} slam {slam}");
            assert!(said.covariance[0] > before.covariance[0].min(1e-4), "what was driven since is not sure");
            drive.is_laser_silent = false;
            drive.go(1.0, |drive| {
                let error = path.error(&drive.said());
                assert!(error < 0.02, "{error} m, {kind:?} slam {slam}");
            });
            assert_eq!(drive.said().mode, Mode::Reflectors);
        }
    }
}

#[test]
fn a_pose_of_longer_ago_than_is_remembered_is_left_alone() {
    let path = Path::straight(16.0);
    let mut drive = Drive::start(&path, Kind::Encoders, false, 100);
    drive.go(5.0, |_| {});
    let before = drive.said();
    assert_eq!(drive.set_pose(4.0).pose, before.pose);
    assert_eq!(drive.said().mode, before.mode);
}

fn encoders(event: Event) -> EncoderSample {
    let Event::Encoders(sample) = event else { panic!("{event:?}") };
    sample
}

#[test]
fn a_localiser_that_hangs_is_told_and_its_pose_does_not_step_back() {
    let path = Path::new(16.0, |time| (1.0 + 0.3 * (2.0 * time).sin(), 0.05));
    for rate in [100, 1000] {
        let mut drive = Drive::start(&path, Kind::Encoders, false, rate);
        let mut predictor: OutputPredictor<16> = OutputPredictor::new(&parameters(Kind::Encoders, false));
        drive.go(SETTLED, |drive| {
            let micros = drive.time().micros() - 1_000_000;
            predictor.encoders(&encoders(drive.sample(micros)));
            predictor.update(&drive.said(), &drive.localizer.prediction_state());
        });
        assert_eq!(predictor.output().unwrap().mode, Mode::Reflectors);
        let last = predictor.output().unwrap();
        let mut samples = Vec::new();
        for step in 1..=rate {
            samples.push(encoders(drive.sample(3_000_000 + step * 1_000_000 / rate)));
            predictor.encoders(samples.last().unwrap());
            let said = predictor.output().unwrap();
            let age = said.time.since(last.time);
            let is_told = !matches!(said.mode, Mode::Reflectors | Mode::Mixed | Mode::Features);
            assert_eq!(is_told, age > 0.25, "{:?} after {age} s at {rate} Hz", said.mode);
        }
        let before = predictor.output().unwrap();
        let way = samples.last().unwrap().drive - encoders(drive.sample(3_000_000)).drive;
        let counted = before.dead_reckoning_distance - last.dead_reckoning_distance;
        assert!((counted - f64::from(way) * 1e-4).abs() < 1e-6, "{counted} m of {way} ticks");
        // It goes on, and is half a second behind at first.
        for sample in samples.iter().take(rate as usize / 2) {
            drive.localizer.handle(&Event::Encoders(*sample));
        }
        predictor.update(&drive.said(), &drive.localizer.prediction_state());
        let after = predictor.output().unwrap();
        let step = (after.pose.position() - before.pose.position()).norm();
        assert!(after.time >= before.time && step < 1e-3, "{step} m at {rate} Hz");
    }
}

/// Error of the position that 95 % of the poses do not exceed, m, told ten times a second whatever the rate of the odometry.
fn usual_error(path: &Path, kind: Kind, slam: bool, rate: u64, latency: u64) -> f64 {
    let mut drive = Drive::start(path, kind, slam, rate);
    drive.scale = 0.004;
    drive.latency = latency;
    drive.go(5.0, |_| {});
    let mut errors = Vec::new();
    drive.go(20.0, |drive| {
        if drive.time().micros() % 100_000 == 0 {
            errors.push(path.error(&drive.said()));
            assert_eq!(drive.said().mode, Mode::Reflectors, "{kind:?} slam {slam}, {rate} Hz, {latency} us");
        }
    });
    assert_eq!(errors.len(), 200);
    errors.sort_by(f64::total_cmp);
    errors[errors.len() * 95 / 100]
}

#[test]
fn the_pose_is_as_good_at_every_rate_of_the_odometry_and_latency_of_the_laser() {
    let path = Path::new(26.0, |time| (1.0 + 0.3 * (0.7 * time).sin(), 0.25 * (0.5 * time).sin()));
    let mut bad = Vec::new();
    for kind in KINDS {
        for slam in [false, true] {
            for latency in [0, 100_000, 150_000] {
                let usual = usual_error(&path, kind, slam, 100, latency);
                for rate in [20, 50, 250, 1000] {
                    let error = usual_error(&path, kind, slam, rate, latency);
                    if error > 1.2 * usual {
                        bad.push(format!(
                            "{kind:?} slam {slam}, {latency} us, {rate} Hz: {error} m, {usual} m at 100 Hz"
                        ));
                    }
                }
            }
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn a_filter_that_stands_in_the_past_is_as_right_of_now() {
    // Straight on, round a bend, in serpentines, and round a bend from standstill to 1.9 m/s and back.
    let paths = [
        Path::straight(14.0),
        Path::new(14.0, |_| (1.5, 0.6)),
        Path::new(14.0, |time| (1.2, 0.5 * (1.5 * time).sin())),
        Path::new(14.0, |time| (1.0 - 0.9 * (0.8 * time).cos(), 0.7)),
    ];
    let worst = |path: &Path, kind, slam, rate| {
        let mut drive = Drive::start(path, kind, slam, rate);
        drive.go(SETTLED, |_| {});
        let (mut position, mut heading) = (0.0_f64, 0.0_f64);
        drive.go(9.0, |drive| {
            let said = drive.said();
            position = position.max(path.error(&said));
            heading = heading.max(difference(said.pose.theta, path.pose(said.time).theta).abs());
        });
        (position, heading)
    };
    for (number, path) in paths.iter().enumerate() {
        for kind in KINDS {
            for rate in [50, 100, 500] {
                let [at_once, behind] = [false, true].map(|slam| worst(path, kind, slam, rate));
                let (more, turned) = (behind.0 - at_once.0, behind.1 - at_once.1);
                assert!(more < 1e-3, "{more} m more than {} m on path {number}, {kind:?} at {rate} Hz", at_once.0);
                assert!(turned < 1e-4, "{turned} rad more than {} on path {number}, {kind:?} at {rate} Hz", at_once.1);
            }
        }
    }
}

#[test]
fn a_scan_is_corrected_up_to_its_last_beam_at_every_rate() {
    // Round a bend at 1.5 m/s, in a revolution of 0.125 s.
    let at = |seconds: f64| Pose::exp(&Twist { x: 1.5 * seconds, y: 0.0, theta: 0.8 * seconds });
    let start = Time::from_micros(5_000_000);
    let laser = Pose::new(0.9, 0.1, 0.3);
    for interval in [500, 1000, 2100, 2700, 4000, 10_000, 50_000] {
        let mut path = SensorPath::default();
        let end = 125_000;
        let times = (0..).map(|step| step * interval).take_while(|time| *time < end).chain([end]);
        path.set(start, &laser, times.map(|micros| (start.offset(micros as f64 * 1e-6), at(micros as f64 * 1e-6))));
        for beam in 0..=1250 {
            let seconds = f64::from(beam) * 1e-4;
            let expected = laser.inverse().compose(&at(seconds).compose(&laser));
            let off = expected.between(&path.place(seconds));
            // 2 ms before the end nothing more is told, and between nodes the path is straight.
            let allowed = if interval < 10_000 { 2e-4 } else { 8e-4 } + 1.5 * 2e-3 * f64::from(u8::from(beam > 1230));
            let error = off.x.hypot(off.y);
            assert!(error < allowed, "{error} m at {seconds} s, a node each {interval} us");
        }
    }
}

#[test]
fn each_return_of_a_scan_is_moved_from_where_it_was_seen() {
    // A wall 6 m ahead, seen from a sensor that goes round a bend.
    let at = |seconds: f64| Pose::exp(&Twist { x: 1.5 * seconds, y: 0.0, theta: 0.8 * seconds });
    let laser = Pose::new(0.9, 0.1, 0.3);
    let mut path = SensorPath::default();
    let times = (0..=13).map(|step| f64::from(step) * 0.01);
    path.set(Time::default(), &laser, times.map(|seconds| (Time::default().offset(seconds), at(seconds))));
    for (count, span) in [(1440, 0.125), (1437, 0.125), (7, 0.05), (100, 0.0)] {
        let beam_interval = span / f64::from(count);
        let bearing = |beam: u16| -0.6 + 1.2 * f64::from(beam) / f64::from(count);
        let place = |beam: u16| laser.inverse().compose(&at(f64::from(beam) * beam_interval).compose(&laser));
        let range = |beam: u16| {
            let sensor = place(beam);
            (6.0 - sensor.x) / (sensor.theta + bearing(beam)).cos()
        };
        let is_absent = |beam: u16| beam % 5 == 3 || (200..230).contains(&beam);
        let ranges: Vec<f32> = (0..count).map(|beam| if is_absent(beam) { 0.0 } else { range(beam) as f32 }).collect();
        let scan = Scan {
            laser: LaserId::FIRST,
            start: Time::default(),
            beam_interval,
            first_bearing: bearing(0),
            bearing_step: 1.2 / f64::from(count),
            ranges: &ranges,
            intensities: &[],
        };
        let mut points = Box::new(PointScan::<1440>::new());
        points.set(&scan, 0.1, 50.0);
        path.correct(&scan, &mut points);
        assert_eq!(points.points.len(), usize::from(count));
        for (beam, point) in (0..count).zip(&points.points) {
            if is_absent(beam) {
                assert_eq!((point.x, point.y), (0.0, 0.0), "beam {beam} of {count} has no return");
            } else {
                let sensor = place(beam);
                let y = sensor.y + range(beam) * (sensor.theta + bearing(beam)).sin();
                let error = f64::from(point.x - 6.0).hypot(f64::from(point.y) - y);
                // Between nodes the path is straight.
                assert!(error < 2e-4, "{error} m at beam {beam} of {count}");
            }
        }
    }
}

#[test]
fn what_the_localiser_has_assumed_already_is_not_published_twice() {
    let path = Path::new(8.0, |_| (1.5, 0.05));
    let mut drive = Drive::start(&path, Kind::Encoders, false, 100);
    let mut predictor: OutputPredictor<16> = OutputPredictor::new(&parameters(Kind::Encoders, false));
    // The last beam of the twenty-fourth revolution is 9 ms behind the last sample.
    drive.is_laser_silent = true;
    drive.go(2.99, |drive| {
        predictor.encoders(&encoders(drive.sample(drive.time().micros() - 1_000_000)));
    });
    let mut seen = drive.revolution(23);
    seen.last_mut().unwrap().time = drive.time().offset(0.009);
    let observations = &seen[seen.len() - 1..];
    drive.localizer.handle(&Event::Reflectors(Reflectors::of_first(observations)));
    assert!(drive.said().time > drive.time());
    predictor.update(&drive.said(), &drive.localizer.prediction_state());
    let sample = encoders(drive.sample(3_000_000));
    predictor.encoders(&sample);
    drive.localizer.handle(&Event::Encoders(sample));
    let (said, expected) = (predictor.output().unwrap(), drive.said());
    let error = (said.pose.position() - expected.pose.position()).norm();
    assert!(said.time == expected.time && error < 1e-4, "{error} m");
}

#[test]
fn what_was_learnt_of_the_odometry_is_in_what_is_published() {
    let path = Path::new(40.0, |time| (1.0, 0.3 * (0.5 * time).sin()));
    let mut drive = Drive::start(&path, Kind::Encoders, true, 100);
    drive.scale = 0.015;
    drive.go(30.0, |_| {});
    let mut predictor: OutputPredictor<16> = OutputPredictor::new(&parameters(Kind::Encoders, true));
    predictor.encoders(&encoders(drive.sample(30_000_000)));
    predictor.update(&drive.said(), &drive.localizer.prediction_state());
    for step in 1..=16 {
        let sample = encoders(drive.sample(30_000_000 + step * 10_000));
        predictor.encoders(&sample);
        drive.localizer.handle(&Event::Encoders(sample));
    }
    let (said, expected) = (predictor.output().unwrap(), drive.said());
    let error = (said.pose.position() - expected.pose.position()).norm();
    assert!(said.time == expected.time && error < 1e-5, "{error} m");
}
