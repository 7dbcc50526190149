//! What a master has stored (CiA 301, 7.5.2.13), when it is told so, and what a node that starts with it makes of it.

use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller_node::{
    CommunicationParameters, ControllerNode, NodeSettings, PARAMETER_BYTES, WithoutSettings,
};
use agv_wire::can::frame::Frame;
use agv_wire::can::sdo::AbortCode;
use proptest::prelude::*;

use super::controller_node::{Master, at, node};
use super::frames::frame;

/// `save` to 1010h, subindex 1, of node 16.
const SAVE: &str = "610#23 10 10 01 73 61 76 65";
const SAVED: &str = "590#60 10 10 01 00 00 00 00";

fn hear(master: &mut Master, text: &str) -> Option<Frame> {
    master.controller.handle(&frame(text), master.now, None, &mut WithoutSettings, Ok(()))
}

fn started(settings: NodeSettings) -> Master {
    let mut controller = ControllerNode::new(settings, at(0));
    while controller.poll(at(0)).is_some() {}
    Master::of(controller)
}

/// All objects that are stored, as a master reads them.
fn stored_objects(master: &mut Master) -> Vec<(u16, u8, u64)> {
    let communication = (0x1800..=0x1804).flat_map(|index| [1, 2, 3, 5].map(|sub| (index, sub)));
    let mapping = (0x1A00..=0x1A04).flat_map(|index| (0..=8).map(move |sub| (index, sub)));
    let others = [(0x1014, 0), (0x1016, 1), (0x1016, 2), (0x1016, 3), (0x1016, 4), (0x1017, 0)];
    let objects = others.into_iter().chain(communication).chain(mapping);
    objects.map(|(index, sub)| (index, sub, master.number(index, sub))).collect()
}

/// Changes something of each kind, in pre-operational.
fn change(master: &mut Master) {
    master.tell("000#8010");
    let id = |number: u32| number.to_le_bytes();
    for (index, sub, value) in [
        (0x1014, 0, id(1 << 31 | 0x0090)),
        (0x1014, 0, id(0x00A7)),
        (0x1016, 1, id(0x0005_00C8)),
        (0x1016, 4, id(0x0026_01F4)),
        (0x1800, 1, id(1 << 31 | 1 << 30 | 0x0190)),
        (0x1800, 1, id(1 << 30 | 0x01A5)),
        (0x1802, 1, id(1 << 31 | 1 << 30 | 0x0390)),
        // Modes and alarm in one PDO.
        (0x1A03, 1, id(0x2013_0108)),
        (0x1A03, 2, id(0x2012_0508)),
    ] {
        if index == 0x1A03 && sub == 1 {
            assert_eq!(master.write(index, 0, &[0]), 0);
        }
        assert_eq!(master.write(index, sub, &value), 0, "{index:04X}:{sub}");
    }
    for (index, sub, value) in [(0x1017, 0, 250u16), (0x1801, 3, 70), (0x1803, 5, 40)] {
        assert_eq!(master.write(index, sub, &value.to_le_bytes()), 0, "{index:04X}:{sub}");
    }
    for (index, sub, value) in [(0x1804, 2, 7), (0x1A03, 0, 2)] {
        assert_eq!(master.write(index, sub, &[value]), 0, "{index:04X}:{sub}");
    }
}

fn save(master: &mut Master) -> CommunicationParameters {
    assert_eq!(hear(master, SAVE), None);
    let parameters = master.controller.take_save().unwrap();
    assert_eq!(master.controller.saved(true), Some(frame(SAVED)));
    parameters
}

