//! Two emulated NAV350 on one vehicle, in simulated time: a session, a clock and a mount each, and one localiser.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::path::Path;

use agv_controller::Laser;
use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{Event, Localizer, Mode, PoseFix};
use agv_core::measurement::{LaserId, Time};
use agv_host_sim::recording::{RecordedEvent, Recording, truth_at};
use agv_host_sim::serve::nav350::{Connection, Drive, Sensor, SensorClockOptions};
use agv_host_sim::simulate::scenario::{PoseOptions, Scenario};
use agv_host_sim::simulate::{START, simulate};
use agv_wire::nav350::{Configuration, Revolution, SensorFrame, Step};

/// When the vehicle drives off, s.
const BEGIN: f64 = 5.0;
/// How long it drives, s.
const SECONDS: f64 = 20.0;
/// Room for the longest telegram.
const TELEGRAM: usize = 18 * 1024;

/// A drive as a laser there would see it. What the encoders say is the same wherever the laser is.
fn recording(mount: PoseOptions) -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/warehouse_hall.toml");
    let mut scenario = Scenario::read(&path).unwrap();
    scenario.laser.mounting = mount;
    scenario.laser.scans = false;
    simulate(&scenario).unwrap().recording
}

/// A sensor with its session.
struct Link {
    sensor: Sensor,
    connection: Connection,
    laser: Box<Laser<TELEGRAM>>,
    revolution: Box<Revolution>,
}

impl Link {
    fn new(recording: &Recording, laser: LaserId, clock: u32) -> Self {
        let drive = Drive::new(recording, SensorFrame::default()).unwrap();
        let clock = SensorClockOptions { start: clock, ..SensorClockOptions::default() };
        Self {
            sensor: Sensor::new(drive, clock, None, true),
            connection: Connection::default(),
            laser: Box::new(Laser::new(Configuration::default())),
            revolution: Box::new(Revolution::of(laser)),
        }
    }

    /// Does what there is to do at `now`; `take` is given each revolution.
    fn poll(&mut self, now: Time, mut take: impl FnMut(&Revolution)) {
        let seconds = now.since(Time::default());
        let mut heard: Vec<u8> = self.connection.poll(&self.sensor, seconds).into_iter().flatten().collect();
        loop {
            let taken = self.laser.receive(&heard, now);
            heard.drain(..taken);
            match self.laser.poll(now, &mut self.revolution) {
                Step::Connect => self.laser.connected(now),
                Step::Send(bytes) => {
                    let bytes = bytes.to_vec();
                    heard.extend(self.connection.receive(&mut self.sensor, &bytes, seconds));
                }
                Step::Revolution => take(&self.revolution),
                Step::Report(_) => {}
                Step::Disconnect(reason) => panic!("{reason}"),
                Step::Wait(_) if heard.is_empty() => return,
                Step::Wait(_) => {}
            }
        }
    }
}

#[test]
fn two_sensors_localise_one_vehicle() {
    let front = PoseOptions::default();
    let rear = PoseOptions { x: -0.6, y: 0.2, heading_deg: 170.0 };
    let [front, rear] = [front, rear].map(recording);
    let second = LaserId::new(1).unwrap();
    let mut parameters = front.parameters;
    parameters.lasers = parameters.lasers.with(second, *rear.parameters.lasers.first());
    assert!(parameters.lasers.first().between(rear.parameters.lasers.first()).x.abs() > 0.1);
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
    localizer.add_landmarks(&front.landmarks).unwrap();
    let mut links = [Link::new(&front, LaserId::FIRST, 77), Link::new(&rear, second, 1_000_000)];
    let begin = Time::from_seconds(BEGIN);
    let shifted = |time: Time| begin.offset(time.since(START));
    let mut encoders = front.events.iter().filter_map(|event| match event {
        RecordedEvent::Encoders(sample) => Some(*sample),
        _ => None,
    });
    let mut next = encoders.next();
    let (mut accepted, mut worst, mut poses) = ([0; 2], (0.0_f64, 0.0_f64), 0);
    for millisecond in 1..((BEGIN + SECONDS) * 1e3) as u64 {
        let now = Time::from_micros(1_000 * millisecond);
        if now == begin {
            for link in &mut links {
                link.sensor.begin(BEGIN);
            }
            let pose = front.truth.first().unwrap().pose;
            let fix = PoseFix { time: now, pose, position_deviation: 0.05, heading_deviation: 0.01 };
            localizer.handle(&Event::SetPose(fix));
        }
        while let Some(sample) = next.filter(|sample| shifted(sample.time) <= now && now >= begin) {
            let mut sample = sample;
            sample.time = shifted(sample.time);
            let said = localizer.handle(&Event::Encoders(sample)).pose;
            next = encoders.next();
            let Some(truth) = truth_at(&front.truth, START.offset(said.time.since(begin))) else { continue };
            if now.since(begin) > 2.0 {
                let off: Pose = said.pose.between(&truth);
                worst = (worst.0.max(off.x.hypot(off.y)), worst.1.max(difference(said.pose.theta, truth.theta).abs()));
                poses += 1;
            }
        }
        for (link, accepted) in links.iter_mut().zip(&mut accepted) {
            link.poll(now, |revolution| {
                if now < begin {
                    return;
                }
                if let Some(seen) = revolution.reflectors() {
                    localizer.handle(&Event::Reflectors(seen));
                    let uses = &localizer.outputs().uses;
                    assert!(uses.iter().all(|used| used.laser == seen.laser));
                    *accepted += usize::from(localizer.outputs().sources.reflectors.accepted > 0);
                }
            });
        }
    }
    println!("{poses} poses, largest error {:.1} mm, {:.3} deg; {accepted:?}", 1e3 * worst.0, worst.1.to_degrees());
    assert!(poses > 1500 && accepted.iter().all(|revolutions| *revolutions > 100), "{poses} {accepted:?}");
    assert!(worst.0 < 0.025 && worst.1 < 0.003, "{worst:?}");
    assert_eq!(localizer.outputs().pose.mode, Mode::Reflectors);
}
