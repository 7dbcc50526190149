//! The controller on Linux with a CAN interface of a kernel: it knows where it is, and again after the interface was down and the
//! clock was set by an hour. The kernel is user-mode-linux, whose clock and interfaces may be moved.
#![cfg(target_os = "linux")]

use std::net::{Ipv4Addr, TcpListener};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::state::Mode;
use agv_host_sim::bus::{self, Bus, SocketCanBus};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::provision::flash_image;
use agv_host_sim::recording::Recording;
use agv_host_sim::run::{BusState, FLASH, Logs, Options, Ports, RealTime, Running, run};
use agv_host_sim::serve::nav350::{Drive, Nav350, Options as SensorOptions};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{simulate, standard};
use agv_host_sim::{log, replay};
use agv_settings::Settings;
use agv_tests::user_mode_linux::{self, Kernel, PACKAGES};
use agv_tests::{is_on_path, skip, too_busy};
use agv_wire::nav350::SensorFrame;

/// Names the interface to the program inside.
const INTERFACE: &str = "AGV_RUN_INTERFACE";
const NAME: &str = "the_controller_comes_back_on_a_real_bus";
/// Longer than anything here takes in that kernel.
const PATIENCE: Duration = Duration::from_secs(60);
/// Frames of that kernel come late, so encoders are heard every so many ms.
const ENCODER_PERIOD: u16 = 50;

#[test]
fn the_controller_comes_back_on_a_real_bus() {
    if let Ok(interface) = std::env::var(INTERFACE) {
        return inside(&interface);
    }
    if !user_mode_linux::is_there() || !is_on_path("ip") {
        return skip(NAME, &format!("there is no ip, or the Debian packages {PACKAGES} are not there"));
    }
    let folder = tempfile::tempdir().unwrap();
    let minutes = if std::env::var_os("AGV_LONG").is_some() { LONG_MINUTES } else { 0 };
    let program = std::env::current_exe().unwrap();
    let (status, output) = (folder.path().join("status"), folder.path().join("output"));
    let lines = format!(
        "ip link set lo up\n\
         ip link add dev vcan0 mtu 72 type vcan && ip link set vcan0 up\n\
         TMPDIR='{}' {INTERFACE}=vcan0 {MINUTES}={minutes} RUST_MIN_STACK=16777216 '{}' --exact {NAME} --nocapture > '{}' 2>&1\n\
         echo $? > '{}'",
        folder.path().display(),
        program.display(),
        output.display(),
        status.display()
    );
    let modules = &["can", "can-raw", "can-dev", "vcan"];
    let console =
        Kernel { memory: 512, modules, patience: 280 + 90 * minutes, argument: None }.run(folder.path(), &lines);
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let report = format!("{console}\n{}", read(&output));
    assert_eq!(read(&status).trim(), "0", "{report}");
    assert!(read(&output).contains("1 passed"), "{report}");
    println!("{}", read(&output));
}

/// Minutes in which nothing is wrong, before anything is.
const MINUTES: &str = "AGV_RUN_ON_CAN_MINUTES";
const LONG_MINUTES: u32 = 10;

fn hall() -> Recording {
    let mut scenario: Scenario = toml::from_str(standard::HALL).unwrap();
    scenario.laser.scans = false;
    simulate(&scenario).unwrap().recording
}

fn wait(what: &str, mut has_come: impl FnMut() -> bool) {
    let start = Instant::now();
    while !has_come() {
        assert!(start.elapsed() < PATIENCE, "{what} has not come");
        std::thread::sleep(Duration::from_millis(5));
    }
    println!("{what}: after {:.2} s", start.elapsed().as_secs_f64());
}

