//! Every setting changes something: what the localiser says of a drive, what the controller says on its bus, or what a board is wired to.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::path::Path;

use agv_controller::{
    Bus, BusOutput, ChangeableSettings, Controller, ControllerIdentity, Estimate, LaserOrder, Localization, Troubles,
    object_of,
};
use agv_core::filter::{Ekf, Linearisation, Slots};
use agv_core::localizer::{Localizer, PredictionState};
use agv_core::measurement::{EncoderFault, EncoderFaults, Time};
use agv_core::sources::Aid;
use agv_core::state::{LaserHealth, Mode, Relocalization};
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::mapping::contour_mapper::{CELL, map_contours_at};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::replay_in;
use agv_host_sim::serve::nav350::{Connection, Drive, Sensor, SensorClockOptions};
use agv_host_sim::simulate::block_storage::BlockStoragePath;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_lab::equipment::VehicleKind as Simulated;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::{LEAVES, Settings, VehicleKind};
use agv_tests::repository;
use agv_wire::can::canopen::{NodeId, transmit_pdo_id};
use agv_wire::can::controller::Content;
use agv_wire::can::frame::{Frame, Id, extended_id, standard_id};
use agv_wire::nav350::SensorFrame;
use nalgebra::{Matrix1, Vector1};

/// How much of a drive is replayed, s: standing, driving off, a part of a bend.
const SECONDS: f64 = 16.0;

fn simulated(kind: VehicleKind) -> Simulated {
    match kind {
        VehicleKind::Tricycle => Simulated::Tricycle,
        VehicleKind::TricycleSpeed => Simulated::TricycleSpeed,
        VehicleKind::CarSpeed => Simulated::CarSpeed,
        VehicleKind::Differential => Simulated::Differential,
        VehicleKind::BiSteerable => Simulated::BiSteerable,
        VehicleKind::Ackermann => Simulated::Ackermann,
        VehicleKind::Omni3 => Simulated::Omni3,
        VehicleKind::Omni4 => Simulated::Omni4,
        VehicleKind::Mecanum => Simulated::Mecanum,
        VehicleKind::Increments => Simulated::Increments,
    }
}

/// A drive, and the settings of its vehicle.
struct Scene {
    name: &'static str,
    recording: Recording,
    contours: Option<ContourMap>,
}

fn drive(mut scenario: Scenario, kind: VehicleKind) -> Recording {
    scenario.vehicle.reports = simulated(kind).reports();
    let mut recording = simulate(&scenario).unwrap().recording;
    let end = recording.events[0].time().unwrap().offset(SECONDS);
    recording.events.retain(|event| event.time().is_some_and(|time| time < end));
    recording
}

fn hall(kind: VehicleKind) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    let mut scenario = Scenario::read(&path).unwrap();
    scenario.gyro.fitted = kind == VehicleKind::Tricycle;
    drive(scenario, kind)
}

fn storage() -> Recording {
    drive(Scenario::block_storage(BlockStoragePath::P2, 1), VehicleKind::Tricycle)
}

impl Scene {
    fn new(name: &'static str, recording: Recording) -> Self {
        Self { name, recording, contours: None }
    }

    /// All that the settings of the localiser can change, in the order in which they are tried.
    fn all() -> Vec<Self> {
        let mut scenes = vec![Self::new("hall", hall(VehicleKind::Tricycle))];
        // Seconds without a landmark, encoders that are in doubt, then one moved reflector in two.
        let mut doubtful = hall(VehicleKind::Tricycle);
        let start = doubtful.events[0].time().unwrap();
        let after = |event: &RecordedEvent| event.time().unwrap().since(start);
        doubtful.events.retain(|event| !(6.0..12.0).contains(&after(event)) || event.laser().is_none());
        let doubts = (0..30).map(|count| {
            let time = start.offset(9.0 + 0.02 * f64::from(count));
            RecordedEvent::EncoderFaults(EncoderFaults { time, drive: Some(EncoderFault::Missing), steering: None })
        });
        doubtful.events.retain(|event| !(9.0..9.6).contains(&after(event)) || matches!(event, RecordedEvent::Gyro(_)));
        doubtful.events.extend(doubts);
        doubtful.events.sort_by_key(|event| event.span().unwrap().1);
        for landmark in doubtful.landmarks.iter_mut().step_by(2) {
            landmark.x += 0.3;
        }
        scenes.push(Self::new("doubtful", doubtful));
        // Backward from 8 s on, as far as the counter tells.
        let mut backward = hall(VehicleKind::Tricycle);
        let mut turned = None;
        for event in &mut backward.events {
            let is_late = after(event) > 8.0;
            if let RecordedEvent::Encoders(sample) = event
                && is_late
            {
                let drive = *turned.get_or_insert(sample.drive);
                sample.drive = drive.wrapping_sub(sample.drive.wrapping_sub(drive)) & 0xFFFF;
            }
        }
        scenes.push(Self::new("backward", backward));
        let mut sure = hall(VehicleKind::Tricycle);
        sure.parameters.reflectors.range_deviation *= 0.4;
        sure.parameters.reflectors.bearing_deviation *= 0.4;
        scenes.push(Self::new("too sure of its reflectors", sure));
        scenes.push(Self::new("features", storage()));
        let mut dynamic = storage();
        dynamic.parameters.maps.dynamic = true;
        dynamic.landmarks.clear();
        scenes.push(Self::new("dynamic", dynamic));
        let mut slam = storage();
        slam.parameters.maps.slam = true;
        scenes.push(Self::new("slam", slam.clone()));
        slam.parameters.sources.contours = false;
        scenes.push(Self::new("key scans", slam));
        let mut contours = hall(VehicleKind::Tricycle);
        let map = map_contours_at(&contours, &contours.truth, CELL);
        contours.landmarks.clear();
        scenes.push(Self { name: "contours", recording: contours, contours: Some(map) });
        for kind in VehicleKind::ALL.into_iter().filter(|kind| *kind != VehicleKind::Tricycle) {
            scenes.push(Self::new(kind.name(), hall(kind)));
        }
        scenes
    }

