//! Whole conversations with a scripted sensor.

use std::f64::consts::PI;

use agv_core::measurement::Time;
use agv_wire::cola::{Deframed, Deframer, Dialect, Fault};
use agv_wire::nav350::{
    ClockError, Configuration, CoordinateFormat, ErrorCode, LandmarkDataFormat, LostReason, Method, MethodName,
    OperatingMode, Orientation, PoseDataFormat, Report, Request, RotationSpeed, ScanDataFormat, SensorSpeed, Setting,
    State, Variable, Velocity,
};
use proptest::prelude::*;

use super::peer::{Moods, Scene};

fn speaking(dialect: Dialect) -> Scene {
    let mut scene = Scene::new(Configuration { first_dialect: dialect, ..Configuration::default() });
    scene.moods.only = Some(dialect);
    scene
}

#[test]
fn a_revolution_arrives_eight_times_a_second() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut scene = speaking(dialect);
        scene.run(61.0);
        assert!(scene.is_running() && scene.lost.is_empty(), "{:?}", scene.reports);
        let count = scene.revolutions.iter().filter(|(arrival, _)| *arrival >= 11_000_000).count();
        assert!((479..=481).contains(&count), "{count}");
        // Not one is missed or repeated.
        let starts: Vec<u64> = scene.revolutions.iter().map(|(_, start)| *start).collect();
        assert!(starts.windows(2).all(|pair| pair[1] - pair[0] == 125_000));
        assert!(scene.reports.iter().all(|(_, report)| matches!(report, Report::State(_) | Report::Dialect(_))));
    }
}

#[test]
fn the_states_come_in_order() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(2.0);
    let states: Vec<Report> = scene.reports.iter().map(|(_, report)| *report).collect();
    let expected = [
        Report::State(State::Identifying),
        Report::Dialect(Dialect::Binary),
        Report::State(State::LoggingIn),
        Report::State(State::Configuring),
        Report::State(State::EnteringMode),
        Report::State(State::Synchronising),
        Report::State(State::Running),
    ];
    assert_eq!(states, expected);
}

#[test]
fn the_other_dialect_is_found() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut scene = speaking(dialect.other());
        scene.moods.only = Some(dialect);
        scene.run(4.0);
        assert!(scene.is_running(), "{:?}", scene.reports);
        assert_eq!(scene.session.dialect(), dialect);
        assert!(scene.has(Report::Dialect(dialect)) && scene.lost.is_empty());
    }
}

/// The modes that the sensor was put into, since that request.
fn modes(scene: &Scene, from: usize) -> Vec<OperatingMode> {
    let decode = |request: &Vec<u8>| {
        let mut deframer = Deframer::<256>::new();
        deframer.extend(request);
        let Some(Deframed::Telegram { dialect, payload, .. }) = deframer.next() else { panic!("{request:?}") };
        match Request::decode(dialect, payload) {
            Ok(Request::Call(Method::ChangeState(mode))) => Some(mode),
            _ => None,
        }
    };
    scene.requests[from..].iter().filter_map(decode).collect()
}

fn cut_for_a_second(scene: &mut Scene) -> usize {
    scene.cut();
    scene.run(1.0);
    scene.is_cut = false;
    let before = scene.requests.len();
    scene.run(4.0);
    before
}

const FRESH: [OperatingMode; 2] = [OperatingMode::Standby, OperatingMode::Navigation];

#[test]
fn behind_a_cut_line_a_sensor_keeps_its_mode_and_its_settings() {
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let mut scene = speaking(dialect);
        scene.run(3.0);
        assert_eq!(modes(&scene, 0), FRESH);
        let before = cut_for_a_second(&mut scene);
        assert!(scene.is_running());
        assert_eq!(modes(&scene, before), []);
        // One that stands by is only brought back.
        scene.mode = OperatingMode::Standby;
        let before = cut_for_a_second(&mut scene);
        assert!(scene.is_running());
        assert_eq!(modes(&scene, before), [OperatingMode::Navigation]);
    }
}