#[test]
fn only_the_word_stores_and_only_who_may() {
    let mut master = started(NodeSettings::new(node()));
    assert_eq!(master.number(0x1010, 1), 1);
    assert_eq!(master.write(0x1010, 1, b"load"), 0x0800_0020);
    assert_eq!(master.controller.take_save(), None);
    for refusal in [AbortCode::DeviceState, AbortCode::LocalControl] {
        let answer = master.controller.handle(&frame(SAVE), at(1), None, &mut WithoutSettings, Err(refusal)).unwrap();
        assert_eq!(answer.data()[4..], refusal.code().to_le_bytes());
        assert_eq!(master.controller.take_save(), None);
    }
    assert_eq!(master.controller.saved(true), None, "nobody has asked");
}

#[test]
fn it_is_told_when_it_is_stored_and_not_before() {
    let mut master = started(NodeSettings::new(node()));
    assert_eq!(hear(&mut master, SAVE), None);
    assert!(master.controller.take_save().is_some());
    assert_eq!(master.controller.take_save(), None, "it is to be stored once");
    // Whoever asks for something else meanwhile is told to wait, and so is who asks for the same.
    assert_eq!(hear(&mut master, "610#40 00 10 00 00 00 00 00"), Some(frame("590#80 00 10 00 22 00 00 08")));
    assert_eq!(hear(&mut master, SAVE), Some(frame("590#80 10 10 01 22 00 00 08")));
    assert_eq!(master.controller.take_save(), None);
    assert_eq!(master.controller.saved(true), Some(frame(SAVED)));
    assert_eq!(master.controller.saved(true), None);
    assert_eq!(master.number(0x1000, 0), 0, "it serves again");
}

#[test]
fn what_cannot_be_stored_is_a_hardware_error() {
    let mut master = started(NodeSettings::new(node()));
    assert_eq!(hear(&mut master, SAVE), None);
    assert!(master.controller.take_save().is_some());
    assert_eq!(master.controller.saved(false), Some(frame("590#80 10 10 01 00 00 06 06")));
}

#[test]
fn the_word_in_segments_is_confirmed_as_a_segment() {
    let mut master = started(NodeSettings::new(node()));
    assert_eq!(hear(&mut master, "610#21 10 10 01 04 00 00 00"), Some(frame(SAVED)));
    assert_eq!(hear(&mut master, "610#07 73 61 76 65 00 00 00"), None);
    assert!(master.controller.take_save().is_some());
    assert_eq!(master.controller.saved(true), Some(frame("590#20 00 00 00 00 00 00 00")));
}

#[test]
fn a_master_that_has_given_up_is_told_nothing() {
    for gives_up in ["610#80 10 10 01 00 00 04 05", "000#0210", "000#8210"] {
        let mut master = started(NodeSettings::new(node()));
        change(&mut master);
        let changed = stored_objects(&mut master);
        assert_eq!(hear(&mut master, SAVE), None);
        let parameters = master.controller.take_save().unwrap();
        assert_eq!(hear(&mut master, gives_up), None, "{gives_up}");
        assert_eq!(master.controller.saved(true), None, "{gives_up}");
        // It is stored all the same.
        let mut later = started(NodeSettings { stored: Some(parameters), ..NodeSettings::new(node()) });
        assert_eq!(stored_objects(&mut later), changed, "{gives_up}");
        hear(&mut master, "000#8210");
        while master.controller.poll(at(2)).is_some() {}
        assert_eq!(stored_objects(&mut master), changed, "{gives_up}");
    }
}

#[test]
fn everything_that_was_stored_is_there_after_a_start_and_after_a_reset() {
    let mut master = started(NodeSettings::new(node()));
    let by_default = stored_objects(&mut master);
    change(&mut master);
    let changed = stored_objects(&mut master);
    assert!(changed.iter().zip(&by_default).filter(|(now, before)| now != before).count() >= 12);
    // What is not stored is gone with the next reset.
    master.tell("000#8210");
    while master.controller.poll(at(1)).is_some() {}
    assert_eq!(stored_objects(&mut master), by_default);
    change(&mut master);
    let parameters = save(&mut master);
    assert_eq!(CommunicationParameters::decode(&parameters.encode()), Some(parameters));
    master.tell("000#8210");
    while master.controller.poll(at(1)).is_some() {}
    assert_eq!(stored_objects(&mut master), changed);
    let mut later = started(NodeSettings { stored: Some(parameters), ..NodeSettings::new(node()) });
    assert_eq!(stored_objects(&mut later), changed);
    // Three PDOs are sent by their timers: another waits for SYNCs, and one is off.
    assert_eq!(later.publish(at(0)).len(), 3);
}