    fn settings(&self) -> Settings {
        Settings::of(self.recording.parameters)
    }

    /// What the localiser says with other settings.
    fn outputs(&self, settings: &Settings) -> String {
        let mut recording = self.recording.clone();
        recording.parameters = settings.parameters;
        let again = replay_in(&recording, self.contours.as_ref().map(ContourMap::view), |_| ()).unwrap();
        format!("{:?} {:?} {:?}", again.poses, again.uses, again.dynamic_landmarks)
    }
}

/// A measured x.
struct Measured(Time);

impl Aid<1> for Measured {
    fn time(&self) -> Time {
        self.0
    }

    fn linearise<S: Slots>(&self, _: &Ekf<S>) -> Option<Linearisation<1>> {
        Some(Linearisation::new(Vector1::new(0.01), Matrix1::new(1e-4)).with(0, Vector1::new(1.0)))
    }

    fn gate(&self) -> f64 {
        // Chi-square with one degree of freedom, 99.7 per cent.
        8.81
    }
}

/// What becomes of an aid behind a drive.
fn aided(scene: &Scene, settings: &Settings) -> String {
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(settings.parameters));
    localizer.add_landmarks(&scene.recording.landmarks).unwrap();
    let mut last = Time::default();
    for event in &scene.recording.events {
        last = localizer.handle(&event.view()).pose.time;
    }
    format!("{:?}", localizer.aid(&Measured(last)))
}

/// Where a vehicle that was not told its pose has got in finding it, and whether it takes its map.
fn started(scene: &Scene, settings: &Settings) -> String {
    let mut localizer: Localizer = Localizer::new(settings.parameters);
    localizer.add_landmarks(&scene.recording.landmarks).unwrap();
    let mut localization = Box::new(Localization::new(localizer, settings));
    for event in scene.recording.events.iter().filter(|event| !matches!(event, RecordedEvent::SetPose(_))) {
        localization.handle(&event.view(), |_| ());
        (0..8).for_each(|_| _ = localization.search(|_| ()));
    }
    format!("{:?} {}", localization.estimate(), settings.accepts_map(&scene.recording.landmarks))
}

fn at(milliseconds: u64) -> Time {
    Time::from_micros(1_000_000 + milliseconds * 1000)
}

/// What an encoder answers that has nothing but its operating parameters.
fn answer(question: &Frame) -> Option<Frame> {
    let Id::Standard(id) = question.id() else { return None };
    let number = id.as_raw().checked_sub(0x600)?;
    let &[command, low, high, sub, ..] = question.data() else { return None };
    let is_it = [command, low, high, sub] == [0x40, 0x00, 0x60, 0];
    let bytes = if is_it { [0x4B, low, high, sub, 1, 0, 0, 0] } else { [0x80, low, high, sub, 0, 0, 0x02, 0x06] };
    (1..=6).contains(&number).then(|| Frame::of(standard_id(0x580 + number), bytes))
}