#[test]
fn a_sensor_with_other_settings_is_told_again() {
    let others = [
        Setting::CurrentLayer(2),
        Setting::ScanDataFormat(ScanDataFormat { channels: 1, has_remission: false }),
        Setting::PoseDataFormat(PoseDataFormat { is_extrapolated: false, has_details: true }),
        Setting::LandmarkDataFormat(LandmarkDataFormat {
            coordinates: CoordinateFormat::Polar,
            has_details: true,
            filter: 1,
        }),
        Setting::CoordinateOrientation(1),
    ];
    let configuration = Configuration { layer: Some(1), ..Configuration::default() };
    for other in others {
        let mut scene = Scene::new(configuration);
        scene.run(3.0);
        let wanted = scene.settings.clone();
        scene.settings.retain(|known| known.variable() != other.variable());
        scene.settings.push(other);
        let before = cut_for_a_second(&mut scene);
        assert!(scene.is_running());
        assert_eq!(modes(&scene, before), FRESH, "{other:?}");
        assert!(wanted.iter().all(|wanted| scene.settings.contains(wanted)), "{:?}", scene.settings);
    }
    // A variable that the sensor does not tell is written.
    for refuses in [true, false] {
        let mut scene = Scene::new(configuration);
        scene.run(3.0);
        if refuses {
            scene.settings.retain(|known| known.variable() != Variable::PoseDataFormat);
        } else {
            scene.moods.hides_setting = Some(Variable::PoseDataFormat);
        }
        let before = cut_for_a_second(&mut scene);
        assert!(scene.is_running() && modes(&scene, before) == FRESH, "{refuses}");
    }
}

#[test]
fn settings_that_bring_no_revolution_are_written_anew() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(3.0);
    scene.moods.ignores_method = Some(MethodName::GetData);
    let before = cut_for_a_second(&mut scene);
    assert!(modes(&scene, before).starts_with(&FRESH), "{:?}", modes(&scene, before));
}

#[test]
fn a_layer_is_left_as_it_is_or_set() {
    for (layer, expected) in [(None, 3), (Some(7), 7)] {
        let mut scene = Scene::new(Configuration { layer, ..Configuration::default() });
        scene.settings[0] = Setting::CurrentLayer(3);
        scene.run(3.0);
        assert!(
            scene.is_running() && scene.settings.contains(&Setting::CurrentLayer(expected)),
            "{:?}",
            scene.settings
        );
    }
}

#[test]
fn directions_follow_the_orientation_that_the_sensor_has() {
    use Orientation::{Clockwise, CounterClockwise};
    for (has, wanted, is_clockwise) in [
        (Some(0), None, false),
        (Some(1), None, true),
        (Some(0), Some(Clockwise), true),
        (Some(1), Some(CounterClockwise), false),
        (Some(1), Some(Clockwise), true),
        (None, None, false),
    ] {
        let mut scene = Scene::new(Configuration { orientation: wanted, ..Configuration::default() });
        scene.settings.retain(|known| known.variable() != Variable::CoordinateOrientation);
        scene.settings.extend(has.map(Setting::CoordinateOrientation));
        scene.run(3.0);
        let bearing = f64::from(scene.revolution.reflectors().unwrap().observations[0].bearing);
        let side = if is_clockwise { -1.0 } else { 1.0 };
        let expected = side * 4_f64.atan2(3.0) - PI;
        assert!(
            (bearing - expected).sin().abs() < 1e-6 && (bearing - expected).cos() > 0.0,
            "{has:?}, {wanted:?}: {bearing}"
        );
    }
    // A sensor that refuses to turn its angles keeps those that it has.
    let mut scene = Scene::new(Configuration { orientation: Some(CounterClockwise), ..Configuration::default() });
    scene.settings.retain(|known| known.variable() != Variable::CoordinateOrientation);
    scene.settings.push(Setting::CoordinateOrientation(1));
    scene.moods.refuses_setting = Some(Variable::CoordinateOrientation);
    scene.run(3.0);
    let bearing = f64::from(scene.revolution.reflectors().unwrap().observations[0].bearing);
    assert!((bearing + 4_f64.atan2(3.0) + PI).sin().abs() < 1e-6, "{bearing}");
}

#[test]
fn a_sensor_without_a_layout_detects_landmarks() {
    let mode = OperatingMode::LandmarkDetection;
    let mut scene = Scene::new(Configuration { mode, ..Configuration::default() });
    scene.run(3.0);
    assert_eq!(modes(&scene, 0), [OperatingMode::Standby, mode]);
    assert!(scene.is_running() && scene.revolutions.len() > 10);
}

