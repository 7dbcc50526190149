//! What is recorded from a bus, and what its raw frames mean again.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::localizer::Event;
use agv_core::measurement::{EncoderFault, EncoderFaults};
use agv_core::odometry::{Tricycle, Vehicle};
use agv_core::record::{Item, Record};
use agv_host_sim::bus::{Bus, BusError, InProcessBus, InProcessNode};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::export;
use agv_host_sim::import::{can_log, raw};
use agv_host_sim::link::clock::Clock;
use agv_host_sim::live::{self, CanSummary, Limits, Recorder};
use agv_host_sim::log::{self, Reader, Writer};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::encoder::Reporting;
use agv_wire::can::frame::AnyFrame;

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

fn nodes(is_synchronous: bool) -> EncoderNodes {
    let reporting = if is_synchronous { Reporting::Synchronous } else { Reporting::Timer { period: 10 } };
    EncoderNodes { reporting, ..EncoderNodes::new([1, 2, 3, 4].map(node), node(16)) }
}

fn recording() -> Recording {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/block_storage_p4.toml");
    let mut scenario = Scenario::read(&file).unwrap();
    scenario.laser.scans = false;
    let mut recording = simulate(&scenario).unwrap().recording;
    // Nobody has measured how hard these vehicles brake, and a busy machine delays frames.
    recording.parameters.limits.fastest = 50.0;
    recording
}

/// Plays the drive on a bus until `is_silent`, then goes on without a word.
fn serve(
    mut bus: InProcessNode,
    mut motion: EmulatedMotion,
    clock: Clock,
    is_silent: &AtomicBool,
    is_over: &AtomicBool,
) {
    while !is_over.load(Ordering::Relaxed) {
        let frame = bus.receive(Instant::now() + Duration::from_millis(1)).unwrap();
        if is_silent.load(Ordering::Relaxed) {
            continue;
        }
        let answers = frame.as_ref().and_then(AnyFrame::classic).map(|frame| motion.handle(frame)).unwrap_or_default();
        for frame in answers.into_iter().chain(motion.poll(clock.now())) {
            bus.send(&frame.into()).unwrap();
        }
    }
}

/// A bus that ends after so many frames.
struct Unplugged {
    bus: InProcessNode,
    rest: usize,
}

impl Bus for Unplugged {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        self.bus.send(frame)
    }

    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        let frame = self.bus.receive(deadline)?;
        if frame.is_some() {
            self.rest = self.rest.checked_sub(1).ok_or(BusError::Closed { name: "test".to_owned() })?;
        }
        Ok(frame)
    }
}

/// Records a drive of which the encoders fall silent after half of the time.
fn record(path: &Path, recording: &Recording, is_synchronous: bool, frames_a_bus: usize, seconds: f64) -> CanSummary {
    let clock = Clock::new(1.0);
    let wire = InProcessBus::new();
    let motion = EmulatedMotion::new(recording, &nodes(is_synchronous)).unwrap();
    let recorder = Recorder::new(Writer::begin(path, &recording.parameters, &recording.landmarks).unwrap());
    let (is_silent, is_over, never) = (AtomicBool::new(false), AtomicBool::new(false), AtomicBool::new(false));
    let devices = wire.join();
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| serve(devices, motion, clock, &is_silent, &is_over));
        let record = |until: f64| {
            let open = || -> Result<Box<dyn Bus>, BusError> {
                Ok(Box::new(Unplugged { bus: wire.join(), rest: frames_a_bus }))
            };
            let until = clock.now().offset(until);
            let parameters = &recording.parameters;
            live::record_can(open, &nodes(is_synchronous), parameters, clock, &Limits::until(until), &never, &recorder)
                .unwrap()
        };
        let timer = scope.spawn(|| {
            let end = Instant::now() + Duration::from_secs_f64(0.5 * seconds);
            while Instant::now() < end {
                std::thread::yield_now();
                std::thread::park_timeout(Duration::from_millis(5));
            }
            is_silent.store(true, Ordering::Relaxed);
        });
        let summary = record(seconds);
        timer.join().unwrap();
        is_over.store(true, Ordering::Relaxed);
        summary
    });
    recorder.finish().unwrap();
    summary
}

