//! What the controller says and hears on its bus.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

use agv_controller::{
    Bus, BusOutput, ChangeableSettings, ControllerIdentity, Estimate, SettingObjects, Troubles, object_of,
};
use agv_core::geometry::Pose;
use agv_core::integrity::ProtectionLevel;
use agv_core::localizer::{Event, PredictionState};
use agv_core::measurement::{PoseFix, Time};

use agv_core::state::{LaserHealth, Mode, PoseOutput, Reason, Relocalization};
use agv_settings::leaf::{Leaf, Value};
use agv_settings::{LEAVES, Settings};
use agv_wire::can::canopen::{Message, NodeId, transmit_pdo_id};
use agv_wire::can::controller::Content;
use agv_wire::can::emcy::Emergency;
use agv_wire::can::frame::{Frame, standard_id};

fn at(milliseconds: u64) -> Time {
    Time::from_micros(1_000_000 + milliseconds * 1000)
}

fn node() -> NodeId {
    NodeId::new(16).unwrap()
}

struct Bench {
    bus: Bus,
    settings: Settings,
    sent: Vec<(u64, Frame)>,
    given: Vec<PoseFix>,
    published: usize,
}

impl Bench {
    fn new(settings: Settings) -> Self {
        let mut bus = Bus::new(&settings, ControllerIdentity::default(), Troubles::default(), at(0));
        bus.update(&estimate(Mode::Reflectors));
        Self { bus, settings, sent: Vec::new(), given: Vec::new(), published: 0 }
    }

    fn hear(&mut self, frame: &Frame, now: u64) {
        let Self { bus, settings, sent, given, .. } = self;
        bus.hear(frame, at(now), &mut SettingObjects::new(settings), |output| match output {
            BusOutput::Send(frame) => sent.push((now, frame)),
            BusOutput::Event(told) => {
                if let Event::SetPose(fix) = told.event.event() {
                    given.push(fix);
                }
            }
            BusOutput::Published(_) | BusOutput::Save(_) => {}
        });
    }

    fn run(&mut self, milliseconds: std::ops::Range<u64>) {
        let Self { bus, sent, published, .. } = self;
        for now in milliseconds {
            bus.poll(at(now), LaserHealth::Sound, |output| match output {
                BusOutput::Send(frame) => sent.push((now, frame)),
                BusOutput::Published(_) => *published += 1,
                BusOutput::Event(_) | BusOutput::Save(_) => {}
            });
        }
    }

    fn give_pose(&mut self, counter: u8, now: u64) {
        let position = Content::InitialPosition { x: 1.5, y: -2.0 };
        let heading = Content::InitialHeading { heading: 0.5, position_deviation: 0.1, heading_deviation: 0.02 };
        for content in [position, heading] {
            self.hear(&content.encode(node(), counter), now);
        }
    }

    fn emergencies(&self) -> Vec<u16> {
        let of_frame = |(_, frame): &(u64, Frame)| match Message::decode(frame) {
            Ok(Message::Emergency { node: of, emergency: Emergency { code, .. } }) if of == node() => Some(code),
            _ => None,
        };
        self.sent.iter().filter_map(of_frame).collect()
    }
}

fn estimate(mode: Mode) -> Estimate {
    let pose = PoseOutput {
        time: at(0),
        pose: Pose { x: 1.0, y: 2.0, theta: 0.5 },
        covariance: [1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-6],
        mode,
        reason: Reason::None,
        dead_reckoning_distance: 0.0,
        correction: 0.0,
        smooth: Pose::default(),
        acceptance: 1.0,
        level: ProtectionLevel { position: 0.05, heading: 0.01 },
        normalised_square: 2.0,
        resets: 0,
        last_reset: 0.0,
        overflows: 0,
    };
    Estimate { answered: 1, pose, prediction: PredictionState::default(), relocalization: Relocalization::Idle }
}

fn tell(bench: &mut Bench, command: u8, now: u64) {
    bench.hear(&Frame::of(standard_id(0), [command, 16]), now);
}

#[test]
fn by_default_the_bus_carries_five_telegrams_every_10_ms() {
    let mut bench = Bench::new(Settings::default());
    bench.run(0..1000);
    for id in [0x190, 0x290, 0x390, 0x490, 0x690] {
        let times: Vec<u64> =
            bench.sent.iter().filter(|(_, frame)| frame.id() == standard_id(id)).map(|(now, _)| *now).collect();
        assert_eq!(times, (0..100).map(|count| 10 * count).collect::<Vec<_>>(), "{id:03X}");
    }
    assert_eq!(bench.published, 100);
}