#[test]
fn times_and_directions_are_those_of_the_vehicle() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(5.0);
    let (_, start) = *scene.revolutions.last().unwrap();
    let scan = scene.revolution.scan().unwrap();
    assert!(scan.start.since(Time::from_micros(start)).abs() < 1.5e-3);
    assert_eq!(scan.ranges, [1.0, 2.0, 0.0, 70.0]);
    assert!(scan.intensities.is_empty());
    // Zero is at the rear, and the head turns counter-clockwise.
    assert!((scan.first_bearing + PI).abs() < 1e-12 && (scan.bearing_step - PI / 720.0).abs() < 1e-12);
    assert!((scan.beam_interval - 0.125 / 1440.0).abs() < 1e-12);
    let reflectors = scene.revolution.reflectors().unwrap();
    let [reflector] = reflectors.observations else { panic!("{reflectors:?}") };
    assert!(reflector.time.since(Time::from_micros(start + 50_000)).abs() < 1.5e-3);
    assert!((reflector.range - 5.0).abs() < 1e-6);
    assert!((f64::from(reflector.bearing) - (4_f64.atan2(3.0) - PI)).abs() < 1e-6);
}

#[test]
fn a_clockwise_sensor_that_looks_ahead() {
    let mut configuration = Configuration { orientation: Some(Orientation::Clockwise), ..Configuration::default() };
    configuration.frame.zero = 0.0;
    let mut scene = Scene::new(configuration);
    scene.run(2.0);
    let scan = scene.revolution.scan().unwrap();
    assert!((scan.bearing(1) + PI / 720.0).abs() < 1e-12);
    assert!(scan.beam_interval > 0.0);
    let bearing = scene.revolution.reflectors().unwrap().observations[0].bearing;
    assert!((f64::from(bearing) + 4_f64.atan2(3.0)).abs() < 1e-6);
    let speed = SensorSpeed { time: Time::from_micros(scene.now), x: 1.0, y: 0.5, rotation: 0.1 };
    scene.session.set_speed(speed);
    scene.run(0.2);
    let told = scene.speeds[0];
    assert_eq!((told.x, told.y, told.rotation), (Velocity(1000), Velocity(-500), RotationSpeed(-5730)));
}

#[test]
fn speeds_are_told_in_the_sensors_axes_and_time() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(3.0);
    for _ in 0..100 {
        let time = Time::from_micros(scene.now);
        scene.session.set_speed(SensorSpeed { time, x: 1.5, y: -0.25, rotation: PI });
        scene.run(0.01);
        if let Some(speed) = scene.speeds.last() {
            assert!(speed.time.since(scene.device_time(scene.now)).abs() < 60, "{speed:?}");
        }
    }
    // One second, no more than one every 25 ms.
    assert!((25..=41).contains(&scene.speeds.len()), "{}", scene.speeds.len());
    let speed = scene.speeds[0];
    // The sensor's zero is at the rear.
    assert_eq!((speed.x, speed.y, speed.rotation), (Velocity(-1500), Velocity(250), RotationSpeed(180_000)));
    assert!(!speed.is_absolute && scene.is_running() && scene.lost.is_empty());
}

#[test]
fn a_cut_line_is_opened_again() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(5.0);
    scene.cut();
    scene.run(3.0);
    assert_eq!(scene.lost[0].1, LostReason::Closed);
    assert!(scene.lost[1..].iter().all(|(_, reason)| *reason == LostReason::NotConnected));
    // Pauses double: 0.25, 0.5, 1 and 2 s.
    let pauses: Vec<u64> = scene.lost.iter().zip(&scene.connects[1..]).map(|((lost, _), next)| next - lost).collect();
    assert_eq!(pauses, [250_000, 500_000, 1_000_000]);
    scene.is_cut = false;
    scene.run(4.0);
    assert!(scene.is_running());
    let after = scene.revolutions.iter().filter(|(arrival, _)| *arrival > 18_000_000).count();
    assert!(after > 10, "{after}");
}

