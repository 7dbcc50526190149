//! The controller as a node. Requests and answers are bytes of CiA 301.

use agv_core::geometry::Pose;
use agv_core::integrity::{AlertLimit, AlertLimits, ProtectionLevel};
use agv_core::measurement::{EncoderFault, Time};
use agv_core::state::{LaserHealth, Mode, PoseOutput, Reason, Relocalization};
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::{Health, PoseReceiver};
use agv_wire::can::controller_node::dictionary::{Access, DataType, OBJECTS};
use agv_wire::can::controller_node::{
    ControllerNode, ErrorKind, NodeSettings, Permission, ProcessData, WithoutSettings,
};
use agv_wire::can::frame::Frame;
use agv_wire::can::nmt::NmtState;
use agv_wire::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};

use super::frames::frame;

pub(super) fn at(milliseconds: u64) -> Time {
    Time::from_micros(1_000_000 + milliseconds * 1000)
}

pub(super) fn node() -> NodeId {
    NodeId::new(16).unwrap()
}

fn controller() -> ControllerNode {
    let mut controller = ControllerNode::new(NodeSettings { vendor: 0x0123_4567, ..NodeSettings::new(node()) }, at(0));
    assert_eq!(controller.poll(at(0)), Some(frame("710#00")));
    assert_eq!(controller.poll(at(0)), Some(frame("710#05")));
    controller
}

pub(super) fn process() -> ProcessData {
    let limit = |position, heading| AlertLimit { position, heading };
    ProcessData {
        pose: PoseOutput {
            time: Time::from_micros(70_123_456),
            pose: Pose { x: 12.3456, y: -1.0, theta: -1.234_567 },
            covariance: [0.01 * 0.01, 0.0, 0.02 * 0.02, 0.0, 0.0, 0.001 * 0.001],
            mode: Mode::Mixed,
            reason: Reason::LaserMoved,
            dead_reckoning_distance: 1.5,
            level: ProtectionLevel { position: 0.0731, heading: f64::INFINITY },
            resets: 7,
            last_reset: 0.0,
            overflows: 2,
            correction: 0.0,
            smooth: Pose::default(),
            acceptance: 1.0,
            normalised_square: 2.0,
        },
        health: Health {
            drive: Some(EncoderFault::Frozen),
            steering: None,
            laser: LaserHealth::Silent,
            start_search: Relocalization::TooFew,
        },
        limits: AlertLimits { travel: limit(0.15, 0.035), docking: limit(0.05, 0.01) },
    }
}

/// A master's end of the bytes.
pub(super) struct Master {
    pub(super) controller: ControllerNode,
    pub(super) now: Time,
    permission: Permission,
}

impl Master {
    fn new() -> Self {
        Self::of(controller())
    }

    /// Of a node that has booted.
    pub(super) fn of(controller: ControllerNode) -> Self {
        Self { controller, now: at(1), permission: Ok(()) }
    }

    pub(super) fn ask(&mut self, bytes: [u8; 8]) -> Option<[u8; 8]> {
        let request = Message::SdoRequest { node: node(), bytes }.encode();
        let answer =
            self.controller.handle(&request, self.now, Some(&process()), &mut OneSetting(0.5), self.permission)?;
        match Message::decode(&answer) {
            Ok(Message::SdoResponse { node: from, bytes }) if from == node() => Some(bytes),
            other => panic!("{other:?}"),
        }
    }

    fn begin(&mut self, first: u8, index: u16, sub: u8, data: [u8; 4]) -> [u8; 8] {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = data;
        let answer = self.ask([first, low, high, sub, a, b, c, d]).unwrap();
        assert_eq!(answer[1..4], [low, high, sub]);
        answer
    }