fn does(program: &str, arguments: &[&str]) {
    let run = Command::new(program).args(arguments).output().unwrap();
    assert!(run.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
}

/// Plays standing encoders on an interface; a bus that is down is tried again.
fn play(interface: &str, recording: &Recording, settings: &Settings, is_over: &AtomicBool) {
    let mut motion = EmulatedMotion::new(recording, &EncoderNodes::of(settings)).unwrap().standing();
    let clock = Clock::new(1.0);
    let mut bus: Option<SocketCanBus> = None;
    while !is_over.load(Ordering::Relaxed) {
        let frames = motion.poll(clock.now());
        let Some(open) = &mut bus else {
            bus = SocketCanBus::open(interface).ok();
            std::thread::sleep(Duration::from_millis(1));
            continue;
        };
        let mut outcome = frames.iter().try_for_each(|frame| open.send(&(*frame).into()));
        match open.receive(Instant::now() + Duration::from_millis(1)) {
            Ok(Some(frame)) => {
                let answers = frame.classic().map(|frame| motion.handle(frame)).unwrap_or_default();
                outcome = outcome.and_then(|()| answers.iter().try_for_each(|frame| open.send(&(*frame).into())));
            }
            Ok(None) => {}
            Err(error) => outcome = Err(error),
        }
        if outcome.is_err() {
            bus = None;
        }
    }
}

/// What runs in user-mode-linux.
fn inside(interface: &str) {
    let recording = hall();
    let drive = Drive::new(&recording, SensorFrame::default()).unwrap();
    let sensor = Nav350::new(drive, SensorOptions { stands: true, ..SensorOptions::default() });
    let laser = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let mut settings = Settings::of(recording.parameters);
    (settings.network.laser, settings.network.laser_port) =
        (Ipv4Addr::LOCALHOST.octets(), laser.local_addr().unwrap().port());
    settings.encoder_period = ENCODER_PERIOD;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(FLASH), flash_image(&settings, &recording.landmarks, None).unwrap()).unwrap();
    let (name, log) = (interface.to_owned(), folder.path().join("drive.agvlog"));
    let minutes: u32 = std::env::var(MINUTES).unwrap().parse().unwrap();
    let options = Options {
        store: folder.path().to_owned(),
        open_bus: Box::new(move || bus::open(&name)),
        lines: None,
        gyro: None,
        ports: Ports::Any,
        real_time: RealTime::default(),
        datagrams: Vec::new(),
        socket: None,
        logs: Logs { whole: Some(log.clone()), ring: None },
    };
    let (is_over, is_stopped) = (AtomicBool::new(false), Arc::new(AtomicBool::new(false)));
    let left_out = Mutex::new([0; 3]);
    let look = |running: &Running| {
        let knows = || running.condition().pose.is_some_and(|pose| pose.mode == Mode::Reflectors);
        let poses = |count: u64| {
            let before = running.poses();
            move || running.poses() > before + count
        };
        wait("a pose by reflectors", knows);
        for part in 0..6 * minutes {
            wait("the poses of ten seconds", poses(1_000));
            println!("{} s: {:?}", 10 * (part + 1), running.condition());
        }
        does("ip", &["link", "set", interface, "down"]);
        wait("the loss of the bus", || running.condition().bus == BusState::Lost);
        does("ip", &["link", "set", interface, "up"]);
        wait("poses behind the loss", poses(50));
        wait("a pose by reflectors behind the loss", knows);
        does("date", &["-s", "+1 hour"]);
        wait("poses behind the hour", poses(100));
        assert!(knows(), "{:?}", running.condition());
        println!("{:?}", running.condition());
        *left_out.lock().unwrap() = running.condition().left_out;
    };
    std::thread::scope(|scope| {
        scope.spawn(|| sensor.serve(&laser, &is_over));
        scope.spawn(|| play(interface, &recording, &settings, &is_over));
        let watch = |running: &Running| {
            // Whatever it finds, everything ends.
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| look(running)));
            is_stopped.store(true, Ordering::Relaxed);
            assert!(outcome.is_ok());
        };
        let summary = run(options, &is_stopped, &|text| println!("{text}"), watch);
        is_over.store(true, Ordering::Relaxed);
        println!("{:?}", summary.unwrap());
    });
    let contents = log::read_contents(&log, |_| ()).unwrap();
    let again = replay::replay_in(&contents.recording, None, |_| ()).unwrap();
    let outputs = replay::compare(&contents.outputs, &again);
    let published = replay::compare_published(&contents.recording, &contents.publishing, &again);
    println!("{outputs:?} {published:?}, {} damages", contents.damages.len());
    assert!(outputs.compared > 0 && published.compared > 0);
    // What was left out is in no log.
    if *left_out.lock().unwrap() != [0; 3] {
        return too_busy(NAME);
    }
    assert!(contents.damages.is_empty() && outputs.is_equal() && published.is_equal());
}
