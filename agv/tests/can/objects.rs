//! The controller's object dictionary, as the library `canopen` and the tool `eds-validate` see it.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

use agv_controller::{Bus, BusOutput, ControllerIdentity, Estimate, SettingObjects, Troubles, object_of};
use agv_core::geometry::Pose;
use agv_core::integrity::ProtectionLevel;
use agv_core::localizer::PredictionState;
use agv_core::measurement::Time;
use agv_core::state::{LaserHealth, Mode, PoseOutput, Reason, Relocalization};
use agv_settings::leaf::Value as Setting;
use agv_settings::{LEAVES, Settings};
use agv_tests::{python, repository};
use agv_wire::can::controller_node::CarriedMap;
use agv_wire::can::frame::{Frame, Id, standard_id};
use serde_json::Value;

#[test]
fn eds_validate_has_nothing_to_say() {
    let Some(mut python) = python("eds_validate_has_nothing_to_say", "eds_utils.eds_validate") else { return };
    let output = python
        .args(["-c", "from eds_utils.eds_validate import eds_validate; eds_validate()"])
        .arg(repository("docs/agv.eds"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr) + String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.trim().is_empty(), "{said}");
}

fn line(frame: &Frame) -> String {
    let Id::Standard(id) = frame.id() else { panic!("29 bits") };
    let bytes: String = frame.data().iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{:03X}#{bytes}\n", id.as_raw())
}

fn parse(line: &str) -> Frame {
    let (id, data) = line.split_once('#').unwrap();
    let bytes: Vec<u8> = data
        .as_bytes()
        .chunks(2)
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect();
    Frame::new(standard_id(u16::from_str_radix(id, 16).unwrap()), &bytes).unwrap()
}

fn estimate() -> Estimate {
    let pose = PoseOutput {
        time: Time::from_micros(70_123_456),
        pose: Pose { x: 12.3456, y: -1.0, theta: -1.234_567 },
        covariance: [1e-4, 0.0, 4e-4, 0.0, 0.0, 1e-6],
        mode: Mode::Mixed,
        reason: Reason::None,
        dead_reckoning_distance: 1.5,
        correction: 0.0,
        smooth: Pose::default(),
        acceptance: 1.0,
        level: ProtectionLevel { position: 0.073, heading: 0.01 },
        normalised_square: 2.0,
        resets: 7,
        last_reset: 0.0,
        overflows: 0,
    };
    Estimate { answered: 1, pose, prediction: PredictionState::default(), relocalization: Relocalization::Idle }
}

/// Settings of which none is the default where it can be another.
fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.nodes.vendor = 0x1A2;
    settings.nodes.encoders[0].node = 5;
    settings.parameters.limits.fastest = 1.25;
    settings.network.gateway = [10, 0, 0, 254];
    settings
}

/// What the master says of each thing; the time goes on by a millisecond for each of its frames.
fn converse(mut master: Command) -> Vec<Value> {
    let settings = settings();
    let mut bus = Bus::new(
        &settings,
        ControllerIdentity {
            hardware: "test bench",
            serial: 3_000_000_001,
            map: CarriedMap { identity: 4_000_000_000, landmarks: 40 },
            stored: None,
        },
        Troubles::default(),
        Time::default(),
    );
    bus.update(&estimate());
    let mut child = master.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let heard = BufReader::new(child.stdout.take().unwrap()).lines();
    let error = child.stderr.take().unwrap();
    let said = std::thread::spawn(move || BufReader::new(error).lines().map(Result::unwrap).collect::<Vec<_>>());
    let mut now = Time::default();
    for text in heard.map(Result::unwrap).take_while(|text| text != "END") {
        let mut answers = String::new();
        let mut take = |output| {
            if let BusOutput::Send(frame) = output {
                answers += &line(&frame);
            }
        };
        bus.hear(&parse(&text), now, &mut SettingObjects::new(&settings), &mut take);
        // Long enough for a PDO to be due.
        for _ in 0..30 {
            now = now.offset(1e-3);
            bus.poll(now, LaserHealth::Sound, &mut take);
        }
        input.write_all(answers.as_bytes()).unwrap();
        input.flush().unwrap();
    }
    drop(input);
    let _ = child.wait();
    said.join().unwrap().iter().map(|text| serde_json::from_str(text).unwrap_or_else(|_| panic!("{text}"))).collect()
}

#[test]
fn another_master_reads_every_object() {
    let Some(mut python) = python("another_master_reads_every_object", "canopen, can") else { return };
    python.arg(repository("agv/tests/can/read_objects.py")).arg(repository("docs/agv.eds")).arg("16");
    let said = converse(python);
    let objects: Vec<&Value> = said.iter().filter(|object| object["index"].is_u64()).collect();
    assert!(objects.len() > 180, "{}", objects.len());
    for object in &objects {
        let expected = match (object["index"].as_u64().unwrap(), object["access"].as_str().unwrap()) {
            // Nothing has happened yet.
            (0x1003, _) if object["sub"] != 0 => Some(0x0800_0024),
            (_, "wo") => Some(0x0601_0001),
            _ => None,
        };
        assert_eq!(object["abort"].as_u64(), expected, "{object}");
    }
    let value = |index: u16, sub: u8| {
        let is_it = |object: &&&Value| object["index"] == index && object["sub"] == sub;
        objects.iter().find(is_it).unwrap_or_else(|| panic!("{index:04X}:{sub}"))["value"].clone()
    };
    for leaf in &LEAVES {
        let found = value(object_of(leaf).index, 0);
        match leaf.value(&settings()) {
            Setting::Number(number) => {
                assert_eq!(found.as_str().unwrap().parse(), Ok(number), "{}", leaf.name);
            }
            Setting::Whole(whole) => assert_eq!(found.as_u64(), Some(whole), "{}", leaf.name),
            Setting::Switch(is_on) => assert_eq!(found.as_bool(), Some(is_on), "{}", leaf.name),
            Setting::Address([a, b, c, d]) => {
                assert_eq!(found.as_u64(), Some(u64::from(u32::from_be_bytes([a, b, c, d]))), "{}", leaf.name);
            }
        }
    }
    assert_eq!(
        (value(0x2010, 1), value(0x2010, 2), value(0x2010, 3)),
        (123_456.into(), (-10_000).into(), (-1_234_567).into())
    );
    // No encoder is on this bus, so the mode is 6, without odometry.
    assert_eq!((value(0x2012, 1), value(0x2013, 1), value(0x1018, 1)), (73.into(), 6.into(), 0x1A2.into()));
    assert_eq!((value(0x2014, 1), value(0x2014, 2)), (4_000_000_000_u32.into(), 40.into()));
    assert_eq!((value(0x1008, 0), value(0x1009, 0)), ("Localisation controller".into(), "test bench".into()));
    let rest: Vec<&Value> = said.iter().filter(|object| !object["index"].is_u64()).collect();
    let [mapped, pdo, heartbeat, end] = rest[..] else { panic!("{rest:?}") };
    assert_eq!(*mapped, serde_json::json!({"mapped": [[0x2010, 1], [0x2013, 1], [0x2012, 1]], "timer": 20}));
    assert_eq!(*pdo, serde_json::json!({"pdo": [123_456, 6, 73]}));
    assert_eq!((&heartbeat["heartbeat"], &end["is_over"]), (&250.into(), &true.into()));
}