#[test]
fn what_was_stored_by_default_follows_the_settings() {
    let mut master = started(NodeSettings::new(node()));
    let parameters = save(&mut master);
    for number in [1, 17, 95, 96, 127] {
        let settings = NodeSettings { period: 25, ..NodeSettings::new(NodeId::new(number).unwrap()) };
        let mut plain = ControllerNode::new(settings, at(0));
        let mut stored = ControllerNode::new(NodeSettings { stored: Some(parameters), ..settings }, at(0));
        let said =
            |controller: &mut ControllerNode| -> Vec<Frame> { std::iter::from_fn(|| controller.poll(at(0))).collect() };
        assert_eq!(said(&mut stored), said(&mut plain), "node {number}");
        let process = super::controller_node::process();
        assert_eq!(stored.publish(at(1), &process), plain.publish(at(1), &process), "node {number}");
        assert!(stored.publish(at(20), &process).is_empty() && !stored.publish(at(26), &process).is_empty());
    }
}

/// An emergency that says that not everything was found.
fn tells_of_loss(controller: &mut ControllerNode) -> bool {
    std::iter::from_fn(|| controller.poll(at(0))).any(|sent| sent.data().starts_with(&[0x00, 0x63]))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_leave_a_node_that_speaks_by_default_or_as_it_could_be_told(
        mut bytes in proptest::collection::vec(any::<u8>(), PARAMETER_BYTES..=PARAMETER_BYTES),
        spoilt in proptest::collection::vec((0..PARAMETER_BYTES, any::<u8>()), 0..4),
        is_near in any::<bool>(),
    ) {
        if is_near {
            let mut master = started(NodeSettings::new(node()));
            change(&mut master);
            bytes = save(&mut master).encode().to_vec();
        }
        spoilt.into_iter().for_each(|(place, byte)| bytes[place] = byte);
        bytes[0] = 1;
        let stored = CommunicationParameters::decode(&bytes).unwrap();
        let mut controller = ControllerNode::new(NodeSettings { stored: Some(stored), ..NodeSettings::new(node()) }, at(0));
        let is_lost = tells_of_loss(&mut controller);
        let mut master = Master::of(controller);
        let found = stored_objects(&mut master);
        if is_lost {
            prop_assert_eq!(found, stored_objects(&mut started(NodeSettings::new(node()))));
        } else {
            // What the node speaks like is what it says of it, and can be stored again.
            let again = save(&mut master);
            let mut later = started(NodeSettings { stored: Some(again), ..NodeSettings::new(node()) });
            prop_assert_eq!(stored_objects(&mut later), found);
        }
    }

    #[test]
    fn other_bytes_are_no_parameters(bytes in proptest::collection::vec(any::<u8>(), 0..2 * PARAMETER_BYTES)) {
        let is_right = bytes.len() == PARAMETER_BYTES && bytes[0] == 1;
        prop_assert_eq!(CommunicationParameters::decode(&bytes).is_some(), is_right);
    }
}

#[test]
fn parameters_that_cannot_be_are_told_of() {
    let mut master = started(NodeSettings::new(node()));
    let mut bytes = save(&mut master).encode();
    // The identifier of emergencies becomes that of the network's commands, which is kept for them.
    bytes[1..5].copy_from_slice(&0x0000_0101_u32.to_le_bytes());
    let stored = CommunicationParameters::decode(&bytes);
    let mut controller = ControllerNode::new(NodeSettings { stored, ..NodeSettings::new(node()) }, at(0));
    assert!(tells_of_loss(&mut controller));
}