/// What the controller says on its bus, and makes of what it hears there, in three seconds.
fn on_the_bus(scene: &Scene, settings: &Settings) -> String {
    let mut settings = settings.clone();
    let mut bus = Bus::new(&settings, ControllerIdentity::default(), Troubles::default(), at(0));
    let mut said = format!("{:?} {:?}", bus.nodes(), bus.other_frames());
    let mut pose = replay_in(&scene.recording, None, |_| ()).unwrap().poses.last().copied().unwrap();
    (pose.time, pose.mode) = (at(0), Mode::Reflectors);
    let (prediction, relocalization) = (PredictionState::default(), Relocalization::Idle);
    let mut estimate = Estimate { answered: 0, pose, prediction, relocalization };
    let node = NodeId::new(16).unwrap();
    // Encoders that have booted, and say nothing of themselves but how they count.
    let mut answers: Vec<Frame> = (1..=6).map(|number| Frame::of(standard_id(0x700 + number), [0])).collect();
    for now in 0..3000_u64 {
        let count = (now / 10) as u32;
        if now % 10 == 0 {
            // From a level that everything can live with to one that nothing can.
            estimate.answered += 1;
            estimate.pose.time = at(now);
            estimate.pose.level.position = 1e-3 * (0.03 * f64::from(count)).exp();
            estimate.pose.level.heading = 0.2 * estimate.pose.level.position;
            bus.update(&estimate);
        }
        let mut heard = std::mem::take(&mut answers);
        // The vehicle stands, drives, and stands again.
        let ticks = 40 * count.clamp(120, 160);
        if now % 10 == 0 {
            let [low, high, ..] = ticks.to_le_bytes();
            let data = [low, high, 3, 0xFF, high, 0xFF, low, 2];
            heard.extend((1..=6).map(|number| Frame::of(transmit_pdo_id(NodeId::new(number).unwrap(), 1), data)));
            heard.extend([0x1A0, 0x1A1, 0x1A2, 0x1A3].map(|id| Frame::of(standard_id(id), data)));
            heard.extend([0x1A0, 0x1A1, 0x1A2, 0x1A3].map(|id| Frame::of(extended_id(id), data)));
        }
        if now == 50 || now == 2900 {
            // Asks for the vendor, and sets the publishing period.
            heard.push(Frame::of(standard_id(0x610), [0x40, 0x18, 0x10, 1, 0, 0, 0, 0]));
            let period = object_of(Leaf::named("can.publishing_period").unwrap()).index.to_le_bytes();
            heard.push(Frame::of(standard_id(0x610), [0x2B, period[0], period[1], 0, 20, 0, 0, 0]));
            let position = Content::InitialPosition { x: 1.5, y: -2.0 };
            let heading = Content::InitialHeading { heading: 0.5, position_deviation: 0.1, heading_deviation: 0.02 };
            heard.extend([position, heading].map(|content| content.encode(node, (now / 1000) as u8)));
        }
        let mut take = |output: BusOutput| {
            if let BusOutput::Send(frame) = output {
                answers.extend(answer(&frame));
            }
            said.push_str(&format!("{now} {output:?}\n"));
        };
        for frame in heard {
            bus.hear(&frame, at(now), &mut ChangeableSettings::new(&mut settings), &mut take);
        }
        bus.poll(at(now), LaserHealth::Sound, &mut take);
    }
    said
}

/// What is said to the laser in four seconds.
fn to_the_laser(scene: &Scene, settings: &Settings) -> String {
    let localizer: Localizer = Localizer::new(settings.parameters);
    // Listened to, so that no encoder has to answer.
    let mut settings = settings.clone();
    settings.nodes.is_master = false;
    let mut controller = Box::new(Controller::new(&settings, localizer, at(0)));
    let drive = Drive::new(&scene.recording, SensorFrame::default()).unwrap();
    let mut sensor = Sensor::new(drive, SensorClockOptions::default(), None, true);
    let mut connection = Connection::default();
    let (mut said, mut answers) = (Vec::new(), Vec::new());
    for now in 0..4000_u64 {
        let data = [(now / 10) as u8, 0, 0, 0];
        for node in [1, 2].into_iter().filter(|_| now % 10 == 0) {
            let frame = Frame::of(transmit_pdo_id(NodeId::new(node).unwrap(), 1), data);
            controller.hear_bus(&frame, at(now), |_| (), |_| ());
        }
        let mut orders = Vec::new();
        for answer in answers.drain(..) {
            let answer: Vec<u8> = answer;
            controller.hear_laser(&answer, at(now), |order| orders.push(order.map(<[u8]>::to_vec)), |_| ());
        }
        controller.poll_laser(at(now), |order| orders.push(order.map(<[u8]>::to_vec)), |_| ());
        let time = 1e-3 * now as f64;
        for order in orders {
            match order {
                LaserOrder::Connect => controller.connected(at(now)),
                LaserOrder::Disconnect => connection = Connection::default(),
                LaserOrder::Send(bytes) => {
                    answers.push(connection.receive(&mut sensor, &bytes, time));
                    said.push(bytes);
                }
            }
        }
        answers.extend(connection.poll(&sensor, time));
    }
    format!("{said:?}")
}