fn notes(path: &Path) -> Vec<String> {
    let mut reader = Reader::open(path).unwrap();
    let mut notes = Vec::new();
    while let Some(item) = reader.next().unwrap() {
        if let Item::Record { record: Record::Note(note), .. } = item {
            notes.push(note.to_owned());
        }
    }
    notes
}

#[test]
fn raw_frames_give_the_recorded_events_again() {
    let recording = recording();
    let Vehicle::Tricycle(Tricycle { drive_range, .. }) = recording.parameters.vehicle else { panic!() };
    let served: Vec<(u32, u32)> = recording
        .events
        .iter()
        .filter_map(|event| match event.view() {
            Event::Encoders(sample) => Some((sample.drive, sample.steering)),
            _ => None,
        })
        .collect();
    for is_synchronous in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("can.agvlog");
        let summary = record(&path, &recording, is_synchronous, usize::MAX, 3.0);
        assert!(summary.samples > 50, "{summary:?}");
        let (recorded, damages) = log::read(&path).unwrap();
        assert!(damages.is_empty());
        // Counters are those of the drive, and never run backwards in it.
        for event in &recorded.events {
            if let RecordedEvent::Encoders(sample) = event {
                assert!(sample.drive < drive_range.values() as u32);
                assert!(served.iter().any(|known| known.0 == sample.drive), "{sample:?}");
            }
        }
        let mut faults = recorded.events.iter().filter_map(|event| match event {
            RecordedEvent::EncoderFaults(faults) => Some(*faults),
            _ => None,
        });
        let last: EncoderFaults = faults.next_back().unwrap();
        assert_eq!((last.drive, last.steering), (Some(EncoderFault::Missing), Some(EncoderFault::Missing)));
        assert!(notes(&path).iter().any(|note| note.contains("drive missing, steering missing")));
        let (again, _) = raw::read_drive(&path, &nodes(is_synchronous)).unwrap();
        assert_eq!(again.events.len(), recorded.events.len());
        assert!(again == recorded, "the raw frames mean something else");
    }
}

#[test]
fn a_bus_that_is_unplugged_is_opened_again() {
    let recording = recording();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("can.agvlog");
    let summary = record(&path, &recording, false, 60, 3.5);
    assert!(summary.lost >= 1, "{summary:?}");
    let notes = notes(&path);
    assert!(notes.iter().any(|note| note.starts_with("can: lost: test: the other end has closed")), "{notes:#?}");
    assert!(notes.iter().any(|note| note == "can: opened again"), "{notes:#?}");
    let (recorded, _) = log::read(&path).unwrap();
    assert!(raw::read_drive(&path, &nodes(false)).unwrap().0 == recorded);
}

#[test]
fn what_candump_wrote_is_exported_as_it_was() {
    let lines = [
        "(1436509053.249713) can0 044#2A366C2B",
        "(1436509053.849713) can0 1F334455#R4",
        "(1436509053.940200) can0 182#09000000",
        "(1436509053.950000) can0 181#E8030000",
        "(1436509053.950200) can0 182#0A000000",
        "(1436509054.049713) can0 123##1112233",
    ];
    let folder = tempfile::tempdir().unwrap();
    let (input, log) = (folder.path().join("in.log"), folder.path().join("drive.agvlog"));
    std::fs::write(&input, lines.join("\n") + "\n").unwrap();
    let frames: Vec<_> = can_log::read(&input).unwrap().frames;
    let bytes: Vec<_> = frames.iter().map(|seen| raw::RawBytes::of_can(seen.time.unwrap(), &seen.frame)).collect();
    let mut drive = recording();
    drive.events.clear();
    raw::write(&log, &mut drive, &bytes, &nodes(false)).unwrap();
    let samples = drive.events.iter().filter(|event| matches!(event, RecordedEvent::Encoders(_))).count();
    assert_eq!(samples, 1, "{:?}", drive.events);
    let mut exported = Vec::new();
    assert_eq!(export::candump::write(&log, "can0", &mut exported).unwrap(), lines.len());
    assert_eq!(String::from_utf8(exported).unwrap().lines().collect::<Vec<_>>(), lines);
}
