//! Lines as `candump` writes them.

use agv_core::measurement::Time;
use agv_core::odometry::Counted;
use agv_host_sim::import::can_log::read;
use agv_host_sim::import::candump::{Line, SeenFrame, log_line, parse_line, screen_line};
use agv_host_sim::link::encoder_listener::EncoderListener;
use agv_tests::recordings;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::encoder::EncoderSettings;
use agv_wire::can::encoder_group::ChannelSettings;
use agv_wire::can::frame::{FdFrame, Frame, extended_id, standard_id};
use agv_wire::can::plausibility::PlausibilityLimits;
use agv_wire::can::sdo::{Object, Response, Value};

fn seen(micros: u64, frame: impl Into<agv_wire::can::frame::AnyFrame>) -> SeenFrame {
    SeenFrame { time: Some(Time::from_micros(micros)), interface: "vcan0".to_owned(), frame: frame.into() }
}

#[test]
fn lines_of_a_log() {
    for (line, expected) in [
        (
            "(1436509053.249713) vcan0 044#2A366C2BBA",
            seen(1_436_509_053_249_713, Frame::of(standard_id(0x44), [0x2A, 0x36, 0x6C, 0x2B, 0xBA])),
        ),
        ("(0000000001.000001) vcan0 1F334455#", seen(1_000_001, Frame::of(extended_id(0x1F33_4455), []))),
        ("(0000000001.500000) vcan0 00000001#11", seen(1_500_000, Frame::of(extended_id(1), [0x11]))),
        ("(0000000002.000000) vcan0 123#R", seen(2_000_000, Frame::remote(standard_id(0x123), 0).unwrap())),
        ("(0000000002.000000) vcan0 123#R4", seen(2_000_000, Frame::remote(standard_id(0x123), 4).unwrap())),
        (
            "(0000000003.000000) vcan0 213##1112233445566778899AABBCC",
            seen(
                3_000_000,
                FdFrame::new(
                    standard_id(0x213),
                    &[0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x99, 0xAA, 0xBB, 0xCC],
                    true,
                )
                .unwrap(),
            ),
        ),
    ] {
        assert_eq!(parse_line(line), Some(Line::Frame(expected.clone())), "{line}");
        assert_eq!(log_line(&expected), line);
    }
    assert_eq!(parse_line("(0000000003.000000) vcan0 20000004#0004000000000000"), Some(Line::Error));
    for line in
        ["", "vcan0", "vcan0 123", "(1.0 vcan0 123#", "vcan0 12#00", "vcan0 123#0", "vcan0 123#R9", "vcan0 123#GG"]
    {
        assert_eq!(parse_line(line), None, "{line}");
    }
}

#[test]
fn lines_of_a_screen() {
    let frame = Frame::of(standard_id(0x589), [0x4B, 0x77, 0x60, 0, 0, 0, 0, 0]);
    let expected = SeenFrame { time: None, interface: "can0".to_owned(), frame: frame.into() };
    assert_eq!(parse_line("  can0  589   [8]  4B 77 60 00 00 00 00 00"), Some(Line::Frame(expected)));
    for frame in [
        frame,
        Frame::of(standard_id(0x80), []),
        Frame::of(extended_id(0x12), [1]),
        Frame::remote(standard_id(0x7FF), 3).unwrap(),
    ] {
        let line = screen_line("can0", &frame.into());
        let Some(Line::Frame(found)) = parse_line(&line) else { panic!("{line}") };
        assert_eq!(found.frame, frame.into(), "{line}");
    }
    let frame = FdFrame::new(standard_id(1), &[7; 16], false).unwrap();
    let Some(Line::Frame(found)) = parse_line(&screen_line("can0", &frame.into())) else { panic!() };
    assert_eq!(found.frame, frame.into());
}

#[test]
fn a_recorded_drive_unit_decodes() {
    let Some(path) = recordings("a_recorded_drive_unit_decodes", "can/candump_ros_canopen_380.log") else { return };
    let text = std::fs::read_to_string(&path).unwrap();
    let frame = |line: &str| match parse_line(line) {
        Some(Line::Frame(seen)) => seen.frame,
        other => panic!("{line}: {other:?}"),
    };
    let frames: Vec<_> = text.lines().map(frame).collect();
    let messages: Vec<Message> =
        frames.iter().map(|frame| Message::decode(frame.classic().unwrap()).unwrap()).collect();
    let node = NodeId::new(9).unwrap();
    let answers: Vec<Response> = messages
        .iter()
        .filter_map(|message| match message {
            Message::SdoResponse { node: from, bytes } if *from == node => Some(Response::decode(*bytes).unwrap()),
            _ => None,
        })
        .collect();
    let (torque, velocity) = (Object::new(0x6077, 0), Object::new(0x606C, 0));
    assert_eq!(answers, [Response::Read(torque, Value::from(0u16)), Response::Read(velocity, Value::from(0u32))]);
    assert_eq!(messages.len(), 5);
    assert_eq!(messages[3], Message::Sync { counter: None });
}

#[test]
fn encoders_are_read_from_a_log_without_their_setup() {
    let channel = |number, counted| ChannelSettings {
        encoder: EncoderSettings {
            range: agv_core::odometry::CounterRange::new(1 << 24),
            ..EncoderSettings::new(NodeId::new(number).unwrap())
        },
        limits: PlausibilityLimits::every(0.010, 1e6, 1e6),
        counted,
    };
    let mut frames = Vec::new();
    for step in 0..50u32 {
        let time = 5_000_000 + 10_000 * u64::from(step);
        frames.push(seen(time, Frame::of(standard_id(0x182), (9 + step).to_le_bytes())));
        frames.push(seen(time, Frame::of(standard_id(0x181), (1000 * step).to_le_bytes())));
    }
    let text: Vec<String> = frames.iter().map(log_line).collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("candump.log");
    std::fs::write(&path, text.join("\n")).unwrap();
    let channels = [channel(1, Counted::Turn), channel(2, Counted::Steering)];
    let mut listener = EncoderListener::new(&channels, Time::from_seconds(5.0), None);
    let frames = read(&path).unwrap().frames;
    let heard = frames.iter().map(|seen| listener.hear(seen.frame.classic().unwrap(), seen.time.unwrap()));
    let samples: Vec<_> = heard
        .filter_map(|(faults, sample)| {
            assert_eq!(faults, None);
            sample
        })
        .collect();
    assert_eq!(samples.len(), 50);
    for (step, sample) in (0..).zip(samples) {
        assert_eq!(sample.counts, [1000 * step, 9 + step, 0, 0]);
        assert_eq!(sample.time.micros(), 5_000_000 + 10_000 * u64::from(step));
    }
}
