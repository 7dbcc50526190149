//! The master and one scripted encoder.

use agv_core::measurement::Time;
use agv_core::odometry::CounterRange;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::drive_402;
use agv_wire::can::encoder::{
    Encoder, EncoderEvent, EncoderReading, EncoderSettings, EncoderState, Profile, Reporting, SetupError,
};
use agv_wire::can::frame::Frame;
use proptest::prelude::*;

use super::frames::{any_classic, frame};
use super::node::Node;

fn settings(number: u8) -> EncoderSettings {
    EncoderSettings::new(NodeId::new(number).unwrap())
}

fn at(millisecond: u64) -> Time {
    Time::from_micros(millisecond * 1000)
}

/// The master, the node, and everything that happened.
struct Bench {
    master: Encoder,
    node: Node,
    sent: Vec<Frame>,
    events: Vec<EncoderEvent>,
}

impl Bench {
    fn new(settings: EncoderSettings, node: Node) -> Self {
        Self { master: Encoder::new(settings, at(0)), node, sent: Vec::new(), events: Vec::new() }
    }

    fn hear(&mut self, frame: &Frame, now: Time) {
        self.events.extend(self.master.handle(frame, now));
    }

    fn run(&mut self, milliseconds: std::ops::Range<u64>) {
        for millisecond in milliseconds {
            for _ in 0..4 {
                let (sent, event) = self.master.poll(at(millisecond));
                self.events.extend(event);
                let Some(sent) = sent else { continue };
                self.sent.push(sent);
                for answer in self.node.handle(&sent) {
                    self.hear(&answer, at(millisecond));
                }
            }
        }
    }

    fn readings(&self) -> Vec<EncoderReading> {
        let reading =
            |event: &EncoderEvent| if let EncoderEvent::Reading(reading) = event { Some(*reading) } else { None };
        self.events.iter().filter_map(reading).collect()
    }
}

#[test]
fn an_encoder_of_the_profile_is_set_up_and_read() {
    let mut bench = Bench::new(settings(1), Node::new(1));
    bench.run(0..100);
    assert_eq!(bench.events, [EncoderEvent::BootedUp, EncoderEvent::Started]);
    let identity = bench.master.identity().unwrap().clone();
    assert_eq!(identity.range, CounterRange::BITS_24, "all ones is the largest position");
    assert_eq!((identity.units_per_revolution, identity.single_turn_resolution), (Some(4096), Some(4096)));
    assert_eq!(identity.refused_settings, 0);
    // Inhibit time in 100 us, event timer and heartbeat in ms.
    assert_eq!(bench.node.written, [(0x1800, 2, 254), (0x1800, 3, 100), (0x1800, 5, 10), (0x1017, 0, 100)]);
    assert_eq!(bench.sent[0], frame("000#8201"));
    assert_eq!(bench.sent[1], frame("601#4000600000000000"));
    assert_eq!(bench.sent.last(), Some(&frame("000#0101")));
    assert!(bench.node.is_operational);

    bench.hear(&frame("181#EFCDAB00"), at(110));
    bench.hear(&frame("182#01000000"), at(110));
    bench.hear(&frame("181#EFCD"), at(111));
    assert_eq!(bench.readings(), [EncoderReading { time: at(110), position: 0x00AB_CDEF, speed: None }]);
}

#[test]
fn ranges_are_what_the_device_means() {
    for (told, meant) in [
        (0x00FF_FFFF, 1 << 24),
        (0xFFFF_FFFF, 1 << 32),
        (0xFFFF, 1 << 16),
        (0x0100_0000, 1 << 24),
        (36_000, 36_000),
        (40_960_000, 40_960_000),
    ] {
        let mut node = Node::new(1);
        node.objects.insert((0x6002, 0), (told, 4));
        let mut bench = Bench::new(settings(1), node);
        bench.run(0..50);
        assert_eq!(bench.master.identity().unwrap().range.values(), meant, "{told:#X}");
    }
    let mut node = Node::new(1);
    node.objects.insert((0x6002, 0), (0, 4));
    let mut bench = Bench::new(settings(1), node);
    bench.run(0..50);
    assert_eq!(bench.events.last(), Some(&EncoderEvent::SetupFailed(SetupError::NoRange)));
    assert_eq!((bench.master.state(), bench.master.identity()), (EncoderState::WaitingForBootUp, None));
}