    /// The bytes of an object, or why not.
    pub(super) fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let answer = self.begin(0x40, index, sub, [0; 4]);
        let data = [answer[4], answer[5], answer[6], answer[7]];
        match answer[0] {
            0x80 => Err(u32::from_le_bytes(data)),
            first if first & 2 != 0 => Ok(data[..4 - usize::from(first >> 2 & 3)].to_vec()),
            0x41 => {
                let (mut bytes, mut toggle) = (Vec::new(), 0);
                loop {
                    let segment = self.ask([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]).unwrap();
                    assert_eq!(segment[0] & 0xF0, toggle);
                    bytes.extend_from_slice(&segment[1..8 - usize::from(segment[0] >> 1 & 7)]);
                    toggle ^= 0x10;
                    if segment[0] & 1 != 0 {
                        assert_eq!(bytes.len(), u32::from_le_bytes(data) as usize);
                        return Ok(bytes);
                    }
                }
            }
            first => panic!("{first:02X}"),
        }
    }

    pub(super) fn number(&mut self, index: u16, sub: u8) -> u64 {
        let bytes = self.read(index, sub).unwrap();
        bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
    }

    /// Writes expedited; 0 or why not.
    pub(super) fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> u32 {
        let mut data = [0; 4];
        data[..value.len()].copy_from_slice(value);
        let answer = self.begin(0x23 | (4 - value.len() as u8) << 2, index, sub, data);
        match answer[0] {
            0x60 => 0,
            0x80 => u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]),
            first => panic!("{first:02X}"),
        }
    }

    pub(super) fn tell(&mut self, text: &str) {
        assert_eq!(self.controller.handle(&frame(text), self.now, None, &mut WithoutSettings, Ok(())), None);
    }

    pub(super) fn publish(&mut self, now: Time) -> Vec<Frame> {
        self.controller.publish(now, &process()).into_iter().collect()
    }
}

/// A dictionary with one setting of eight bytes.
struct OneSetting(f64);

impl ObjectDictionary for OneSetting {
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode> {
        self.writable(object)?;
        Ok(ValueBytes::from_slice(&self.0.to_le_bytes()).unwrap())
    }

    fn writable(&self, object: Object) -> Result<usize, AbortCode> {
        if object == Object::new(0x4064, 0) { Ok(8) } else { Err(AbortCode::NoSuchObject) }
    }

    fn write(&mut self, _: Object, bytes: &[u8]) -> Result<(), AbortCode> {
        self.0 = f64::from_le_bytes(bytes.try_into().unwrap());
        if self.0 < 0.0 { Err(AbortCode::ValueTooLow) } else { Ok(()) }
    }
}

#[test]
fn the_node_boots_beats_and_obeys() {
    let mut controller = ControllerNode::new(NodeSettings::new(node()), at(0));
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
    let tell = |text: &str, controller: &mut ControllerNode| {
        controller.handle(&frame(text), at(0), None, &mut WithoutSettings, Ok(()))
    };
    let orders =
        [("000#0210", NmtState::Stopped), ("000#8000", NmtState::PreOperational), ("000#0110", NmtState::Operational)];
    for (second, (order, state)) in (2..).zip(orders) {
        assert_eq!(tell(order, &mut controller), None);
        assert_eq!(controller.is_operational(), state == NmtState::Operational);
        let beat = controller.poll(at(1000 * second)).unwrap();
        assert_eq!(Message::decode(&beat), Ok(Message::Heartbeat { node: node(), state }));
    }
    // A command to another node, and a reset.
    tell("000#0211", &mut controller);
    assert!(controller.is_operational());
    tell("000#8110", &mut controller);
    assert_eq!(controller.poll(at(90_000)), Some(frame("710#00")));
    tell("000#0210", &mut controller);
    assert_eq!(tell("610#4000100000000000", &mut controller), None);
}

#[test]
fn who_reads_the_revision_knows_which_content_comes() {
    assert_eq!(Master::new().number(0x1018, 3), 3);
}

