//! The description files that ship with the project, as programs of others read them.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::Stdio;

use agv_core::integrity::{Alarm, AlertLimit, ProtectionLevel};
use agv_core::localizer::{Mode, Reason};
use agv_core::measurement::EncoderFault;
use agv_core::state::{LaserHealth, Relocalization};
use agv_tests::{python, repository};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::{Content, Health};
use agv_wire::can::frame::{Frame, Id};
use serde_json::Value;

fn contents() -> Vec<(Content, BTreeMap<&'static str, f64>)> {
    let mut all = Vec::new();
    let numbers = [-1.0, -0.37, 0.0, 0.001, 0.25, 0.9];
    for (index, number) in (0u8..).zip(numbers) {
        let (x, y) = (53_000.0 * number, -1234.5678 * number);
        let position = BTreeMap::from([("X", x), ("Y", y)]);
        all.push((Content::Position { x, y }, position.clone()));
        all.push((Content::InitialPosition { x, y }, position));
        let (heading, distance) = (std::f64::consts::PI * number, 600.0 * number.abs());
        all.push((
            Content::Heading { heading, time: 1000 * u16::from(index) + 7, dead_reckoning_distance: distance },
            BTreeMap::from([
                ("Heading", heading),
                ("Time", f64::from(index) + 0.007),
                ("DeadReckoningDistance", distance),
            ]),
        ));
        let deviations = [number.abs(), 2.0 * number.abs(), 0.5 * number.abs()];
        let correlations = [number, -number, 0.5 * number];
        all.push((
            Content::Covariance { deviations, correlations },
            BTreeMap::from([
                ("DeviationX", deviations[0]),
                ("DeviationY", deviations[1]),
                ("DeviationHeading", deviations[2]),
                ("CorrelationXY", correlations[0]),
                ("CorrelationXHeading", correlations[1]),
                ("CorrelationYHeading", correlations[2]),
            ]),
        ));
        let level = ProtectionLevel { position: number.abs(), heading: 0.5 * number.abs() };
        let limit = AlertLimit { position: number.abs(), heading: 0.25 * number.abs() };
        all.push((
            Content::Integrity { level, limit, alarm: Alarm::Docking },
            BTreeMap::from([
                ("ProtectionPosition", level.position),
                ("ProtectionHeading", level.heading),
                ("LimitPosition", limit.position),
                ("LimitHeading", limit.heading),
                ("Alarm", 1.0),
            ]),
        ));
        all.push((
            Content::InitialHeading {
                heading,
                position_deviation: 60.0 * number.abs(),
                heading_deviation: number.abs(),
            },
            BTreeMap::from([
                ("Heading", heading),
                ("PositionDeviation", 60.0 * number.abs()),
                ("HeadingDeviation", number.abs()),
            ]),
        ));
    }
    for is_standstill in [false, true] {
        all.push((
            Content::Command { is_standstill },
            BTreeMap::from([("Standstill", f64::from(u8::from(is_standstill)))]),
        ));
    }
    all
}

/// Every value that a status can name.
fn statuses() -> Vec<(Content, BTreeMap<&'static str, String>)> {
    use EncoderFault::{
        Frozen, HeartbeatLost, Jumped, Late, Missing, OutOfRange, Reported, WrongDirection, WrongRange,
    };
    let modes = [
        Mode::NotLocalised,
        Mode::Reflectors,
        Mode::Features,
        Mode::Mixed,
        Mode::DeadReckoning,
        Mode::Lost,
        Mode::WithoutOdometry,
        Mode::Degraded,
    ];
    let reasons = [
        Reason::None,
        Reason::NoPose,
        Reason::NoLandmarks,
        Reason::LandmarksRejected,
        Reason::InnovationsTooLarge,
        Reason::Uncertain,
        Reason::OdometryImplausible,
        Reason::DriveEncoder,
        Reason::SteeringEncoder,
        Reason::MotionDisagrees,
        Reason::LaserMoved,
        Reason::OdometryDisagrees,
        Reason::OdometrySilent,
        Reason::WheelsSlip,
        Reason::GyroFault,
    ];
    let faults = [
        None,
        Some(Late),
        Some(Missing),
        Some(Frozen),
        Some(Jumped),
        Some(OutOfRange),
        Some(Reported),
        Some(HeartbeatLost),
        Some(WrongRange),
        Some(WrongDirection),
    ];
    let lasers = [LaserHealth::Unknown, LaserHealth::Sound, LaserHealth::Silent, LaserHealth::Faulty];
    let searches = [
        Relocalization::Idle,
        Relocalization::Searching,
        Relocalization::Ambiguous,
        Relocalization::TooFew,
        Relocalization::Unknown,
    ];
    (0..15)
        .map(|index| {
            let (mode, reason) = (modes[index % 8], reasons[index]);
            let (drive, steering, laser) = (faults[index % 9], faults[(23 - index) % 9], lasers[index % 4]);
            let start_search = searches[index % 5];
            let fault = |fault: Option<EncoderFault>| fault.map_or("None".to_owned(), |fault| format!("{fault:?}"));
            let status = Content::Status {
                mode,
                reason,
                acceptance: 0.5,
                normalised_square: 2.0,
                health: Health { drive, steering, laser, start_search },
                is_good: index % 2 == 0,
                has_jumped: index % 3 == 0,
                resets: 250 + index as u8 % 6,
                last_reset: 0.02 * index as f64,
                overflows: index as u8 % 4,
            };
            let names = BTreeMap::from([
                ("Mode", format!("{mode:?}")),
                ("Reason", format!("{reason:?}")),
                ("DriveFault", fault(drive)),
                ("SteeringFault", fault(steering)),
                ("Laser", format!("{laser:?}")),
                ("PoseResets", (250 + index % 6).to_string()),
                ("Overflows", (index % 4).to_string()),
                ("StartSearch", format!("{start_search:?}")),
                ("PoseIsGood", u8::from(index % 2 == 0).to_string()),
                ("Corrected", u8::from(index % 3 == 0).to_string()),
            ]);
            (status, names)
        })
        .collect()
}