#[test]
fn a_range_that_is_not_scaled_is_the_physical_one() {
    for (parameters, resolution, revolutions, meant) in [
        (Some(0), Some(4096), Some(4096), 1 << 24),
        (Some(1), Some(4096), Some(4096), 1 << 24),
        (Some(4), Some(4096), Some(4096), 36_000),
        (None, Some(4096), Some(4096), 36_000),
        (Some(0), Some(8192), Some(1), 8192),
        (Some(0), Some(10_000), Some(4096), 40_960_000),
        (Some(0), Some(131_072), Some(32_768), 1 << 32),
        (Some(0), Some(4096), None, 36_000),
        (Some(0), None, Some(4096), 36_000),
        (Some(0), Some(4096), Some(0), 36_000),
    ] {
        let mut node = Node::new(1);
        let mut put = |index, value: Option<u32>, length| match value {
            Some(value) => _ = node.objects.insert((index, 0), (value, length)),
            None => _ = node.objects.remove(&(index, 0)),
        };
        put(0x6000, parameters, 2);
        put(0x6002, Some(36_000), 4);
        put(0x6501, resolution, 4);
        put(0x6502, revolutions, 2);
        for (set, is_other) in [(None, false), (CounterRange::new(meant), false), (CounterRange::new(meant - 3), true)]
        {
            let mut bench = Bench::new(EncoderSettings { range: set, ..settings(1) }, node.clone());
            bench.run(0..50);
            let identity = bench.master.identity().unwrap();
            let found = (identity.range, identity.tells_other_range);
            assert_eq!(found, (set.unwrap_or(CounterRange::new(meant).unwrap()), is_other), "{parameters:?} {meant}");
        }
    }
}

#[test]
fn a_device_that_lacks_everything_but_positions_is_still_read() {
    let mut node = Node::new(5);
    for index in [0x1017, 0x1800, 0x1A00, 0x6001, 0x6002, 0x6501] {
        node = node.without(index);
    }
    let given = EncoderSettings { range: CounterRange::new(1000), ..settings(5) };
    let mut bench = Bench::new(given, node);
    bench.run(0..50);
    assert_eq!(bench.events.last(), Some(&EncoderEvent::Started));
    assert_eq!(bench.master.identity().unwrap().refused_settings, 4);
    bench.hear(&bench.node.position(999), at(60));
    assert_eq!(bench.readings(), [EncoderReading { time: at(60), position: 999, speed: None }]);
}

#[test]
fn the_older_timer_serves_where_the_event_timer_is_refused() {
    let mut node = Node::new(1);
    node.refusals.insert((0x1800, 5), 0x0609_0011);
    node.objects.insert((0x6200, 0), (0, 2));
    let mut bench = Bench::new(settings(1), node);
    bench.run(0..50);
    assert!(bench.node.written.contains(&(0x6200, 0, 10)), "{:?}", bench.node.written);
    assert_eq!(bench.master.identity().unwrap().refused_settings, 0);
}

/// When the readings of a node, whose reports are made every 10 ms, are said to be true, if one of them is 8 ms late.
fn times_with_one_late(refused: &[(u16, u8)]) -> Vec<Time> {
    let mut node = Node::new(1);
    node.refusals.extend(refused.iter().map(|object| (*object, 0x0601_0002)));
    let mut bench = Bench::new(settings(1), node);
    bench.run(0..50);
    for number in 0..4 {
        let late = if number == 2 { 8 } else { 0 };
        bench.hear(&bench.node.position(number), at(60 + 10 * u64::from(number) + late));
    }
    bench.readings().iter().map(|reading| reading.time).collect()
}

#[test]
fn a_late_report_is_known_to_be_late_while_the_node_keeps_the_timer() {
    // Inhibit time and heartbeat say nothing of when a report is made.
    for refused in [&[][..], &[(0x1800, 3)], &[(0x1017, 0)], &[(0x1800, 3), (0x1017, 0)]] {
        let times = times_with_one_late(refused);
        assert!(times[2].since(at(80)).abs() < 0.001, "{refused:04X?}: {times:?}");
    }
    // A node whose reports do not follow the timer reports as it likes: the timer and the type that obeys it.
    for refused in [&[(0x1800, 5), (0x6200, 0)][..], &[(0x1800, 2)]] {
        assert_eq!(times_with_one_late(refused)[2], at(88), "{refused:04X?}");
    }
}

#[test]
fn a_late_node_is_found_whenever_it_boots() {
    for boot in [300, 1700, 4999] {
        let mut bench = Bench::new(settings(1), Node::new(1));
        bench.node.is_deaf = true;
        bench.run(0..boot);
        assert_eq!((bench.master.state(), &bench.events[..]), (EncoderState::WaitingForBootUp, &[][..]));
        bench.node.is_deaf = false;
        bench.hear(&bench.node.boot_up(), at(boot));
        bench.run(boot..boot + 50);
        assert_eq!(bench.events, [EncoderEvent::BootedUp, EncoderEvent::Started]);
    }
}