#[test]
fn what_a_master_looks_at_first_is_there() {
    let mut master = Master::new();
    for (index, sub, expected) in [
        (0x1000, 0, 0),
        (0x1001, 0, 0),
        (0x1003, 0, 0),
        (0x1005, 0, 0x80),
        (0x1014, 0, 0x90),
        (0x1016, 0, 4),
        (0x1016, 4, 0),
        (0x1017, 0, 100),
        (0x1018, 0, 4),
        (0x1018, 1, 0x0123_4567),
        (0x1400, 1, 0x4000_0210),
        (0x1402, 1, 0x4000_0410),
        (0x1602, 1, 0x2007_0040),
        (0x1800, 1, 0x4000_0190),
        (0x1804, 1, 0x4000_0690),
        (0x1804, 2, 254),
        (0x1804, 3, 0),
        (0x1804, 5, 10),
        (0x1A03, 0, 1),
        (0x1A03, 1, 0x2004_0040),
        (0x1A04, 1, 0x2008_0040),
        (0x1A04, 8, 0),
        (0x1F80, 0, 1),
    ] {
        assert_eq!(master.number(index, sub), expected, "{index:04X}:{sub}");
    }
    assert_eq!(master.read(0x1008, 0).unwrap(), b"Localisation controller");
    assert!(master.read(0x100A, 0).unwrap().starts_with(b"agv "));
}

#[test]
fn pose_and_state_are_read_one_by_one() {
    let mut master = Master::new();
    let signed = |number: u64| number as u32 as i32;
    assert_eq!(signed(master.number(0x2010, 1)), 123_456);
    assert_eq!(signed(master.number(0x2010, 2)), -10_000);
    assert_eq!(signed(master.number(0x2010, 3)), -1_234_567);
    for (index, sub, expected) in [
        (0x2010, 4, 70_123),
        (0x2010, 5, 150),
        (0x2011, 1, 100),
        (0x2011, 2, 200),
        (0x2011, 3, 10),
        // 73.1 mm is told as 74 mm; what is not known as the highest number.
        (0x2012, 1, 74),
        (0x2012, 2, 0xFFFF),
        (0x2012, 3, 150),
        (0x2012, 4, 350),
        // The level of the heading is above its limit.
        (0x2012, 5, 2),
        // As `docs/agv.dbc` numbers them.
        (0x2013, 1, 3),
        (0x2013, 2, 10),
        (0x2013, 3, 3),
        (0x2013, 4, 0),
        (0x2013, 5, 2),
        (0x2013, 6, 3),
        (0x2013, 9, 7),
        (0x2013, 10, 2),
    ] {
        assert_eq!(master.number(index, sub), expected, "{index:04X}:{sub}");
    }
    // The telegram is longer than an expedited value: x in the low 30 bits.
    assert_eq!(master.number(0x2001, 0) & 0x3FFF_FFFF, 123_456);
    // Before the first pose there is none.
    let request = frame("610#4001200000000000");
    let answer = master.controller.handle(&request, at(1), None, &mut WithoutSettings, Ok(()));
    assert_eq!(answer, Some(frame("590#8001200024000008")));
}

