//! The controller on Linux in a time that is told: the poses of the emulated board to the last bit, what is kept of a drive replayed to the
//! last bit, and a day without growth.
#![cfg(target_os = "linux")]

use std::alloc::System;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::AtomicU64;
use std::sync::{Mutex, PoisonError};

use agv_controller::{EncoderNodes, LaserOrder};
use agv_core::measurement::Time;
use agv_core::state::Mode;
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::provision::flash_image;
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::Comparison;
use agv_host_sim::run::{FLASH, Stepped, run_stepped};
use agv_host_sim::serve::nav350::{Connection, Drive, Sensor, SensorClockOptions};
use agv_host_sim::simulate::scenario::{PathKind, PathOptions, PoseOptions, Scenario};
use agv_host_sim::simulate::{simulate, standard};
use agv_host_sim::{log, replay};
use agv_settings::Settings;
use agv_tests::{covered, emulator, image, logs, short_ring};
use agv_wire::can::frame::{Frame, Id};
use agv_wire::nav350::SensorFrame;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

/// What everything is asked, us.
const STEP: u64 = 1_000;
/// How long the vehicle stands before it drives, s: it finds itself meanwhile.
const STANDS: f64 = 8.0;

/// What a controller hears, as the image `play` reads it, and what it has sent.
#[derive(Default)]
struct Tape {
    heard: Vec<u8>,
    sent: Vec<u8>,
}

impl Tape {
    fn hear(&mut self, kind: u8, now: Time, bytes: &[u8]) {
        self.heard.push(kind);
        self.heard.extend(now.micros().to_le_bytes());
        self.heard.extend(u16::try_from(bytes.len()).unwrap().to_le_bytes());
        self.heard.extend(bytes);
    }

    fn hear_frame(&mut self, now: Time, frame: &Frame) {
        let bytes = [&id(frame).to_le_bytes(), frame.data()].concat();
        self.hear(1, now, &bytes);
    }

    fn send(&mut self, now: Time, frame: &Frame) {
        self.sent.extend(now.micros().to_le_bytes());
        self.sent.extend(id(frame).to_le_bytes());
        self.sent.extend(frame.padded());
    }
}

fn id(frame: &Frame) -> u32 {
    assert!(!frame.is_remote());
    let Id::Standard(id) = frame.id() else { panic!("{frame:?}") };
    id.as_raw().into()
}

/// Encoders and laser of a drive, and what is on its way between them and a controller.
struct Sensors {
    motion: EmulatedMotion,
    sensor: Sensor,
    connection: Option<Connection>,
    frames: Vec<Frame>,
    telegrams: Vec<Vec<u8>>,
}

impl Sensors {
    fn new(recording: &Recording) -> Self {
        let nodes = EncoderNodes::of(&Settings::of(recording.parameters));
        let drive = Drive::new(recording, SensorFrame::default()).unwrap();
        let clock = SensorClockOptions { start: 1_000_000, ..SensorClockOptions::default() };
        Self {
            motion: EmulatedMotion::new(recording, &nodes).unwrap().standing(),
            sensor: Sensor::new(drive, clock, None, true),
            connection: None,
            frames: Vec::new(),
            telegrams: Vec::new(),
        }
    }

    fn begin(&mut self, now: Time) {
        self.motion.begin(now);
        self.sensor.begin(now.seconds());
    }

    /// One step of all. `hear` is told what the controller hears, kind by kind, and what it sends.
    fn step(&mut self, controller: &mut Stepped, now: Time, tape: &mut Option<Tape>) {
        controller.set_time(now);
        let mut orders: Vec<LaserOrder<Vec<u8>>> = Vec::new();
        let telegrams = std::mem::take(&mut self.telegrams);
        for bytes in telegrams.iter().map(Vec::as_slice).chain([&[][..]]) {
            if let Some(tape) = tape {
                tape.hear(3, now, bytes);
            }
            controller.step_laser(bytes, |order| orders.push(order.map(<[u8]>::to_vec)));
        }
        for order in orders {
            match order {
                LaserOrder::Connect => {
                    self.connection = Some(Connection::default());
                    controller.connect_laser();
                    if let Some(tape) = tape {
                        tape.hear(2, now, &[]);
                    }
                }
                LaserOrder::Disconnect => self.connection = None,
                LaserOrder::Send(bytes) => {
                    let Some(connection) = &mut self.connection else { continue };
                    self.telegrams.push(connection.receive(&mut self.sensor, &bytes, now.seconds()));
                }
            }
        }
        if let Some(connection) = &mut self.connection {
            self.telegrams.extend(connection.poll(&self.sensor, now.seconds()));
        }
        let frames = std::mem::take(&mut self.frames);
        for heard in frames.iter().map(Some).chain([None]) {
            if let Some(tape) = tape {
                match heard {
                    Some(frame) => tape.hear_frame(now, frame),
                    None => tape.hear(0, now, &[]),
                }
            }
            controller.step_bus(heard, |frame| {
                if let Some(tape) = tape {
                    tape.send(now, frame);
                }
                self.frames.extend(self.motion.handle(frame));
            });
        }
        self.frames.extend(self.motion.poll(now));
    }
}