#[test]
fn a_node_that_was_there_before_is_found_by_its_heartbeat() {
    let mut bench = Bench::new(settings(1), Node::new(1));
    bench.node.is_deaf = true;
    bench.run(0..20);
    bench.node.is_deaf = false;
    bench.node.is_operational = true;
    bench.hear(&bench.node.heartbeat(), at(20));
    bench.run(20..60);
    assert_eq!(bench.events, [EncoderEvent::Started]);
}

#[test]
fn a_node_that_falls_silent_during_setup_is_reset_again() {
    let mut bench = Bench::new(settings(1), Node::new(1));
    bench.run(0..1);
    bench.node.is_deaf = true;
    bench.master.handle(&bench.node.boot_up(), at(1));
    bench.run(1..400);
    assert_eq!(bench.events.last(), Some(&EncoderEvent::SetupFailed(SetupError::NoAnswer)));
    assert_eq!(bench.master.setup_error(), Some(SetupError::NoAnswer));
    bench.node.is_deaf = false;
    bench.run(400..1250);
    assert_eq!(bench.events.last(), Some(&EncoderEvent::Started));
    assert_eq!((bench.node.resets, bench.master.setup_error()), (2, None));
}

#[test]
fn a_node_that_boots_again_is_set_up_again() {
    let mut bench = Bench::new(settings(1), Node::new(1));
    bench.run(0..50);
    bench.node.is_operational = false;
    bench.node.written.clear();
    bench.hear(&bench.node.boot_up(), at(50));
    bench.hear(&bench.node.position(5), at(51));
    bench.run(51..100);
    assert_eq!(bench.events[2..], [EncoderEvent::BootedUp, EncoderEvent::Started]);
    assert_eq!(bench.node.written.len(), 4);
    assert!(bench.node.is_operational);
}

#[test]
fn a_node_that_was_stopped_is_started_again() {
    let mut bench = Bench::new(settings(1), Node::new(1));
    bench.run(0..50);
    bench.hear(&bench.node.position(5), at(50));
    bench.node.is_operational = false;
    bench.hear(&bench.node.heartbeat(), at(60));
    bench.run(60..61);
    assert!(bench.node.is_operational);
}

#[test]
fn missing_heartbeats_are_noticed_only_where_there_were_some() {
    let mut bench = Bench::new(settings(1), Node::new(1));
    bench.run(0..50);
    assert!(!bench.master.is_heartbeat_lost(at(5000)), "a boot-up message is no heartbeat");
    for millisecond in [150, 250, 350] {
        bench.hear(&bench.node.heartbeat(), at(millisecond));
    }
    assert!(!bench.master.is_heartbeat_lost(at(600)));
    assert!(bench.master.is_heartbeat_lost(at(601)));
}

#[test]
fn positions_are_asked_for_where_no_pdo_comes() {
    let mut without_pdo = Node::new(1);
    without_pdo.objects.insert((0x1800, 1), (0x8000_0181, 4));
    let mut other_map = Node::new(1);
    other_map.objects.insert((0x1A00, 1), (0x6000_0010, 4));
    let polled = EncoderSettings { reporting: Reporting::Polled { period: 10 }, ..settings(1) };
    for (name, node, settings, first) in [
        ("the PDO is off", without_pdo, settings(1), 0),
        ("no position in it", other_map, settings(1), 0),
        ("the PDO does not come", Node::new(1), settings(1), 250),
        ("asked for", Node::new(1), polled, 0),
    ] {
        let mut bench = Bench::new(settings, node);
        bench.node.objects.insert((0x6004, 0), (1234, 4));
        bench.run(0..first + 110);
        let readings = bench.readings();
        assert_eq!(bench.master.state(), EncoderState::Polled, "{name}");
        assert!((10..=11).contains(&readings.len()), "{name}: {}", readings.len());
        assert!(readings.iter().all(|reading| reading.position == 1234), "{name}");
    }
}

#[test]
fn a_polled_position_is_true_between_question_and_answer() {
    let polled = EncoderSettings { reporting: Reporting::Polled { period: 10 }, ..settings(1) };
    let mut bench = Bench::new(polled, Node::new(1));
    bench.run(0..50);
    bench.node.is_deaf = true;
    let count = bench.sent.len();
    let asked = (50..70).find(|millisecond| {
        bench.run(*millisecond..millisecond + 1);
        bench.sent.len() > count
    });
    bench.events.clear();
    bench.node.is_deaf = false;
    let question = *bench.sent.last().unwrap();
    let answer = bench.node.handle(&question).remove(0);
    bench.hear(&answer, at(asked.unwrap() + 4));
    assert_eq!(bench.readings(), [EncoderReading { time: at(asked.unwrap() + 2), position: 0, speed: None }]);
}