#[test]
fn what_is_not_served_is_refused_with_its_reason() {
    let mut master = Master::new();
    for (index, sub, reason) in [
        (0x1002, 0, 0x0602_0000),
        (0x1805, 1, 0x0602_0000),
        (0x4065, 0, 0x0602_0000),
        (0x1018, 5, 0x0609_0011),
        (0x1800, 4, 0x0609_0011),
        (0x1000, 1, 0x0609_0011),
        (0x2005, 0, 0x0601_0001),
        (0x1003, 1, 0x0800_0024),
    ] {
        assert_eq!(master.read(index, sub), Err(reason), "{index:04X}:{sub}");
    }
    for (index, sub, value, reason) in [
        (0x1000, 0, &[0, 0, 0, 0][..], 0x0601_0002),
        (0x2010, 1, &[0, 0, 0, 0], 0x0601_0002),
        (0x1017, 0, &[0, 0, 0, 0], 0x0607_0010),
        (0x1017, 0, &[0], 0x0607_0010),
        (0x1017, 1, &[0], 0x0609_0011),
        (0x1003, 0, &[1], 0x0609_0030),
        (0x1014, 0, &[0x91, 0, 0, 0], 0x0609_0030),
        (0x2005, 0, &[0], 0x0607_0010),
        (0x1016, 5, &[0, 0, 0, 0], 0x0609_0011),
        (0x1016, 1, &[0, 0, 0x80, 0], 0x0609_0030),
        // Not in operational.
        (0x1800, 2, &[1], 0x0800_0022),
        (0x1A00, 0, &[0], 0x0800_0022),
    ] {
        assert_eq!(master.write(index, sub, value), reason, "{index:04X}:{sub}");
    }
    // Block transfers, and segments of no transfer.
    for first in [0xA0, 0xA4, 0xC0, 0xC6, 0xE0] {
        let answer = master.begin(first, 0x1008, 0, [0; 4]);
        assert_eq!((answer[0], &answer[4..]), (0x80, &0x0504_0001_u32.to_le_bytes()[..]), "{first:02X}");
    }
    for first in [0x00, 0x60] {
        assert_eq!(master.ask([first, 0, 0, 0, 0, 0, 0, 0]).unwrap()[4..], 0x0504_0001_u32.to_le_bytes());
    }
    // A master that gives up wants no answer, and its transfer is over.
    master.begin(0x40, 0x1008, 0, [0; 4]);
    assert_eq!(master.ask([0x80, 0x08, 0x10, 0, 0, 0, 0, 0]), None);
    assert_eq!(master.ask([0x60, 0, 0, 0, 0, 0, 0, 0]).unwrap()[4..], 0x0504_0001_u32.to_le_bytes());
    // A toggle that does not change.
    master.begin(0x40, 0x1008, 0, [0; 4]);
    assert_eq!(master.ask([0x70, 0, 0, 0, 0, 0, 0, 0]).unwrap()[4..], 0x0503_0000_u32.to_le_bytes());
}

#[test]
fn a_setting_of_eight_bytes_is_read_and_written_in_segments() {
    let mut master = Master::new();
    assert_eq!(master.read(0x4064, 0).unwrap(), 0.5_f64.to_le_bytes());
    let download = |master: &mut Master, value: f64, first: &[u8; 7], count: u8| {
        let bytes = value.to_le_bytes();
        assert_eq!(master.begin(0x21, 0x4064, 0, [8, 0, 0, 0])[0], 0x60);
        let [a, b, c, d, e, f, g] = *first;
        assert_eq!(master.ask([0x00, a, b, c, d, e, f, g]).unwrap()[0], 0x20);
        let last = master.ask([0x11 | (7 - count) << 1, bytes[7], 0, 0, 0, 0, 0, 0]).unwrap();
        if last[0] == 0x30 { 0 } else { u32::from_le_bytes([last[4], last[5], last[6], last[7]]) }
    };
    let first = |value: f64| <[u8; 7]>::try_from(&value.to_le_bytes()[..7]).unwrap();
    assert_eq!(download(&mut master, 0.25, &first(0.25), 1), 0);
    // Longer than it is said to be, and out of bounds.
    assert_eq!(download(&mut master, 0.25, &first(0.25), 2), 0x0607_0010);
    assert_eq!(download(&mut master, -1.0, &first(-1.0), 1), 0x0609_0032);
    // A length that is not the object's.
    assert_eq!(master.begin(0x21, 0x4064, 0, [9, 0, 0, 0])[4..], 0x0607_0010_u32.to_le_bytes());
    assert_eq!(master.write(0x4064, 0, &[1, 2, 3, 4]), 0x0607_0010);
    // Without permission it is only read.
    master.permission = Err(AbortCode::LocalControl);
    assert_eq!(master.begin(0x21, 0x4064, 0, [8, 0, 0, 0])[4..], 0x0800_0021_u32.to_le_bytes());
    assert_eq!(master.read(0x4064, 0).unwrap(), 0.5_f64.to_le_bytes());
}