fn store(recording: &Recording) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let settings = Settings::of(recording.parameters);
    std::fs::write(folder.path().join(FLASH), flash_image(&settings, &recording.landmarks, None).unwrap()).unwrap();
    folder
}

fn hall() -> Scenario {
    toml::from_str(standard::HALL).unwrap()
}

#[test]
fn the_emulated_board_says_the_same_on_the_bus_to_the_last_bit() {
    // The board is switched on at the first time of the tape.
    static HAND: AtomicU64 = AtomicU64::new(STEP);
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let test = "the_emulated_board_says_the_same_on_the_bus_to_the_last_bit";
    let Some(image) = image(test, "an500", "play").filter(|_| emulator(test)) else { return };
    let recording = simulate(&hall()).unwrap().recording;
    let store = store(&recording);
    let folder = tempfile::tempdir().unwrap();
    let (tape, parameters, landmarks) = run_stepped(store.path(), &HAND, None, &|_| (), |controller| {
        let (mut sensors, mut tape) = (Sensors::new(&recording), Some(Tape::default()));
        for step in 1..=40_000 {
            let now = Time::from_micros(step * STEP);
            if now == Time::from_seconds(STANDS) {
                sensors.begin(now);
            }
            sensors.step(controller, now, &mut tape);
        }
        // It has found itself and drives.
        let pose = controller.pose().unwrap();
        assert_eq!((pose.mode, controller.left_out()), (Mode::Reflectors, [0; 3]));
        assert!(controller.poses().0 >= 3_900, "{:?}", controller.poses());
        assert_eq!(*controller.settings, Settings::of(controller.settings.parameters));
        (tape.unwrap(), controller.settings.parameters, controller.landmarks.to_vec())
    })
    .unwrap();
    let header = Recording { parameters, landmarks, events: Vec::new(), ..recording };
    log::write(&folder.path().join("drive.agvlog"), &header).unwrap();
    std::fs::write(folder.path().join("tape.bin"), &tape.heard).unwrap();
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(&image)
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    let sent = std::fs::read(folder.path().join("sent.bin")).unwrap();
    let (by_linux, by_board) = (tape.sent.chunks(20), sent.chunks(20));
    assert!(by_linux.len() > 15_000, "{} frames", by_linux.len());
    let difference = by_linux.clone().zip(by_board.clone()).enumerate().find(|(_, (linux, board))| linux != board);
    assert_eq!(difference, None, "the first frame that differs, of {}", by_linux.len());
    assert_eq!(by_linux.len(), by_board.len());
}

/// Where the reflectors are covered, s of the drive.
const COVERED: f64 = 8.0;

/// What was kept, and whether it begins in the middle of the drive.
fn assert_replayed(path: &Path) -> (Comparison, bool) {
    let contents = log::read_contents(path, |_| ()).unwrap();
    assert_eq!(contents.damages, [], "{}", path.display());
    let again = replay::replay_in(&contents.recording, None, |_| ()).unwrap();
    let outputs = replay::compare(&contents.outputs, &again);
    let published = replay::compare_published(&contents.recording, &contents.publishing, &again);
    assert!(outputs.is_equal() && published.is_equal(), "{}: {outputs:?} {published:?}", path.display());
    // A log that is cut may end between an event and its answer.
    let events = contents.recording.events.len();
    assert!((events - 1..=events).contains(&outputs.compared), "{outputs:?} of {events} events");
    (outputs, contents.recording.state.is_some())
}

