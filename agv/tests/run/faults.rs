//! What befalls a controller on a vehicle that drives: its laser is gone, it is killed, nothing can be written. It knows again where it is
//! by itself, and what was stored is there.

use std::net::{Ipv4Addr, TcpListener};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::measurement::Time;
use agv_core::state::Mode;
use agv_host_sim::bus::{Bus, SlcanBus};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::provision::flash_image;
use agv_host_sim::recording::Recording;
use agv_host_sim::serve::nav350::{Drive, Nav350, Options as SensorOptions};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{simulate, standard};
use agv_settings::Settings;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::PoseReceiver;
use agv_wire::nav350::SensorFrame;
use serde_json::Value;

use super::{PATIENCE, Running, free_port, get};
use crate::support::{Files, agv, text};

/// How long the laser is gone, s; a minute where `AGV_LONG` is set.
fn laser_gone() -> Duration {
    Duration::from_secs(if std::env::var_os("AGV_LONG").is_some() { 60 } else { 3 })
}

/// Sensors of a vehicle in the standard hall, at ports of this machine.
struct Vehicle {
    sensor: Nav350,
    motion: Mutex<EmulatedMotion>,
    controller: NodeId,
    /// Whether it is to drive off once it is told where it is.
    drives: AtomicBool,
    clock: Clock,
    /// Time from the first turn of the laser to the first sample of the encoders, s.
    shift: f64,
}

impl Vehicle {
    fn new(recording: &Recording, settings: &Settings) -> Self {
        let drive = Drive::new(recording, SensorFrame::default()).unwrap();
        let first = drive.turns()[0].start;
        let sample = recording.events.iter().find(|event| event.is_odometry()).and_then(|event| event.time());
        Self {
            sensor: Nav350::new(drive, SensorOptions { stands: true, ..SensorOptions::default() }),
            motion: Mutex::new(EmulatedMotion::new(recording, &EncoderNodes::of(settings)).unwrap().standing()),
            controller: NodeId::new(settings.nodes.controller).unwrap(),
            drives: AtomicBool::new(false),
            clock: Clock::new(1.0),
            shift: sample.map_or(0.0, |time: Time| time.since(first)),
        }
    }

    /// Encoders on an adapter, for one controller behind the other.
    fn play_encoders(&self, adapter: &TcpListener, is_over: &AtomicBool) {
        adapter.set_nonblocking(true).unwrap();
        while !is_over.load(Ordering::Relaxed) {
            match adapter.accept() {
                // A controller that is gone is no fault of the encoders.
                Ok((stream, _)) => {
                    stream.set_nonblocking(false).unwrap();
                    let _ = self.talk(SlcanBus::accept(stream).unwrap(), is_over);
                }
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    }

    fn talk(&self, mut bus: SlcanBus, is_over: &AtomicBool) -> Result<(), agv_host_sim::bus::BusError> {
        let mut motion = self.motion.lock().unwrap();
        let mut receiver = PoseReceiver::new(self.controller);
        while !is_over.load(Ordering::Relaxed) {
            for frame in motion.poll(self.clock.now()) {
                bus.send(&frame.into())?;
            }
            let heard = bus.receive(Instant::now() + Duration::from_millis(1))?;
            let Some(frame) = heard.as_ref().and_then(|frame| frame.classic()) else { continue };
            for answer in motion.handle(frame) {
                bus.send(&answer.into())?;
            }
            let pose = receiver.handle(frame);
            let drives = self.drives.load(Ordering::Relaxed) && motion.start().is_none();
            if drives && pose.is_some_and(|pose| pose.mode == Mode::Reflectors) {
                self.sensor.begin(Instant::now());
                motion.begin(self.clock.now().offset(self.shift));
            }
        }
        Ok(())
    }

    /// The laser at its port, but for the time that it is gone.
    fn serve_laser(&self, port: u16, is_gone: &AtomicBool, is_over: &AtomicBool) {
        while !is_over.load(Ordering::Relaxed) {
            if is_gone.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(5));
                continue;
            }
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).unwrap();
            let ends = AtomicBool::new(false);
            std::thread::scope(|scope| {
                let served = scope.spawn(|| self.sensor.serve(&listener, &ends));
                while !is_gone.load(Ordering::Relaxed) && !is_over.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(5));
                }
                ends.store(true, Ordering::Relaxed);
                served.join().unwrap().unwrap();
            });
        }
    }
}

/// A controller of that vehicle, by its configuration and its status.
struct Controller {
    arguments: Vec<String>,
    key: String,
    service: String,
    status: String,
}

impl Controller {
    fn start(&self) -> Running {
        // A file that may not grow is an error then, not a signal.
        let arguments: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        let mut running =
            Running::start_as("sh", &[&["-c", "trap '' XFSZ; exec \"$0\" \"$@\""], &arguments[..]].concat());
        running.ports();
        running
    }

    fn status(&self) -> Value {
        serde_json::from_str(&get(&self.status, "/status")).unwrap()
    }