#[test]
fn a_silent_sensor_is_given_up_and_found_again() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(5.0);
    scene.moods.ignores_method = Some(MethodName::GetData);
    scene.run(1.3);
    assert_eq!(scene.lost.last().map(|lost| lost.1), Some(LostReason::NoAnswer(State::Running)));
    scene.moods = Moods::default();
    scene.run(2.0);
    assert!(scene.is_running());
}

/// A late answer about the time must never be taken for that to a later question.
#[test]
fn an_unanswered_question_about_the_time_ends_the_connection() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(5.0);
    scene.moods.ignores_method = Some(MethodName::GetTimestamp);
    scene.run(2.5);
    assert_eq!(scene.lost[0].1, LostReason::NoAnswer(State::Running));
}

#[test]
fn a_sensor_that_says_nothing_at_all() {
    let mut scene = speaking(Dialect::Binary);
    scene.moods.ignores_method = Some(MethodName::SetAccessMode);
    scene.run(1.5);
    assert_eq!(scene.lost[0].1, LostReason::NoAnswer(State::LoggingIn));
}

#[test]
fn refusals_have_their_reason() {
    let mut scene = speaking(Dialect::Binary);
    scene.moods.refuses_access = true;
    scene.run(0.1);
    assert_eq!(scene.lost[0].1, LostReason::AccessDenied);

    let mut scene = speaking(Dialect::Ascii);
    scene.moods.refuses_method = Some(MethodName::ChangeState);
    scene.run(0.1);
    assert_eq!(scene.lost[0].1, LostReason::Refused(State::Configuring, Fault::LOCAL_CONDITION));

    // A setting is not worth a drive.
    let mut scene = speaking(Dialect::Ascii);
    scene.moods.refuses_setting = Some(Variable::ScanDataFormat);
    scene.run(2.0);
    assert!(scene.is_running());
    assert!(scene.has(Report::SettingRefused(Variable::ScanDataFormat, Fault::LOCAL_CONDITION)));

    let mut scene = speaking(Dialect::Ascii);
    scene.moods.refuses_method = Some(MethodName::SetSpeed);
    scene.run(2.0);
    scene.session.set_speed(SensorSpeed { time: Time::from_micros(scene.now), x: 1.0, y: 0.0, rotation: 0.0 });
    scene.run(2.0);
    assert!(scene.is_running() && scene.lost.is_empty());
    assert!(scene.has(Report::CallRefused(MethodName::SetSpeed, Fault::LOCAL_CONDITION)));
}

#[test]
fn no_position_is_no_reason_to_drop_what_is_seen() {
    let mut scene = speaking(Dialect::Binary);
    scene.moods.data_error = Some(ErrorCode::NO_POSITION);
    scene.run(3.0);
    assert!(scene.revolutions.len() > 10);
    assert_eq!(scene.revolution.error(), ErrorCode::NO_POSITION);
    assert!(scene.revolution.reflectors().is_some() && scene.revolution.pose().is_none());
}

#[test]
fn a_sensor_in_another_mode_is_brought_back() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(3.0);
    scene.mode = OperatingMode::Standby;
    scene.run(2.0);
    assert!(scene.has(Report::MethodFailed(MethodName::GetData, ErrorCode::WRONG_MODE)));
    assert!(scene.is_running() && scene.lost.is_empty());
    assert!(scene.revolutions.iter().filter(|(arrival, _)| *arrival > 14_000_000).count() >= 7);
}

#[test]
fn a_late_answer_still_has_its_own_time() {
    let mut scene = Scene::new(Configuration { answer_timeout: 5.0, ..Configuration::default() });
    scene.run(5.0);
    scene.moods.data_delay = 2_000_000;
    scene.run(6.0);
    let (arrival, start) = *scene.revolutions.last().unwrap();
    assert!(arrival > start + 2_000_000);
    let scan = scene.revolution.scan().unwrap();
    assert!(scan.start.since(Time::from_micros(start)).abs() < 1.5e-3);
    assert!(scene.lost.is_empty());
}

#[test]
fn a_sensor_that_was_started_again_gets_a_new_clock() {
    let mut scene = speaking(Dialect::Binary);
    scene.run(5.0);
    scene.clock_offset += 1_000_000;
    scene.run(3.0);
    assert!(scene.has(Report::Clock(ClockError::Restarted)));
    let (_, start) = *scene.revolutions.last().unwrap();
    assert!(scene.revolution.scan().unwrap().start.since(Time::from_micros(start)).abs() < 1.5e-3);
}

