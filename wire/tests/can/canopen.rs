//! Messages of CANopen: the literal bytes of the standard and of a recorded drive.

use agv_core::measurement::Time;
use agv_wire::can::canopen::{CanopenError, Message, NodeId, receive_pdo_id, transmit_pdo_id};
use agv_wire::can::emcy::Emergency;
use agv_wire::can::frame::{Frame, extended_id, standard_id};
use agv_wire::can::nmt::{HeartbeatConsumer, NmtCommand, NmtState};
use agv_wire::can::pdo::{MappingEntry, PdoMapping};
use agv_wire::can::sdo::{AbortCode, Object, Request, Response, SdoClient, SdoError, TransferError, Value};
use agv_wire::can::sync::SyncProducer;
use proptest::prelude::*;

use super::frames::{any_classic, frame};

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

#[test]
fn literal_messages() {
    let position = frame("181#EFCDAB00");
    for (text, message) in [
        ("701#00", Message::Heartbeat { node: node(1), state: NmtState::BootUp }),
        ("77F#7F", Message::Heartbeat { node: node(127), state: NmtState::PreOperational }),
        ("705#05", Message::Heartbeat { node: node(5), state: NmtState::Operational }),
        ("705#04", Message::Heartbeat { node: node(5), state: NmtState::Stopped }),
        ("000#0101", Message::Nmt { command: NmtCommand::Start, node: Some(node(1)) }),
        ("000#0100", Message::Nmt { command: NmtCommand::Start, node: None }),
        ("000#8205", Message::Nmt { command: NmtCommand::ResetCommunication, node: Some(node(5)) }),
        ("080#", Message::Sync { counter: None }),
        ("080#07", Message::Sync { counter: Some(7) }),
        ("181#EFCDAB00", Message::TransmitPdo { node: node(1), number: 1, frame: position }),
        ("4FF#01", Message::TransmitPdo { node: node(127), number: 4, frame: frame("4FF#01") }),
        ("201#01", Message::ReceivePdo { node: node(1), number: 1, frame: frame("201#01") }),
        ("501#01", Message::ReceivePdo { node: node(1), number: 4, frame: frame("501#01") }),
        (
            "081#1081050102030405",
            Message::Emergency {
                node: node(1),
                emergency: Emergency { code: 0x8110, register: 5, details: [1, 2, 3, 4, 5] },
            },
        ),
    ] {
        assert_eq!(Message::decode(&frame(text)), Ok(message), "{text}");
        assert_eq!(message.encode(), frame(text), "{text}");
    }
}

#[test]
fn literal_transfers() {
    let position = Object::new(0x6004, 0);
    for (text, request) in [
        ("601#40 04 60 00 00 00 00 00", Request::Read(position)),
        ("601#2B 00 18 05 0A 00 00 00", Request::Write(Object::new(0x1800, 5), Value::from(10u16))),
        ("601#2F 00 18 02 FE 00 00 00", Request::Write(Object::new(0x1800, 2), Value::from(254u8))),
        ("601#23 10 10 01 73 61 76 65", Request::Write(Object::new(0x1010, 1), Value::from(0x6576_6173u32))),
        ("601#80 04 60 00 00 00 04 05", Request::Abort(position, AbortCode::TimedOut)),
    ] {
        let bytes = request.encode();
        assert_eq!(Message::SdoRequest { node: node(1), bytes }.encode(), frame(text), "{text}");
        assert_eq!(Request::decode(bytes), Ok(request), "{text}");
    }
    for (text, response) in [
        ("581#43 04 60 00 EF CD AB 00", Response::Read(position, Value::from(0x00AB_CDEFu32))),
        ("581#60 00 18 05 00 00 00 00", Response::Written(Object::new(0x1800, 5))),
        ("581#80 30 60 01 00 00 02 06", Response::Abort(Object::new(0x6030, 1), AbortCode::NoSuchObject)),
        ("581#80 30 60 01 11 00 09 06", Response::Abort(Object::new(0x6030, 1), AbortCode::NoSuchSubindex)),
        ("581#80 30 60 01 78 56 34 12", Response::Abort(Object::new(0x6030, 1), AbortCode::Other(0x1234_5678))),
        // Two lines of a recorded drive: velocity and torque of node 9, both zero.
        ("589#43 6C 60 00 00 00 00 00", Response::Read(Object::new(0x606C, 0), Value::from(0u32))),
        ("589#4B 77 60 00 00 00 00 00", Response::Read(Object::new(0x6077, 0), Value::from(0u16))),
    ] {
        let Ok(Message::SdoResponse { bytes, .. }) = Message::decode(&frame(text)) else { panic!("{text}") };
        assert_eq!(Response::decode(bytes), Ok(response), "{text}");
        assert_eq!(response.encode(), bytes, "{text}");
    }
    // The size need not be said; then it is four.
    let unsized_answer = [0x42, 0x04, 0x60, 0, 1, 2, 3, 4];
    assert_eq!(Response::decode(unsized_answer), Ok(Response::Read(position, Value::from(0x0403_0201u32))));
    // A long value announces its size instead of being there; a segment is no expedited transfer.
    assert_eq!(Response::decode([0x41, 0x08, 0x10, 0, 20, 0, 0, 0]), Ok(Response::Segmented(Object::new(0x1008, 0))));
    assert_eq!(Response::decode([0x00, 0x41, 0x42, 0x43, 0, 0, 0, 0]), Err(SdoError::Command));
    assert_eq!(Request::decode([0x21, 0x08, 0x10, 0, 20, 0, 0, 0]), Err(SdoError::Command));
}