#[test]
fn an_order_can_be_written_instead_of_sent() {
    let mut master = Master::new();
    assert_eq!(master.controller.take_order(), None);
    assert_eq!(master.begin(0x21, 0x2007, 0, [8, 0, 0, 0])[0], 0x60);
    assert_eq!(master.ask([0x00, 1, 2, 3, 4, 5, 6, 7]).unwrap()[0], 0x20);
    assert_eq!(master.ask([0x1D, 8, 0, 0, 0, 0, 0, 0]).unwrap()[0], 0x30);
    assert_eq!(master.controller.take_order(), Some(frame("410#0102030405060708")));
    assert_eq!(master.controller.take_order(), None);
    // Outside operational it is not taken.
    master.tell("000#8010");
    master.begin(0x21, 0x2007, 0, [8, 0, 0, 0]);
    master.ask([0x00, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(master.ask([0x1D, 8, 0, 0, 0, 0, 0, 0]).unwrap()[4..], 0x0800_0022_u32.to_le_bytes());
    assert_eq!(master.controller.take_order(), None);
}

#[test]
fn poses_come_every_10_ms_and_are_put_together_again() {
    let mut controller = controller();
    let mut receiver = PoseReceiver::new(node());
    let mut counters = Vec::new();
    for millisecond in 0..1000 {
        let frames = controller.publish(at(millisecond), &process());
        assert_eq!(frames.len(), if millisecond % 10 == 0 { 5 } else { 0 });
        for (index, frame) in frames.iter().enumerate() {
            // The third pose loses a frame.
            let received = if millisecond == 20 && index == 2 { None } else { receiver.handle(frame) };
            assert_eq!(received.is_some(), index == 4 && millisecond != 20);
            if let Some(received) = received {
                counters.push(received.counter);
                assert_eq!((received.mode, received.reason), (Mode::Mixed, Reason::LaserMoved));
                assert_eq!(received.health, process().health);
                assert!((received.pose.x - 12.3456).abs() < 1e-9 && (received.pose.theta + 1.234_567).abs() < 1e-9);
            }
        }
    }
    let expected: Vec<u8> = (0..100).filter(|index| *index != 2).map(|index| index % 16).collect();
    assert_eq!(counters, expected);
}

#[test]
fn a_pdo_is_mapped_and_timed_in_pre_operational() {
    let mut master = Master::new();
    master.tell("000#8010");
    assert_eq!(master.publish(at(20)), []);
    // The identifier of a PDO that is on stays, and others keep theirs for themselves.
    assert_eq!(master.write(0x1800, 1, &[0x91, 0x01, 0, 0x40]), 0x0609_0030);
    assert_eq!(master.write(0x1800, 1, &[0x90, 0x01, 0, 0xC0]), 0);
    assert_eq!(master.write(0x1800, 1, &[0x80, 0x00, 0, 0x40]), 0x0609_0030);
    // Entries can be written while there are none; they need an object that can be mapped, and its length.
    assert_eq!(master.write(0x1A00, 1, &[0x20, 1, 0x10, 0x20]), 0x0601_0000);
    assert_eq!(master.write(0x1A00, 0, &[0]), 0);
    assert_eq!(master.write(0x1A00, 1, &[0x20, 0, 0x00, 0x10]), 0x0604_0041);
    assert_eq!(master.write(0x1A00, 1, &[0x10, 1, 0x10, 0x20]), 0x0604_0041);
    assert_eq!(master.write(0x1A00, 1, &[0x20, 9, 0x10, 0x20]), 0x0609_0011);
    assert_eq!(master.write(0x1A00, 1, &[0x20, 1, 0x10, 0x20]), 0);
    assert_eq!(master.write(0x1A00, 2, &[0x08, 1, 0x13, 0x20]), 0);
    assert_eq!(master.write(0x1A00, 3, &[0x20, 2, 0x10, 0x20]), 0);
    assert_eq!(master.write(0x1A00, 0, &[3]), 0x0604_0042);
    assert_eq!(master.write(0x1A00, 0, &[2]), 0);
    assert_eq!(master.write(0x1800, 2, &[241]), 0x0609_0030);
    assert_eq!(master.write(0x1800, 5, &[20, 0]), 0);
    assert_eq!(master.write(0x1800, 1, &[0xA0, 0x01, 0, 0x40]), 0);
    // The others are switched off.
    for index in 0x1801..=0x1804 {
        let id = master.number(index, 1) as u32 | 1 << 31;
        assert_eq!(master.write(index, 1, &id.to_le_bytes()), 0);
    }
    master.now = at(30);
    master.tell("000#0110");
    let sent: Vec<(u64, Frame)> =
        (30..91).flat_map(|now| master.publish(at(now)).into_iter().map(move |frame| (now, frame))).collect();
    // 123,456 in steps of 0.1 mm, and mode 3.
    let expected: Vec<(u64, Frame)> = [30, 50, 70, 90].map(|now| (now, frame("1A0#40E2010003"))).to_vec();
    assert_eq!(sent, expected);
    // A reset takes it all back.
    master.tell("000#8210");
    assert_eq!(master.controller.poll(at(100)), Some(frame("710#00")));
    assert_eq!(master.publish(at(100)).len(), 5);
    assert_eq!(master.number(0x1800, 1), 0x4000_0190);
}

#[test]
fn synchronous_pdos_come_at_every_nth_sync() {
    let mut master = Master::new();
    master.publish(at(0));
    master.tell("000#8010");
    for (index, transmission) in [(0x1800, 1), (0x1801, 3), (0x1802, 0), (0x1803, 254), (0x1804, 254)] {
        assert_eq!(master.write(index, 2, &[transmission]), 0);
        assert_eq!(master.write(index, 5, &[0, 0]), 0);
    }
    master.tell("080#");
    master.tell("000#0110");
    let mut counts = [0; 3];
    for sync in 1..=12 {
        assert_eq!(master.publish(at(10 * sync)), []);
        master.tell("080#");
        for frame in master.publish(at(10 * sync + 1)) {
            let place =
                [0x190, 0x290, 0x390].iter().position(|id| agv_wire::can::frame::standard_id(*id) == frame.id());
            counts[place.unwrap()] += 1;
        }
    }
    assert_eq!(counts, [12, 4, 12]);
}

#[test]
fn an_inhibit_time_holds_a_pdo_back() {
    let mut master = Master::new();
    master.tell("000#8010");
    // 25 ms in steps of 0.1 ms; the timer of 10 ms is faster.
    assert_eq!(master.write(0x1800, 3, &[250, 0]), 0);
    master.tell("000#0110");
    let times: Vec<u64> =
        (0..200).filter(|now| master.publish(at(*now)).iter().any(|sent| sent.id() == frame("190#").id())).collect();
    assert!(times.len() > 5 && times.windows(2).all(|pair| pair[1] - pair[0] >= 25), "{times:?}");
}

#[test]
fn errors_come_and_go_and_are_remembered() {
    let mut master = Master::new();
    let controller = &mut master.controller;
    controller.report(ErrorKind::DriveEncoder, at(10));
    assert_eq!(controller.poll(at(10)), Some(frame("090#0573010000000000")));
    assert_eq!(controller.poll(at(10)), None);
    controller.report(ErrorKind::BusOff, at(20));
    assert_eq!(controller.poll(at(20)), Some(frame("090#4081110000000000")));
    assert_eq!(master.number(0x1001, 0), 0x11);
    assert_eq!((master.number(0x1003, 0), master.number(0x1003, 1), master.number(0x1003, 2)), (2, 0x8140, 0x7305));
    // One lasts, the other is over after half a second: the error register tells what remains.
    let controller = &mut master.controller;
    let mut said = Vec::new();
    for now in 20..1000 {
        if now < 700 {
            controller.report(ErrorKind::DriveEncoder, at(now));
        }
        said.extend(
            std::iter::from_fn(|| controller.poll(at(now)))
                .filter(|sent| *sent != frame("710#05"))
                .map(|sent| (now, sent)),
        );
    }
    assert_eq!(said, [(520, frame("090#0000014081000000"))]);
    let end = (1000..1300).find_map(|now| controller.poll(at(now)).filter(|sent| *sent != frame("710#05")));
    assert_eq!(end, Some(frame("090#0000000573000000")));
    assert_eq!(master.number(0x1001, 0), 0);
    assert_eq!((master.number(0x1003, 0), master.write(0x1003, 0, &[0]), master.number(0x1003, 0)), (2, 0, 0));
    // Nine errors: the eight latest are kept.
    for round in 0..9 {
        let kind = if round == 0 { ErrorKind::Lost } else { ErrorKind::Laser };
        master.controller.report(kind, at(10_000 * round + 10_000));
        while master.controller.poll(at(10_000 * round + 10_000)).is_some() {}
        while master.controller.poll(at(10_000 * round + 15_000)).is_some() {}
    }
    assert_eq!((master.number(0x1003, 0), master.number(0x1003, 8)), (8, 0x7300));
}

/// Which of several encoders has failed is told in the first byte of the details, and in the upper half of the entry of 1003h.
#[test]
fn an_emergency_says_which_parts_have_failed_and_another_one_is_told_anew() {
    let mut master = Master::new();
    master.controller.report_of(ErrorKind::DriveEncoder, 0b0010, at(10));
    assert_eq!(master.controller.poll(at(10)), Some(frame("090#0573010200000000")));
    assert_eq!(master.number(0x1003, 1), 0x0002_7305);
    master.controller.report_of(ErrorKind::DriveEncoder, 0b0010, at(20));
    assert_eq!(master.controller.poll(at(20)), None);
    master.controller.report_of(ErrorKind::DriveEncoder, 0b1000, at(30));
    assert_eq!(master.controller.poll(at(30)), Some(frame("090#0573010A00000000")));
    assert_eq!((master.number(0x1003, 0), master.number(0x1003, 1)), (2, 0x000A_7305));
    // All are over, and what fails next is told alone.
    let said = |master: &mut Master, now: u64| {
        std::iter::from_fn(|| master.controller.poll(at(now))).find(|sent| *sent != frame("710#05"))
    };
    assert_eq!(said(&mut master, 600), Some(frame("090#0000000573000000")));
    master.controller.report_of(ErrorKind::DriveEncoder, 0b0001, at(700));
    assert_eq!(said(&mut master, 700), Some(frame("090#0573010100000000")));
}

#[test]
fn emergencies_can_be_switched_off_and_are_remembered() {
    let mut master = Master::new();
    assert_eq!(master.write(0x1014, 0, &[0x90, 0, 0, 0x80]), 0);
    master.controller.report(ErrorKind::Laser, at(10));
    assert_eq!(master.controller.poll(at(10)), None);
    assert_eq!((master.number(0x1001, 0), master.number(0x1003, 1)), (1, 0x7300));
    // A node that is stopped says it when it goes on.
    let mut master = Master::new();
    master.tell("000#0210");
    master.controller.report(ErrorKind::Laser, at(10));
    assert_eq!(master.controller.poll(at(10)), None);
    master.tell("000#8010");
    assert_eq!(master.controller.poll(at(900)), Some(frame("710#7F")));
    assert_eq!(master.controller.poll(at(900)), Some(frame("090#0073010000000000")));
}

#[test]
fn heartbeats_of_others_are_watched_when_they_have_begun() {
    let mut master = Master::new();
    assert_eq!(master.write(0x1017, 0, &[0, 0]), 0);
    assert_eq!(master.write(0x1016, 2, &[0xC8, 0, 0x25, 0]), 0);
    assert_eq!(master.write(0x1016, 1, &[0x64, 0, 0x25, 0]), 0x0604_0043);
    assert_eq!(master.controller.watched().as_slice(), [NodeId::new(0x25).unwrap()]);
    assert_eq!(master.controller.poll(at(5000)), None);
    let hear = |master: &mut Master, text: &str, now| {
        master.controller.handle(&frame(text), at(now), None, &mut WithoutSettings, Ok(()))
    };
    hear(&mut master, "725#05", 6000);
    assert_eq!(master.controller.poll(at(6200)), None);
    assert_eq!(master.controller.poll(at(6201)), Some(frame("090#3081110000000000")));
    hear(&mut master, "725#05", 6300);
    assert_eq!(master.controller.poll(at(6400)), None);
    hear(&mut master, "725#05", 6500);
    hear(&mut master, "725#05", 6690);
    assert_eq!(master.controller.poll(at(6750)), Some(frame("090#0000003081000000")));
}

#[test]
fn the_heartbeat_can_be_changed_and_switched_off() {
    let mut master = Master::new();
    master.now = at(150);
    assert_eq!(master.write(0x1017, 0, &[0x2C, 1]), 0);
    let beats: Vec<u64> = (150..2000).filter(|now| master.controller.poll(at(*now)).is_some()).collect();
    assert_eq!(beats, [450, 750, 1050, 1350, 1650, 1950]);
    assert_eq!(master.write(0x1017, 0, &[0, 0]), 0);
    assert!((2000..9000).all(|now| master.controller.poll(at(now)).is_none()));
}

#[test]
fn a_node_that_does_not_start_itself_waits() {
    let settings = NodeSettings { starts_itself: false, is_master: false, ..NodeSettings::new(node()) };
    let mut controller = ControllerNode::new(settings, at(0));
    assert_eq!(controller.poll(at(0)), Some(frame("710#00")));
    assert_eq!(controller.poll(at(0)), Some(frame("710#7F")));
    assert!(controller.publish(at(1), &process()).is_empty());
    let mut master = Master { controller, now: at(1), permission: Ok(()) };
    assert_eq!(master.number(0x1F80, 0), 4);
    master.tell("000#0100");
    assert_eq!(master.publish(at(1)).len(), 5);
}

#[test]
fn every_object_of_the_table_is_served_as_the_table_says() {
    let mut master = Master::new();
    // Something that is remembered for each place.
    for kind in [
        ErrorKind::Board,
        ErrorKind::Panicked,
        ErrorKind::SettingsLost,
        ErrorKind::Overrun,
        ErrorKind::BusOff,
        ErrorKind::Laser,
        ErrorKind::Lost,
        ErrorKind::Overload,
    ] {
        master.controller.report(kind, at(1));
    }
    while master.controller.poll(at(1)).is_some() {}
    let mut read = 0;
    for record in &OBJECTS {
        for index in record.indices.0..=record.indices.1 {
            for entry in record.entries {
                for sub in entry.subs.0..=entry.subs.1 {
                    let found = master.read(index, sub);
                    if entry.access == Access::Write {
                        assert_eq!(found, Err(0x0601_0001));
                        continue;
                    }
                    let bytes = found.unwrap_or_else(|reason| panic!("{index:04X}:{sub}: {reason:08X}"));
                    assert!(entry.data_type.length().is_none_or(|length| length == bytes.len()), "{index:04X}:{sub}");
                    // It can be written in pre-operational if it says so: then the refusal is not "read only".
                    let value = vec![0xFF; entry.data_type.length().unwrap_or(4).min(4)];
                    let is_refused = master.write(index, sub, &value) == 0x0601_0002;
                    let is_read_only = entry.access != Access::ReadWrite || entry.data_type == DataType::VisibleString;
                    assert_eq!(is_refused, is_read_only, "{index:04X}:{sub}");
                    read += 1;
                }
            }
        }
    }
    assert!(read > 100, "{read}");
}