fn line(frame: &Frame) -> String {
    let Id::Standard(id) = frame.id() else { panic!("29 bits") };
    let bytes: String = frame.data().iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{:03X}#{bytes}", id.as_raw())
}

/// What cantools makes of each frame. None if it is not installed.
fn described(frames: &[Frame]) -> Option<Vec<Value>> {
    let mut child = python("agv.dbc and agv.eds", "cantools, canopen")?
        .arg(repository("agv/tests/can/agv_description.py"))
        .args([repository("docs/agv.dbc"), repository("docs/agv.eds")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines: Vec<String> = frames.iter().map(line).collect();
    child.stdin.take().unwrap().write_all((lines.join("\n") + "\n").as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let answers = std::str::from_utf8(&output.stdout).unwrap().lines();
    Some(answers.map(|answer| serde_json::from_str(answer).unwrap()).collect())
}

/// Half a step of each signal; deviations are rounded up, so a whole one.
fn tolerance(signal: &str) -> f64 {
    match signal {
        "X" | "Y" => 0.5e-4,
        "Heading" => 0.5e-6,
        "Time" => 1e-9,
        "DeadReckoningDistance" => 0.01,
        "DeviationX" | "DeviationY" => 0.00025,
        "DeviationHeading" | "HeadingDeviation" => 1e-4,
        "CorrelationXY" | "CorrelationXHeading" | "CorrelationYHeading" => 0.01,
        "PositionDeviation" | "ProtectionPosition" => 1e-3,
        "ProtectionHeading" => 0.25e-3,
        "LimitPosition" => 0.5e-3,
        "LimitHeading" => 0.125e-3,
        _ => 0.0,
    }
}

#[test]
fn cantools_decodes_what_we_say_and_encodes_what_we_hear() {
    let node = NodeId::new(16).unwrap();
    let (contents, statuses) = (contents(), statuses());
    let all: Vec<Content> =
        contents.iter().map(|(content, _)| *content).chain(statuses.iter().map(|(content, _)| *content)).collect();
    let frames: Vec<Frame> = (0..).zip(&all).map(|(count, content)| content.encode(node, count % 16)).collect();
    let Some(answers) = described(&frames) else { return };
    assert_eq!(answers.len(), frames.len());
    for (count, (frame, answer)) in frames.iter().zip(&answers).enumerate() {
        assert_eq!(answer["signals"]["Counter"], count % 16);
        let Value::String(again) = &answer["again"] else { panic!("{answer}") };
        // Their encoding of the values is our frame, so what they encode is what we decode.
        assert_eq!(*again, line(frame)[4..], "{answer}");
    }
    for ((content, expected), answer) in contents.iter().zip(&answers) {
        let signals = answer["signals"].as_object().unwrap();
        assert_eq!(signals.len(), expected.len() + 1, "{content:?}");
        for (name, value) in expected {
            let found = signals[*name].as_f64().unwrap();
            assert!((found - value).abs() <= tolerance(name) + 1e-9, "{name}: {found}, not {value}");
        }
    }
    for ((content, expected), answer) in statuses.iter().zip(&answers[contents.len()..]) {
        for (name, value) in expected {
            assert_eq!(answer["names"][*name], **value, "{content:?}");
        }
        let Content::Status { last_reset, .. } = content else { panic!("{content:?}") };
        assert!((answer["signals"]["LastReset"].as_f64().unwrap() - last_reset).abs() < 1e-9);
        assert_eq!(
            (answer["signals"]["Acceptance"].as_f64(), answer["signals"]["NormalisedSquare"].as_f64()),
            (Some(0.5), Some(2.0))
        );
    }
}