#[test]
fn foreign_frames_are_told_from_wrong_ones() {
    for (text, error) in [
        ("000#01", CanopenError::Length),
        ("000#0180", CanopenError::Value),
        ("000#0501", CanopenError::Value),
        ("080#0102", CanopenError::Length),
        ("701#", CanopenError::Length),
        ("701#33", CanopenError::Value),
        ("581#00", CanopenError::Length),
        ("100#00", CanopenError::Foreign),
        ("681#00", CanopenError::Foreign),
        ("00000701#00", CanopenError::Foreign),
    ] {
        assert_eq!(Message::decode(&frame(text)), Err(error), "{text}");
    }
    assert_eq!(Message::decode(&Frame::remote(standard_id(0x701), 1).unwrap()), Err(CanopenError::Foreign));
    assert_eq!((NodeId::new(0), NodeId::new(128)), (None, None));
    assert_eq!(transmit_pdo_id(node(127), 1), standard_id(0x1FF));
    assert_eq!(receive_pdo_id(node(16), 3), standard_id(0x410));
    assert_ne!(transmit_pdo_id(node(1), 1), extended_id(0x181));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_frame_is_decoded_or_refused(frame in any_classic()) {
        if let Ok(message) = Message::decode(&frame) {
            let again = message.encode();
            // The toggle bit of node guarding is the one thing that is dropped.
            let is_guarding = matches!(message, Message::Heartbeat { .. });
            prop_assert!(again == frame || is_guarding && again.data()[0] == frame.data()[0] & 0x7F);
        }
    }

    #[test]
    fn any_transfer_is_decoded_or_refused(bytes: [u8; 8]) {
        if let Ok(request) = Request::decode(bytes) {
            prop_assert_eq!(Request::decode(request.encode()), Ok(request));
        }
        if let Ok(response) = Response::decode(bytes) {
            prop_assert_eq!(Response::decode(response.encode()), Ok(response));
        }
    }

    #[test]
    fn abort_codes_keep_their_number(code: u32) {
        prop_assert_eq!(AbortCode::from_code(code).code(), code);
    }

    #[test]
    fn what_is_mapped_is_extracted(lengths in prop::collection::vec(1..=32u8, 1..=8), payload: u64) {
        let mut mapping = PdoMapping::new();
        let mut first = 0;
        for (sub, bits) in (1..).zip(lengths) {
            let object = Object::new(0x2000, sub);
            if mapping.push(MappingEntry { object, bits }) {
                let expected = (u128::from(payload) >> first) & ((1 << bits) - 1);
                prop_assert_eq!(mapping.extract(object, &payload.to_le_bytes()).map(u128::from), Some(expected));
                first += u32::from(bits);
                let missing = (first as usize).div_ceil(8) - 1;
                prop_assert_eq!(mapping.extract(object, &payload.to_le_bytes()[..missing]), None);
            } else {
                prop_assert!(first + u32::from(bits) > 64);
            }
        }
    }
}