/// Other values of a setting.
fn others(leaf: &Leaf, value: Value) -> Vec<Value> {
    let (least, most) = leaf.bounds;
    match value {
        Value::Number(number) => {
            let near = [number * 1.5 + 1e-3, number * 0.5, number + 0.05, number - 0.05, number * 5.0 + 0.1];
            let far = [most, least, 0.5 * (least + most), number * 0.02, -number];
            near.into_iter().chain(far).filter(|other| *other != number).map(Value::Number).collect()
        }
        Value::Whole(whole) => {
            let near = [whole.wrapping_add(1), whole.wrapping_sub(1), whole.wrapping_add(4), whole / 2, 2 * whole];
            let far = [most as u64, least as u64];
            near.into_iter().chain(far).filter(|other| *other != whole).map(Value::Whole).collect()
        }
        Value::Switch(is_on) => vec![Value::Switch(!is_on)],
        Value::Address([a, b, c, d]) => vec![Value::Address([a, b, c, d.wrapping_add(1)])],
    }
}

/// What a board alone is told: where it stands in the firmware.
const OF_BOARDS: [(&str, &str); 8] = [
    ("can.bit_rate", "bit_rate"),
    ("network.address", "network.address"),
    ("network.prefix", "network.prefix"),
    ("network.gateway", "network.gateway"),
    ("nav350.address", "network.laser"),
    ("nav350.port", "network.laser_port"),
    ("log.port", "network.log_port"),
    ("service.port", "network.service_port"),
];

fn changes(leaf: &Leaf, scenes: &[Scene], kept: &[String], look: fn(&Scene, &Settings) -> String) -> bool {
    scenes.iter().zip(kept).any(|(scene, kept)| {
        let settings = scene.settings();
        leaf.matters(&settings)
            && others(leaf, leaf.value(&settings)).into_iter().any(|value| {
                let mut other = settings.clone();
                leaf.change(&mut other, value).is_ok() && look(scene, &other) != *kept
            })
    })
}

#[test]
fn every_setting_changes_what_it_says() {
    let scenes = Scene::all();
    let looks: [fn(&Scene, &Settings) -> String; 5] =
        [|scene, settings| scene.outputs(settings), on_the_bus, started, aided, to_the_laser];
    let kept: Vec<Vec<String>> =
        looks.iter().map(|look| scenes.iter().map(|scene| look(scene, &scene.settings())).collect()).collect();
    let leaves: Vec<&Leaf> =
        LEAVES.iter().filter(|leaf| !OF_BOARDS.iter().any(|(name, _)| *name == leaf.name)).collect();
    let idle = |leaves: &[&Leaf]| -> Vec<&'static str> {
        let is_idle = |leaf: &&&Leaf| {
            // Where it shows, if it does.
            let order = match leaf.name {
                name if name.starts_with("can.") || name.starts_with("alert_limits.") => [1, 0, 2, 3, 4],
                "maps.start_search" | "maps.identity" => [2, 0, 1, 3, 4],
                "sources.aids" => [3, 0, 1, 2, 4],
                name if name.starts_with("nav350.") => [4, 0, 1, 2, 3],
                _ => [0, 1, 2, 3, 4],
            };
            !order.into_iter().any(|number| changes(leaf, &scenes, &kept[number], looks[number]))
        };
        leaves.iter().filter(is_idle).map(|leaf| leaf.name).collect()
    };
    // Some take long, so that each second one is of either half.
    let halves: [Vec<&Leaf>; 2] = [0, 1].map(|half| leaves.iter().skip(half).step_by(2).copied().collect());
    let idle: Vec<_> = std::thread::scope(|scope| {
        let threads = halves.each_ref().map(|half| scope.spawn(|| idle(half)));
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    assert!(
        idle.is_empty(),
        "nothing changes with {idle:?}; scenes: {:?}",
        scenes.iter().map(|scene| scene.name).collect::<Vec<_>>()
    );
}

#[test]
fn what_a_board_is_told_stands_in_its_firmware() {
    let mut firmware = String::new();
    let mut folders = vec![repository("firmware/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                firmware.push_str(&std::fs::read_to_string(path).unwrap());
            }
        }
    }
    for (name, field) in OF_BOARDS {
        assert!(Leaf::named(name).is_some() && firmware.contains(field), "{name}");
    }
}