#[test]
fn an_incident_is_a_log_that_replays_to_the_same_bits() {
    static HAND: AtomicU64 = AtomicU64::new(STEP);
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut scenario = hall();
    scenario.laser.scans = false;
    let recording = covered(simulate(&scenario).unwrap().recording, COVERED);
    let (store, folder) = (store(&recording), tempfile::tempdir().unwrap());
    let options = short_ring(folder.path().join("recording"));
    run_stepped(store.path(), &HAND, Some(&options), &|text| println!("{text}"), |controller| {
        let mut sensors = Sensors::new(&recording);
        for step in 1..=30_000 {
            let now = Time::from_micros(step * STEP);
            if now == Time::from_seconds(STANDS) {
                sensors.begin(now);
            }
            sensors.step(controller, now, &mut None);
        }
        assert_eq!(controller.left_out(), [0; 3]);
    })
    .unwrap();
    let incidents = logs(&options.incidents());
    assert_eq!(incidents.len(), 1, "{incidents:?}");
    assert!(incidents[0].to_string_lossy().ends_with("-alarm.agvlog"), "{incidents:?}");
    let (compared, goes_on) = assert_replayed(&incidents[0]);
    // At least two seconds before it and one behind it, of encoders at 100 Hz; and no more than the part before.
    assert!(goes_on && (300..500).contains(&compared.compared), "{compared:?}");
    let ring = logs(&options.folder.join("ring"));
    assert!((5..=6).contains(&ring.len()), "{ring:?}");
    assert!(ring.iter().all(|path| assert_replayed(path).1));
}

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// One test at a time: memory is counted of all.
static ALONE: Mutex<()> = Mutex::new(());

/// Descriptors that are open, and memory that is held, kB.
fn occupied() -> (usize, usize) {
    let held = COUNTED.stats();
    let bytes = held.bytes_allocated - held.bytes_deallocated;
    (std::fs::read_dir("/proc/self/fd").unwrap().count(), bytes / 1024)
}

const HOUR: f64 = 3600.0;
/// Time between two looks, us.
const PART: u64 = 600_000_000;
/// The shortest lap, s.
const LAP: f64 = 70.0;

/// An hour; a day with `AGV_LONG`.
#[test]
fn a_day_takes_neither_memory_nor_descriptors() {
    static HAND: AtomicU64 = AtomicU64::new(0);
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let hours = if std::env::var_os("AGV_LONG").is_some() { 24 } else { 1 };
    let mut scenario = hall();
    let lap = scenario.build_path();
    let laps = (HOUR / LAP).ceil() as usize;
    let start = PoseOptions { x: lap.start.x, y: lap.start.y, heading_deg: lap.start.theta.to_degrees() };
    let legs = lap.legs.iter().cycle().take(lap.legs.len() * laps).cloned().collect();
    scenario.path = PathOptions { kind: PathKind::Legs, start, legs };
    scenario.laser.scans = false;
    // The same hour again and again: the vehicle is where it began, as it stands at the end of a lap.
    let recording = simulate(&scenario).unwrap().recording;
    let store = store(&recording);
    let grown = run_stepped(store.path(), &HAND, None, &|_| (), |controller| {
        let mut occupied_after = Vec::new();
        let (mut now, mut lost) = (0, 0);
        for hour in 0..hours {
            let mut sensors = Sensors::new(&recording);
            let begin = now + (STANDS * 1e6) as u64;
            let end = now + (HOUR * 1e6) as u64;
            while now < end {
                now += STEP;
                let time = Time::from_micros(now);
                if now == begin {
                    sensors.begin(time);
                }
                sensors.step(controller, time, &mut None);
                let is_settled = now > begin + 10_000_000;
                lost += u64::from(is_settled && controller.pose().is_some_and(|pose| !pose.mode.is_localised()));
                if now % PART == 0 {
                    occupied_after.push(occupied());
                }
            }
            println!("hour {}: {:?}, {lost} ms not localised", hour + 1, occupied());
        }
        assert_eq!(controller.left_out(), [0; 3]);
        let (poses, figures, missed) = controller.poses();
        assert!(poses >= 359_000 * hours && missed == 0, "{poses} poses, {missed} missed, {figures:?}");
        // Not a hundredth of the time: where a drive begins again, the encoders do.
        assert!(lost * 100 < hours * 3_600_000, "{lost} ms");
        occupied_after
    })
    .unwrap();
    let (first, last) = (grown.first().unwrap(), grown.last().unwrap());
    assert_eq!(grown.len() as u64, 6 * hours);
    assert_eq!(first.0, last.0, "descriptors: {grown:?}");
    assert!(last.1 as f64 <= 1.01 * first.1 as f64, "kB: {grown:?}");
}