#[test]
fn the_two_maps_of_the_profile() {
    let mut mapping = PdoMapping::new();
    assert!(mapping.push(MappingEntry::decode(0x6004_0020)) && mapping.push(MappingEntry::decode(0x6030_0110)));
    let (position, speed) = (Object::new(0x6004, 0), Object::new(0x6030, 1));
    assert_eq!(mapping.entries()[1], MappingEntry { object: speed, bits: 16 });
    assert_eq!(mapping.entries()[1].encode(), 0x6030_0110);
    let data = [0xEF, 0xCD, 0xAB, 0x00, 0xFE, 0xFF];
    assert_eq!(mapping.extract(position, &data), Some(0x00AB_CDEF));
    assert_eq!(mapping.extract(speed, &data).map(|speed| speed as i16), Some(-2));
    assert_eq!(mapping.extract(speed, &data[..4]), None);
    assert_eq!(mapping.extract(Object::new(0x6010, 1), &data), None);
}

const MILLISECOND: f64 = 1e-3;

#[test]
fn a_silent_node_is_asked_three_times() {
    let mut client = SdoClient::new(node(1), 10.0 * MILLISECOND);
    client.begin(Request::Read(Object::new(0x6004, 0)));
    let mut questions = 0;
    let mut outcome = None;
    for millisecond in 0..100 {
        match client.poll(Time::from_micros(millisecond * 1000)) {
            Ok(Some(question)) => {
                assert_eq!(question, frame("601#4004600000000000"));
                questions += 1;
            }
            Ok(None) => {}
            Err(error) => outcome = Some((millisecond, error)),
        }
    }
    assert_eq!((questions, outcome), (3, Some((30, TransferError::NoAnswer))));
    assert!(client.is_idle());
}

#[test]
fn only_the_answer_to_the_question_counts() {
    let (position, range) = (Object::new(0x6004, 0), Object::new(0x6002, 0));
    let mut client = SdoClient::new(node(1), 1.0);
    let value = Value::from(7u32);
    assert_eq!(client.handle(&Response::Read(position, value)), None);
    client.begin(Request::Read(position));
    assert_eq!(client.handle(&Response::Read(position, value)), None, "the question was not sent yet");
    assert!(client.poll(Time::default()).unwrap().is_some());
    assert_eq!(client.handle(&Response::Read(range, value)), None);
    assert_eq!(client.handle(&Response::Written(position)), None);
    assert_eq!(client.handle(&Response::Read(position, value)), Some(Ok(Some(value))));
    client.begin(Request::Write(range, value));
    assert!(client.poll(Time::default()).unwrap().is_some());
    let refusal = Response::Abort(range, AbortCode::ReadOnly);
    assert_eq!(client.handle(&refusal), Some(Err(TransferError::Aborted(AbortCode::ReadOnly))));
}

#[test]
fn sync_comes_in_time_and_never_in_bursts() {
    let mut producer = SyncProducer::new(0.010, Time::from_micros(5_000));
    let mut times = Vec::new();
    // The caller is away from 50 to 95 ms.
    for millisecond in (0..50).chain(95..130) {
        let now = Time::from_micros(millisecond * 1000);
        if let Some(sync) = producer.poll(now) {
            assert_eq!(sync, frame("080#"));
            times.push(millisecond);
        }
    }
    assert_eq!(times, [5, 15, 25, 35, 45, 95, 105, 115, 125]);
}

#[test]
fn a_heart_that_never_beat_is_not_missed() {
    let mut consumer = HeartbeatConsumer::new(0.1);
    assert!(!consumer.is_lost(Time::from_seconds(10.0)));
    consumer.hear(Time::from_seconds(10.0));
    assert!(!consumer.is_lost(Time::from_seconds(10.1)));
    assert!(consumer.is_lost(Time::from_seconds(10.11)));
}