#[test]
fn an_initial_pose_over_the_bus_needs_permission_and_standstill() {
    let mut settings = Settings::default();
    settings.nodes.accepts_pose = true;
    let mut bench = Bench::new(settings.clone());
    bench.run(0..10);
    bench.give_pose(1, 10);
    assert_eq!(bench.given.len(), 1);
    // Not outside operational.
    tell(&mut bench, 0x80, 20);
    bench.give_pose(2, 20);
    tell(&mut bench, 0x01, 30);
    assert_eq!(bench.given.len(), 1);
    bench.run(30..40);
    assert_eq!(bench.emergencies(), []);
    // Without permission it is refused, and that is said.
    settings.nodes.accepts_pose = false;
    let mut bench = Bench::new(settings);
    bench.run(0..10);
    bench.give_pose(1, 10);
    assert!(bench.given.is_empty());
    bench.run(10..2000);
    assert!(bench.emergencies().starts_with(&[0xFF03, 0]), "{:?}", bench.emergencies());
}

#[test]
fn a_moving_vehicle_takes_no_pose_from_the_bus() {
    let mut settings = Settings::default();
    settings.nodes.accepts_pose = true;
    // Listened to, so that no one has to answer for them.
    settings.nodes.is_master = false;
    let mut bench = Bench::new(settings);
    let turn = |bench: &mut Bench, now: u64, ticks: u32| {
        let steering = Frame::of(transmit_pdo_id(NodeId::new(2).unwrap(), 1), [0; 4]);
        bench.hear(&Frame::of(transmit_pdo_id(NodeId::new(1).unwrap(), 1), ticks.to_le_bytes()), now);
        bench.hear(&steering, now);
        bench.run(now..now + 10);
    };
    for step in 0..300_u32 {
        turn(&mut bench, u64::from(10 * step), 20 * step);
    }
    bench.give_pose(1, 3000);
    assert!(bench.given.is_empty());
    for step in 300..450_u32 {
        turn(&mut bench, u64::from(10 * step), 20 * 299);
    }
    bench.give_pose(2, 4500);
    assert_eq!(bench.given.len(), 1);
    assert!(bench.emergencies().contains(&0xFF03));
    // A controller that is no master commands nobody and asks nobody.
    let is_command =
        |frame: &Frame| matches!(Message::decode(frame), Ok(Message::Nmt { .. } | Message::SdoRequest { .. }));
    assert!(!bench.sent.iter().any(|(_, frame)| is_command(frame)));
}

#[test]
fn a_lost_vehicle_and_a_silent_encoder_are_told_as_emergencies() {
    let mut bench = Bench::new(Settings::default());
    bench.bus.update(&Estimate { answered: 2, ..estimate(Mode::Lost) });
    bench.run(0..1900);
    assert_eq!(bench.emergencies(), [0xFF01]);
    // Nobody answers for the encoders.
    bench.run(1900..3000);
    assert_eq!(bench.emergencies(), [0xFF01, 0x7305, 0x7306]);
    // The first node counts the way, and the second one the steering.
    let parts = |code: u16| {
        let emergencies = bench.sent.iter().filter_map(|(_, frame)| match Message::decode(frame) {
            Ok(Message::Emergency { emergency, .. }) if emergency.code == code => Some(emergency.details[0]),
            _ => None,
        });
        emergencies.collect::<Vec<_>>()
    };
    assert_eq!((parts(0x7305), parts(0x7306)), (vec![0b01], vec![0b10]));
    bench.bus.update(&Estimate { answered: 3, ..estimate(Mode::Reflectors) });
    bench.run(3000..4000);
    assert_eq!(bench.emergencies(), [0xFF01, 0x7305, 0x7306, 0]);
}

#[test]
fn every_setting_is_an_object_of_the_node() {
    let mut bench = Bench::new(Settings::default());
    bench.run(0..1);
    let mut objects = std::collections::BTreeSet::new();
    for leaf in &LEAVES {
        let index = object_of(leaf).index;
        assert!((0x4064..=0x43E7).contains(&index) && objects.insert(index), "{}", leaf.name);
        let [low, high] = index.to_le_bytes();
        bench.sent.clear();
        bench.hear(&Frame::of(standard_id(0x610), [0x40, low, high, 0, 0, 0, 0, 0]), 1);
        let first = bench.sent.last().unwrap().1.padded();
        let expected = leaf.value(&bench.settings);
        let bits = match expected {
            Value::Number(number) => number.to_bits(),
            Value::Whole(whole) => whole,
            Value::Switch(is_on) => u64::from(is_on),
            Value::Address([a, b, c, d]) => u64::from(u32::from_be_bytes([a, b, c, d])),
        };
        let value = if first[0] & 2 != 0 {
            u64::from(u32::from_le_bytes([first[4], first[5], first[6], first[7]]))
        } else {
            assert_eq!((first[0], first[4]), (0x41, 8), "{}", leaf.name);
            bench.hear(&Frame::of(standard_id(0x610), [0x60, 0, 0, 0, 0, 0, 0, 0]), 1);
            bench.hear(&Frame::of(standard_id(0x610), [0x70, 0, 0, 0, 0, 0, 0, 0]), 1);
            let [.., (_, one), (_, two)] = &bench.sent[..] else { panic!("two segments") };
            let mut bytes = [0; 8];
            bytes[..7].copy_from_slice(&one.data()[1..]);
            bytes[7] = two.data()[1];
            u64::from_le_bytes(bytes)
        };
        assert_eq!(value, bits, "{}", leaf.name);
        bench.hear(&Frame::of(standard_id(0x610), [0x23, low, high, 0, 0, 0, 0, 0]), 1);
        assert_eq!(bench.sent.last().unwrap().1.padded()[4..], 0x0601_0002_u32.to_le_bytes(), "{}", leaf.name);
    }
}