    /// Waits until its status is so, s.
    fn wait(&self, what: &str, has_come: impl Fn(&Value) -> bool) -> f64 {
        let start = Instant::now();
        loop {
            let status = self.status();
            if has_come(&status) {
                let seconds = start.elapsed().as_secs_f64();
                println!("{what}: after {seconds:.2} s");
                return seconds;
            }
            assert!(start.elapsed() < PATIENCE, "{what} has not come: {status}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn ctl(&self, arguments: &[&str]) -> Result<String, String> {
        let run = agv(&[&["ctl", &self.service, "--key", &self.key], arguments].concat());
        if run.status.success() { Ok(text(&run.stdout).to_owned()) } else { Err(text(&run.stderr).to_owned()) }
    }
}

fn is_localised(status: &Value) -> bool {
    status["is_localised"] == true && status["laser"] == "sound"
}

/// Bounds the files that a program may write, bytes; it may lift the bound again.
fn bound_files(program: u32, bytes: &str) {
    let limit = ["--pid", &program.to_string(), &format!("--fsize={bytes}:")];
    assert!(Command::new("prlimit").args(limit).status().unwrap().success());
}

#[test]
fn a_controller_comes_back_after_each_fault() {
    let recording = simulate(&toml::from_str::<Scenario>(standard::HALL).unwrap()).unwrap().recording;
    let files = Files::new();
    let [log, service, laser, status, adapter] = std::array::from_fn(|_| free_port());
    let mut settings = Settings::of(recording.parameters);
    let network = &mut settings.network;
    (network.laser, network.laser_port) = (Ipv4Addr::LOCALHOST.octets(), laser);
    (network.log_port, network.service_port) = (log, service);
    let store = files.path("store");
    std::fs::create_dir(&store).unwrap();
    let key = files.write("agv.key", crate::ctl::KEY.as_bytes());
    let bytes = std::array::from_fn(|index| u8::from_str_radix(&crate::ctl::KEY[2 * index..][..2], 16).unwrap());
    let image = flash_image(&settings, &recording.landmarks, Some(&bytes)).unwrap();
    std::fs::write(format!("{store}/flash.bin"), image).unwrap();
    let configuration = format!(
        "store = \"{store}\"\nbus = \"slcan-tcp:127.0.0.1:{adapter}\"\nlisten = \"127.0.0.1\"\n[real_time]\n\
         [status]\nlisten = \"127.0.0.1:{status}\"\n"
    );
    let configuration = files.write("vehicle.toml", configuration.as_bytes());
    let own = files.path("own.agvlog");
    let arguments = [env!("CARGO_BIN_EXE_agv"), "run", "--config", &configuration, "--output", &own];
    let controller = Controller {
        arguments: arguments.map(str::to_owned).to_vec(),
        key,
        service: format!("127.0.0.1:{service}"),
        status: format!("127.0.0.1:{status}"),
    };
    let vehicle = Vehicle::new(&recording, &settings);
    let (is_gone, is_over) = (AtomicBool::new(false), AtomicBool::new(false));
    let adapter = TcpListener::bind((Ipv4Addr::LOCALHOST, adapter)).unwrap();
    std::thread::scope(|scope| {
        scope.spawn(|| vehicle.play_encoders(&adapter, &is_over));
        scope.spawn(|| vehicle.serve_laser(laser, &is_gone, &is_over));
        // Whatever it finds, everything ends.
        let outcome =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| befall(&controller, &vehicle, &is_gone, &own)));
        is_over.store(true, Ordering::Relaxed);
        assert!(outcome.is_ok());
    });
}

fn befall(controller: &Controller, vehicle: &Vehicle, is_gone: &AtomicBool, own: &str) {
    let set = |value: &str| controller.ctl(&["set", "odometry.slip", value]).unwrap();
    let is_set = |value: &str| controller.ctl(&["get", "odometry.slip"]).unwrap().contains(value);
    let mut running = controller.start();
    controller.wait("a pose by reflectors", is_localised);
    set("0.004");
    controller.ctl(&["store"]).unwrap();
    bound_files(running.child.id(), "0");
    set("0.005");
    controller.ctl(&["store"]).unwrap_err();
    running.hear("no more is written to it");
    let poses = controller.status()["poses"].as_u64().unwrap();
    controller.wait("poses though nothing can be written", |status| status["poses"].as_u64().unwrap() > poses + 200);
    assert!(is_localised(&controller.status()));

    running.child.kill().unwrap();
    drop(running);
    let mut running = controller.start();
    controller.wait("a pose by reflectors behind a kill", |status| is_localised(status) && status["starts"] == 2);
    assert!(is_set("0.004"));
    // What was refused can be stored once there is room.
    bound_files(running.child.id(), "0");
    set("0.006");
    controller.ctl(&["store"]).unwrap_err();
    bound_files(running.child.id(), "unlimited");
    controller.ctl(&["store"]).unwrap();
    running.child.kill().unwrap();
    drop(running);
    let mut running = controller.start();
    controller.wait("a pose by reflectors behind another kill", |status| is_localised(status) && status["starts"] == 3);
    assert!(is_set("0.006"));

    vehicle.drives.store(true, Ordering::Relaxed);
    controller.wait("the vehicle drives", |status| status["is_standing"] == false);
    is_gone.store(true, Ordering::Relaxed);
    controller.wait("the loss of the laser", |status| status["laser"] != "sound" && status["is_localised"] == false);
    std::thread::sleep(laser_gone());
    is_gone.store(false, Ordering::Relaxed);
    controller.wait("a pose by reflectors behind the loss of the laser", is_localised);
    running.child.kill().unwrap();
    drop(running);
    let running = controller.start();
    controller.wait("a pose by reflectors behind a kill on the way", |status| {
        is_localised(status) && status["starts"] == 4 && status["is_standing"] == false
    });
    assert!(running.terminate().0);

    // Of each run there is a log, the last two under their names; each is told again to the last bit.
    for log in [own.to_owned(), format!("{own}.old")] {
        let replayed = agv(&["replay", &log, "--json", "--quiet"]);
        let told: Value = serde_json::from_slice(&replayed.stdout).unwrap();
        for kind in ["outputs", "published"] {
            assert!(told[kind]["compared"].as_u64().unwrap() > 50, "{log}: {}", told[kind]);
            assert!(told[kind]["first_difference"].is_null(), "{log}: {}", told[kind]);
        }
    }
}
