//! The controller as a node: its dictionary is that of its description file.

use std::collections::BTreeMap;

use agv_core::measurement::Time;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller_node::ControllerNode;
use agv_wire::can::frame::Frame;
use agv_wire::can::nmt::NmtState;
use agv_wire::can::sdo::{AbortCode, Object, Request, Response, Value};

use super::frames::frame;

fn at(milliseconds: u64) -> Time {
    Time::from_micros(1_000_000 + milliseconds * 1000)
}

fn node() -> NodeId {
    NodeId::new(16).unwrap()
}

/// The sections of an EDS file (CiA 306), which is an INI file.
fn sections() -> BTreeMap<String, BTreeMap<String, String>> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/agv.eds")).unwrap();
    let mut sections: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
    let mut name = String::new();
    for line in text.lines().map(str::trim) {
        if let Some(found) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            name = found.to_owned();
        } else if let Some((key, value)) = line.split_once('=') {
            sections.entry(name.clone()).or_default().insert(key.to_owned(), value.to_owned());
        }
    }
    sections
}

fn number(text: &str) -> u32 {
    text.strip_prefix("0x").map_or_else(|| text.parse().unwrap(), |digits| u32::from_str_radix(digits, 16).unwrap())
}

fn ask(controller: &mut ControllerNode, request: Request) -> Response {
    let question = Message::SdoRequest { node: node(), bytes: request.encode() }.encode();
    let answer: Frame = controller.handle(&question).unwrap();
    match Message::decode(&answer).unwrap() {
        Message::SdoResponse { node: from, bytes } if from == node() => Response::decode(bytes).unwrap(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_object_of_the_description_is_read_as_described() {
    let mut controller = ControllerNode::new(node(), at(0));
    let mut read = 0;
    for (name, section) in sections() {
        let (index, sub) = name.split_once("sub").unwrap_or((&name, "0"));
        let Ok(index) = u16::from_str_radix(index, 16) else { continue };
        let Some(default) = section.get("DefaultValue") else { continue };
        let object = Object::new(index, sub.parse().unwrap());
        let expected = match default.strip_prefix("$NODEID+") {
            Some(base) => number(base) + 16,
            None => number(default),
        };
        let expected = match number(&section["DataType"]) {
            5 => Response::Read(object, Value::from(expected as u8)),
            6 => Response::Read(object, Value::from(expected as u16)),
            7 => Response::Read(object, Value::from(expected)),
            // 64 bits do not fit an expedited transfer.
            0x1B => Response::Abort(object, AbortCode::UnsupportedAccess),
            other => panic!("{name}: type {other}"),
        };
        assert_eq!(ask(&mut controller, Request::Read(object)), expected, "{name}");
        read += 1;
    }
    assert!(read > 50, "{read}");
    for (object, reason) in [
        (Object::new(0x1017, 0), AbortCode::ReadOnly),
        (Object::new(0x1018, 5), AbortCode::NoSuchSubindex),
        (Object::new(0x1805, 0), AbortCode::NoSuchObject),
    ] {
        let response = ask(&mut controller, Request::Write(object, Value::from(7u16)));
        assert_eq!(response, Response::Abort(object, reason));
    }
}

#[test]
fn who_reads_the_revision_knows_which_content_comes() {
    let mut controller = ControllerNode::new(node(), at(0));
    let object = Object::new(0x1018, 3);
    assert_eq!(ask(&mut controller, Request::Read(object)), Response::Read(object, Value::from(3u32)));
}

#[test]
fn the_node_boots_beats_and_obeys() {
    let mut controller = ControllerNode::new(node(), at(0));
    assert!(!controller.is_operational());
    assert_eq!(controller.poll(at(0)), Some(frame("710#00")));
    let mut beats = Vec::new();
    for millisecond in 0..1000 {
        while let Some(sent) = controller.poll(at(millisecond)) {
            beats.push((millisecond, sent));
        }
    }
    assert_eq!(beats.len(), 10);
    assert!(beats.iter().zip(0u64..).all(|((when, sent), index)| *when == 100 * index && *sent == frame("710#05")));
    let orders =
        [("000#0210", NmtState::Stopped), ("000#8000", NmtState::PreOperational), ("000#0110", NmtState::Operational)];
    for (second, (order, state)) in (2..).zip(orders) {
        assert_eq!(controller.handle(&frame(order)), None);
        assert_eq!(controller.is_operational(), state == NmtState::Operational);
        let beat = controller.poll(at(1000 * second)).unwrap();
        assert_eq!(Message::decode(&beat), Ok(Message::Heartbeat { node: node(), state }));
    }
    // A command to another node, and a reset.
    assert_eq!(controller.handle(&frame("000#0211")), None);
    assert!(controller.is_operational());
    controller.handle(&frame("000#8110"));
    assert_eq!(controller.poll(at(90_000)), Some(frame("710#00")));
    controller.handle(&frame("000#0210"));
    assert_eq!(controller.handle(&frame("610#4000100000000000")), None);
}