#[test]
fn drift_and_wrap_do_not_move_the_scans() {
    let mut scene = speaking(Dialect::Binary);
    scene.drift = 150e-6;
    // The clock wraps after about 30 s.
    scene.clock_offset = (1 << 32) - 40_000;
    for _ in 0..60 {
        scene.run(1.0);
        if let Some((_, start)) = scene.revolutions.last() {
            let error = scene.revolution.scan().unwrap().start.since(Time::from_micros(*start));
            assert!(error.abs() < 2.5e-3, "{error} at {}", scene.now);
        }
    }
    assert!((scene.session.clock().drift() - 150e-6).abs() < 60e-6);
    assert!(!scene.has(Report::Clock(ClockError::Restarted)));
}

#[test]
fn unasked_answers_are_told_and_dropped() {
    let mut scene = speaking(Dialect::Ascii);
    scene.run(3.0);
    scene.inject(b"\x02sAN mNEVAChangeState 0 4\x03\x02sWA NLMDReflSize\x03\x02sSN LMDscandata 1\x03hello");
    scene.run(1.0);
    assert_eq!(scene.reports.iter().filter(|(_, report)| *report == Report::Unexpected).count(), 2);
    assert!(scene.reports.iter().any(|(_, report)| matches!(report, Report::Undecodable(_))));
    assert!(scene.has(Report::Rubbish(5)));
    assert!(scene.is_running() && scene.lost.is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Rubbish before every answer, in pieces of any size: no revolution is lost.
    #[test]
    fn rubbish_between_answers_is_survived(
        rubbish in prop::collection::vec(any::<u8>().prop_filter("no start", |byte| *byte != 2), 0..20),
        piece in 1_usize..50,
        is_ascii in any::<bool>(),
    ) {
        let mut scene = speaking(if is_ascii { Dialect::Ascii } else { Dialect::Binary });
        scene.moods.rubbish = rubbish;
        scene.piece = piece;
        scene.run(4.0);
        prop_assert!(scene.is_running() && scene.lost.is_empty());
        prop_assert!(scene.revolutions.len() >= 28, "{}", scene.revolutions.len());
    }

    /// Any bytes at any time: the session always comes back.
    #[test]
    fn any_bytes_are_survived(
        pieces in prop::collection::vec(prop::collection::vec(prop_oneof![Just(2_u8), Just(b's'), any::<u8>()], 1..300), 1..12),
    ) {
        let mut scene = speaking(Dialect::Binary);
        for bytes in pieces {
            scene.run(0.3);
            scene.inject(&bytes);
        }
        scene.run(30.0);
        let (last, _) = *scene.revolutions.last().unwrap();
        prop_assert!(scene.is_running() && scene.now - last < 300_000);
    }
}

#[test]
fn a_line_that_babbles_is_given_up_after_a_mebibyte() {
    use agv_wire::nav350::{Revolution, Session, Step};
    let mut foreign = [0; 256];
    let word = agv_wire::nav350::Answer::Written(Variable::CurrentLayer);
    let length = word.encode(Dialect::Binary, &mut foreign).unwrap();
    // Bytes of no meaning, and telegrams that answer nothing.
    for piece in [vec![0xAA; 4096], foreign[..length].repeat(100)] {
        let mut session = Box::new(Session::<65_536>::new(Configuration::default()));
        let mut revolution = Box::new(Revolution::<4>::new());
        let (mut said, mut lost) = (0_usize, None);
        'line: for round in 0..10_000_u64 {
            let now = Time::from_micros(round);
            loop {
                match session.poll(now, &mut revolution) {
                    Step::Connect => session.connected(now),
                    Step::Disconnect(reason) => {
                        lost = Some(reason);
                        break 'line;
                    }
                    Step::Wait(_) => break,
                    Step::Send(_) | Step::Report(_) | Step::Revolution => {}
                }
            }
            said += session.receive(&piece, now);
        }
        assert_eq!(lost, Some(LostReason::Babble));
        assert!((1 << 20..(1 << 20) + 2 * piece.len()).contains(&said), "{said}");
    }
}