#[test]
fn synchronous_positions_are_true_at_the_sync() {
    let synchronous = EncoderSettings { reporting: Reporting::Synchronous, ..settings(1) };
    let mut node = Node::new(1);
    node.objects.insert((0x1A00, 0), (2, 1));
    node.objects.insert((0x1A00, 2), (0x6030_0110, 4));
    let mut bench = Bench::new(synchronous, node);
    bench.run(0..50);
    assert_eq!(bench.node.written[0], (0x1800, 2, 1));
    bench.hear(&frame("080#"), at(60));
    bench.hear(&frame("181#010000000A00"), at(63));
    assert_eq!(bench.readings(), [EncoderReading { time: at(60), position: 1, speed: Some(10) }]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_traffic_leaves_the_master_alive(
        frames in prop::collection::vec(prop_oneof![
            any_classic(),
            // Frames that concern this node.
            (prop::sample::select(vec![0x581u16, 0x701, 0x181, 0x081]), prop::collection::vec(any::<u8>(), 0..=8))
                .prop_map(|(id, data)| Frame::new(agv_wire::can::frame::standard_id(id), &data).unwrap()),
        ], 0..200)
    ) {
        let mut bench = Bench::new(settings(1), Node::new(1));
        bench.run(0..5);
        for (millisecond, frame) in (5..).zip(&frames) {
            bench.hear(frame, at(millisecond));
            bench.run(millisecond..millisecond + 1);
        }
        let end = 5 + frames.len() as u64;
        bench.run(end..end + 3000);
        bench.hear(&bench.node.boot_up(), at(end + 3000));
        bench.run(end + 3000..end + 3100);
        prop_assert_eq!(bench.events.last(), Some(&EncoderEvent::Started));
    }
}

#[test]
fn an_encoder_of_another_master_is_only_listened_to() {
    let range = CounterRange::BITS_24;
    let unmanaged = EncoderSettings { is_managed: false, heartbeat: 0, range: Some(range), ..settings(1) };
    let mut bench = Bench::new(unmanaged, Node::new(1));
    for millisecond in 0..3000 {
        if millisecond % 10 == 0 {
            bench.hear(&frame("181#EFCDAB00"), at(millisecond));
        }
        // It boots in the middle, and is in pre-operational: that is not ours.
        let said = match millisecond {
            1000 => Some("701#00"),
            1001 => Some("701#7F"),
            1002 => Some("581#8000000000000008"),
            _ => None,
        };
        if let Some(said) = said {
            bench.hear(&frame(said), at(millisecond));
        }
        bench.run(millisecond..millisecond + 1);
    }
    assert_eq!(bench.sent, []);
    let readings = bench.readings();
    assert_eq!(readings.len(), 300);
    assert!(readings.iter().all(|reading| reading.position == 0x00AB_CDEF));
    assert_eq!(bench.events.len(), 301);
    assert_eq!((bench.master.identity().unwrap().range, bench.master.state()), (range, EncoderState::Reporting));
    assert!(!bench.master.is_heartbeat_lost(at(9000)));
}

#[test]
fn a_drive_of_cia_402_tells_its_position_and_is_told_nothing() {
    let drive = EncoderSettings { profile: Profile::Drive, ..settings(9) };
    let mut bench = Bench::new(drive, Node::new(9));
    // Status word, position actual value -2: PDO 3 as CiA 402 has it; the others are of other things.
    for (millisecond, text) in [
        (0, "189#3702"),
        (10, "389#3702FEFFFFFF"),
        (15, "489#3702E8030000"),
        (20, "389#370201000000"),
        (21, "389#3702"),
        (25, "709#05"),
    ] {
        bench.hear(&frame(text), at(millisecond));
        bench.run(millisecond..millisecond + 1);
    }
    assert_eq!(bench.sent, []);
    let positions: Vec<u32> = bench.readings().iter().map(|reading| reading.position).collect();
    assert_eq!(positions, [0xFFFF_FFFE, 1]);
    // A position of 32 bits wraps in the middle of that.
    assert_eq!(bench.master.identity().unwrap().range.step(positions[0], positions[1]), 3);
    // The velocity is 1000 of the drive's units, each 0.5 mm/s here.
    let velocity = drive_402::velocity(drive.node, 0.5e-3);
    let heard = frame("489#3702E8030000");
    assert_eq!(heard.id(), velocity.id);
    assert_eq!(velocity.signal.value(heard.data()), Some(0.5));
    assert_eq!(velocity.signal.value(frame("489#370218FCFFFF").data()), Some(-0.5));
}