#[test]
fn a_drive_of_cia_402_is_an_encoder_that_is_only_listened_to() {
    let mut settings = Settings::default();
    settings.nodes.encoders[0].profile = 402;
    assert_eq!(settings.check(), Ok(()));
    let mut bench = Bench::new(settings);
    bench.run(0..3000);
    // The steering's encoder is reset and asked; the drive is left alone.
    let told: Vec<u8> = bench
        .sent
        .iter()
        .filter_map(|(_, frame)| match Message::decode(frame) {
            Ok(Message::Nmt { node, .. }) => node.map(NodeId::number),
            Ok(Message::SdoRequest { node, .. }) => Some(node.number()),
            _ => None,
        })
        .collect();
    assert!(told.len() >= 2 && told.iter().all(|node| *node == 2), "{told:?}");
}

/// Writes a value of up to four bytes; 0 or why it is refused.
fn write(bench: &mut Bench, changed: &mut Settings, name: &str, value: &[u8], now: u64) -> u32 {
    let [low, high] = object_of(Leaf::named(name).unwrap()).index.to_le_bytes();
    let mut request = [0x23 | (4 - value.len() as u8) << 2, low, high, 0, 0, 0, 0, 0];
    request[4..4 + value.len()].copy_from_slice(value);
    let mut answer = [0; 8];
    bench.bus.hear(&Frame::of(standard_id(0x610), request), at(now), &mut ChangeableSettings::new(changed), |output| {
        if let BusOutput::Send(frame) = output {
            answer = frame.padded();
        }
    });
    if answer[0] == 0x60 { 0 } else { u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]) }
}

#[test]
fn settings_are_changed_over_the_bus_if_that_is_permitted() {
    let mut settings = Settings::default();
    let mut changed = settings.clone();
    let mut bench = Bench::new(settings.clone());
    bench.run(0..1);
    assert_eq!(write(&mut bench, &mut changed, "can.drive_node", &[9], 1), 0x0800_0021);
    assert_eq!(changed, settings);
    settings.nodes.accepts_settings = true;
    let mut bench = Bench::new(settings);
    bench.run(0..1);
    for (name, value, reason) in [
        ("can.drive_node", &[9][..], 0),
        ("can.drive_node", &[0], 0x0609_0032),
        ("can.drive_node", &[128], 0x0609_0031),
        ("can.drive_node", &[9, 0], 0x0607_0010),
        ("can.bit_rate", &[125, 0], 0x0604_0043),
        ("can.bit_rate", &[200, 0], 0x0609_0030),
        ("maps.slam", &[2], 0x0609_0030),
        ("maps.slam", &[1], 0),
        ("network.address", &[20, 1, 168, 192], 0),
    ] {
        assert_eq!(write(&mut bench, &mut changed, name, value, 1), reason, "{name} {value:?}");
    }
    assert_eq!((changed.nodes.encoders[0].node, changed.bit_rate, changed.parameters.maps.slam), (9, 500, true));
    assert_eq!(changed.network.address, [192, 168, 1, 20]);
}

#[test]
fn what_of_the_board_does_not_work_is_told_by_its_bit() {
    let troubles = Troubles { damaged_parts: 0b100, ..Troubles::default() };
    let mut bus = Bus::new(&Settings::default(), ControllerIdentity::default(), troubles, at(0));
    let mut told = Vec::new();
    for now in 0..100 {
        bus.poll(at(now), LaserHealth::Sound, |output| match output {
            BusOutput::Send(frame) if frame.id() == standard_id(0x90) => told.push(frame),
            _ => {}
        });
    }
    let [emergency] = told.as_slice() else { panic!("{told:?}") };
    assert_eq!(emergency.data(), [0x00, 0x50, 0x01, 0b100, 0, 0, 0, 0]);
}
