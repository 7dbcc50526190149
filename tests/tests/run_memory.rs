//! Once it runs, the controller on Linux takes no memory: all of the program's is counted while a vehicle drives, whose sensors are in
//! a program of their own.
#![cfg(target_os = "linux")]

use std::alloc::System;
use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, TcpListener};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::measurement::Time;
use agv_host_sim::bus::{self, Bus, SlcanBus};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::provision::flash_image;
use agv_host_sim::recording::Recording;
use agv_host_sim::run::{FLASH, Logs, Options, Ports, RealTime, RingOptions, Running, run};
use agv_host_sim::serve::nav350::{Drive, Nav350, Options as SensorOptions};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{simulate, standard};
use agv_settings::Settings;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::PoseReceiver;
use agv_wire::nav350::SensorFrame;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Says that this program is that of the sensors.
const SENSORS: &str = "AGV_RUN_SENSORS";
const NAME: &str = "nothing_is_taken_once_it_runs";
const PATIENCE: Duration = Duration::from_secs(60);
/// Poses during which nothing may be taken: five seconds.
const POSES: u64 = 500;

fn hall() -> Recording {
    simulate(&toml::from_str::<Scenario>(standard::HALL).unwrap()).unwrap().recording
}

/// The sensors' program. It ends with this value.
struct Sensors(Child);

impl Drop for Sensors {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Plays encoders and laser at ports that it prints, until it is ended.
fn play() {
    let recording = hall();
    let settings = Settings::of(recording.parameters);
    let drive = Drive::new(&recording, SensorFrame::default()).unwrap();
    let first = drive.turns()[0].start;
    let sensor = Nav350::new(drive, SensorOptions { stands: true, ..SensorOptions::default() });
    let [laser, adapter] = [(); 2].map(|()| TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap());
    println!("\nports {} {}", laser.local_addr().unwrap().port(), adapter.local_addr().unwrap().port());
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| sensor.serve(&laser, &is_over));
        let mut bus = SlcanBus::accept(adapter.accept().unwrap().0).unwrap();
        let mut motion = EmulatedMotion::new(&recording, &EncoderNodes::of(&settings)).unwrap().standing();
        let mut receiver = PoseReceiver::new(NodeId::new(settings.nodes.controller).unwrap());
        let sample = recording.events.iter().find(|event| event.is_odometry()).and_then(|event| event.time());
        let (clock, shift) = (Clock::new(1.0), sample.map_or(0.0, |time: Time| time.since(first)));
        loop {
            for frame in motion.poll(clock.now()) {
                bus.send(&frame.into()).unwrap();
            }
            // The controller has ended.
            let Ok(heard) = bus.receive(Instant::now() + Duration::from_millis(1)) else { return };
            let Some(frame) = heard.as_ref().and_then(|frame| frame.classic()) else { continue };
            for answer in motion.handle(frame) {
                bus.send(&answer.into()).unwrap();
            }
            let pose = receiver.handle(frame);
            if motion.start().is_none() && pose.is_some_and(|pose| pose.mode == agv_core::state::Mode::Reflectors) {
                sensor.begin(Instant::now());
                motion.begin(clock.now().offset(shift));
            }
        }
    });
}

#[test]
fn nothing_is_taken_once_it_runs() {
    if std::env::var_os(SENSORS).is_some() {
        return play();
    }
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", NAME, "--nocapture"])
        .env(SENSORS, "1")
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut sensors = Sensors(child);
    let said = BufReader::new(sensors.0.stdout.take().unwrap());
    let line = said.lines().map(Result::unwrap).find(|line| line.starts_with("ports ")).unwrap();
    let ports: Vec<u16> = line.split(' ').skip(1).map(|port| port.parse().unwrap()).collect();
    let recording = hall();
    let mut settings = Settings::of(recording.parameters);
    (settings.network.laser, settings.network.laser_port) = (Ipv4Addr::LOCALHOST.octets(), ports[0]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(FLASH), flash_image(&settings, &recording.landmarks, None).unwrap()).unwrap();
    let adapter = format!("slcan-tcp:127.0.0.1:{}", ports[1]);
    // Its next part begins behind the test: who writes files takes memory then, but nobody who has a deadline.
    let ring = RingOptions { part: PATIENCE, ..RingOptions::usual(folder.path().join("recording")) };
    let options = Options {
        store: folder.path().to_owned(),
        open_bus: Box::new(move || bus::open(&adapter)),
        lines: None,
        gyro: None,
        ports: Ports::Any,
        real_time: RealTime::default(),
        datagrams: Vec::new(),
        socket: None,
        logs: Logs { whole: None, ring: Some(ring) },
    };
    let is_stopped = Arc::new(AtomicBool::new(false));
    let mut taken = None;
    let look = |running: &Running| {
        let wait = |is_there: &dyn Fn() -> bool| {
            let start = Instant::now();
            while !is_there() && start.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(5));
            }
            is_there()
        };
        let is_driving = || running.condition().was_localised && !running.condition().is_standing;
        if wait(&is_driving) {
            let before = running.poses();
            let region = Region::new(COUNTED);
            let has_come = wait(&|| running.poses() >= before + POSES);
            let change = region.change();
            taken = has_come.then_some((change.allocations, change.reallocations));
        }
        is_stopped.store(true, Ordering::Relaxed);
    };
    let summary = run(options, &is_stopped, &|text| println!("{text}"), look).unwrap();
    assert_eq!(taken, Some((0, 0)), "{summary:?}");
}
