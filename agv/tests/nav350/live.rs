//! The emulated sensor and the recording of it, over a real network of one machine.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::capture;

use agv_controller::EncoderNodes;
use agv_core::localizer::Localizer;
use agv_core::record::{Item, RawSource, Record};
use agv_host_sim::import::raw::{self, Bus, EventMaker};
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::Link;
use agv_host_sim::live::{self, Limits, Recorder, Summary};
use agv_host_sim::log::{self, Reader, Writer};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::serve::nav350::{Drive, Nav350, Options, Turn};
use agv_host_sim::simulate::block_storage::{BlockStorage, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{Scenario, WorldOptions};
use agv_host_sim::simulate::simulate;
use agv_wire::can::canopen::NodeId;
use agv_wire::cola::{Deframed, Deframer, Dialect};
use agv_wire::nav350::{Answer, Configuration, MethodResult, NavigationData, SensorFrame};

const fn node(number: u8) -> NodeId {
    match NodeId::new(number) {
        Some(node) => node,
        None => panic!(),
    }
}

const NODES: EncoderNodes = EncoderNodes::new([node(1), node(2), node(3), node(4)], node(16));

/// Two seconds of the fast clock.
const STALL: Duration = Duration::from_millis(250);

/// How much faster than real time the tests go.
const SPEED: f64 = 8.0;

fn recording() -> Recording {
    let world = BlockStorage { reflectors: ReflectorPlacement::Aisle, ..BlockStorage::default() };
    let mut scenario = Scenario { world: WorldOptions::BlockStorage(world), ..Scenario::default() };
    scenario.laser.intensities = true;
    simulate(&scenario).unwrap().recording
}

fn listener() -> (TcpListener, SocketAddr) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    (listener, address)
}

/// Ends threads even if a test panics, so that it fails instead of hanging.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

fn record(address: SocketAddr, recording: &Recording, seconds: f64, first: Dialect, path: &Path) -> Summary {
    let parameters = &recording.parameters;
    let recorder = Recorder::new(Writer::begin(path, parameters, &recording.landmarks).unwrap());
    let clock = Clock::new(SPEED);
    let configuration = Configuration {
        first_dialect: first,
        // The machine may be busy, and time is fast.
        answer_timeout: 4.0,
        mode_timeout: 60.0,
        ..Configuration::default()
    };
    let mut link = Link::new(&address.to_string(), configuration, clock);
    let is_stopped = AtomicBool::new(false);
    let until = clock.now().offset(seconds);
    let summary = live::record_nav350(&mut link, &Limits::until(until), usize::MAX, &is_stopped, &recorder).unwrap();
    recorder.finish().unwrap();
    summary
}

/// The turn that a recorded scan is of: ranges are those of the sensor, to the bit.
fn turn<'a>(turns: &'a [Turn], ranges: &[f32]) -> Option<(usize, &'a Turn)> {
    turns.iter().enumerate().find(|(_, turn)| {
        turn.ranges.len() == ranges.len()
            && turn.ranges.iter().zip(ranges).all(|(millimetres, range)| *millimetres as f32 * 1e-3 == *range)
    })
}

/// Every recorded event is one that was served. Returns the numbers of the turns, and how many reflectors they have.
pub fn check_events(turns: &[Turn], recorded: &[RecordedEvent]) -> (Vec<usize>, usize) {
    let mut numbers = Vec::new();
    let mut reflector_count = 0;
    for pair in recorded.chunks(2) {
        let [RecordedEvent::Reflectors(reflectors), RecordedEvent::Scan(scan)] = pair else {
            panic!("reflectors and scan come together")
        };
        let reflectors = &reflectors.observations;
        let (number, turn) = turn(turns, &scan.ranges).expect("the scan was served");
        numbers.push(number);
        assert_eq!(scan.intensities, turn.remission);
        assert!((scan.first_bearing + std::f64::consts::PI).abs() < 1e-9);
        assert!((scan.bearing_step * 1440.0 - std::f64::consts::TAU).abs() < 1e-9);
        assert!((scan.beam_interval * 1440.0 - 0.125).abs() < 1e-9);
        assert_eq!(reflectors.len(), turn.reflectors.len());
        reflector_count += reflectors.len();
        for (found, served) in reflectors.iter().zip(&turn.reflectors) {
            // Coordinates are whole millimetres, times whole milliseconds.
            let range = f64::from(served.range);
            assert!((f64::from(found.range) - range).abs() < 0.8e-3);
            let error = agv_core::geometry::difference(found.bearing.into(), served.bearing.into());
            assert!(error.abs() * range < 0.8e-3, "{error}");
            let since_start = found.time.since(scan.start) - served.time.since(turn.start);
            assert!(since_start.abs() < 2.1e-3, "{since_start}");
        }
    }
    (numbers, reflector_count)
}

#[test]
fn what_is_recorded_is_what_was_served() {
    let recording = recording();
    for dialect in [Dialect::Ascii, Dialect::Binary] {
        let drive = Drive::new(&recording, SensorFrame::default()).unwrap();
        let turns = drive.turns().to_vec();
        // The clock wraps during the drive.
        let options =
            Options { speed: SPEED, clock_start: u32::MAX - 8000, dialect: Some(dialect), ..Options::default() };
        let sensor = Nav350::new(drive, options);
        let (listener, address) = listener();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("live.agvlog");
        let is_stopped = AtomicBool::new(false);
        let summary = std::thread::scope(|scope| {
            let _stop = StopOnDrop(&is_stopped);
            scope.spawn(|| sensor.serve(&listener, &is_stopped).unwrap());
            record(address, &recording, 16.0, dialect, &path)
        });
        let (again, damages) = log::read(&path).unwrap();
        assert!(damages.is_empty(), "{damages:?}");
        assert_eq!(again.landmarks, recording.landmarks);
        let (numbers, reflector_count) = check_events(&turns, &again.events);
        assert_eq!(numbers.len(), summary.scans);
        // The drive begins among reflectors.
        assert!(reflector_count > 20, "{reflector_count}");
        assert!(numbers.len() > 10, "{summary:?}");
        assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]), "{numbers:?}");
        check_raw(&path, summary.scans);
        // The raw bytes mean the same again, and so does a network capture of them.
        let (from_raw, _) = raw::read_drive(&path, &NODES).unwrap();
        assert!(from_raw == again, "{} {}", from_raw.events.len(), again.events.len());
        let packets = folder.path().join("live.pcap");
        capture::write(&packets, &raw::read(&path).unwrap());
        let captured = agv_host_sim::import::capture::read(&packets, &agv_host_sim::import::capture::PORTS).unwrap();
        let mut maker = EventMaker::new(&NODES, &recording.parameters, Bus::Overheard);
        let events: Vec<_> = captured.raw.iter().flat_map(|one| maker.events(one)).collect();
        assert!(events == again.events, "{} {}", events.len(), again.events.len());
        localises(&recording, &again, &numbers, &turns);
    }
}

/// The raw bytes hold the same answers as the events.
fn check_raw(path: &Path, scans: usize) {
    let mut reader = Reader::open(path).unwrap();
    let mut deframer = Box::new(Deframer::<65_536>::new());
    let (mut data, mut sent) = (0, 0);
    while let Some(item) = reader.next().unwrap() {
        let Item::Record { record: Record::Raw(raw), .. } = item else { continue };
        if raw.source == RawSource::ToNav350 {
            sent += 1;
            continue;
        }
        assert_eq!(deframer.extend(raw.bytes), raw.bytes.len());
        while let Some(found) = deframer.next() {
            let Deframed::Telegram { dialect, payload, .. } = found else { panic!("{found:?}") };
            let answer = Answer::decode(dialect, payload).unwrap();
            data += usize::from(matches!(answer, Answer::Result(MethodResult::Data(NavigationData { .. }))));
        }
    }
    // The last answer may have come too late to be taken.
    assert!(data == scans || data == scans + 1, "{data} {scans}");
    assert!(sent > scans);
}

/// The recorded turns, at the times of the drive, localise as the simulated ones do.
pub fn localises(simulated: &Recording, recorded: &Recording, numbers: &[usize], turns: &[Turn]) {
    let run = |recording: &Recording, is_live: bool| {
        let mut localizer: Box<Localizer> = Box::new(Localizer::new(recording.parameters));
        localizer.add_landmarks(&recording.landmarks).unwrap();
        let mut poses = Vec::new();
        for event in &simulated.events {
            match event {
                RecordedEvent::Reflectors(seen) => {
                    let Some(first) = seen.observations.first() else { continue };
                    let number = turns.partition_point(|turn| turn.start <= first.time) - 1;
                    let Some(place) = numbers.iter().position(|known| *known == number) else { continue };
                    if is_live {
                        let RecordedEvent::Reflectors(found) = &recorded.events[2 * place] else { panic!() };
                        let RecordedEvent::Scan(scan) = &recorded.events[2 * place + 1] else { panic!() };
                        let mut shifted = found.clone();
                        for observation in &mut shifted.observations {
                            let since = observation.time.since(scan.start);
                            observation.time = turns[number].start.offset(since);
                        }
                        localizer.handle(&RecordedEvent::Reflectors(shifted).view());
                    } else {
                        localizer.handle(&event.view());
                    }
                }
                RecordedEvent::Scan(_) => {}
                other => poses.push(localizer.handle(&other.view()).pose.pose),
            }
        }
        poses
    };
    let (direct, live) = (run(simulated, false), run(simulated, true));
    assert_eq!(direct.len(), live.len());
    for (direct, live) in direct.iter().zip(&live) {
        assert!((direct.position() - live.position()).norm() < 5e-3, "{direct:?} {live:?}");
    }
}

/// What the line does to the n-th connection.
#[derive(Clone, Copy, Debug)]
enum Harm {
    /// Cuts it after so many bytes from the sensor.
    Cut(usize),
    /// Puts bytes that belong to no telegram before each piece from the sensor.
    Rubbish,
    /// Swallows everything from the sensor.
    Silence,
    /// Holds everything back for 2 s once, by the clock of the sensor; cuts it later.
    Stall,
}

/// Writes to a socket that does not wait.
fn write(socket: &mut TcpStream, mut rest: &[u8], is_stopped: &AtomicBool) {
    while !rest.is_empty() && !is_stopped.load(Ordering::Relaxed) {
        match socket.write(rest) {
            Ok(count) => rest = &rest[count..],
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => std::thread::yield_now(),
            Err(_) => break,
        }
    }
}

/// Passes bytes between host and sensor, and does harm.
fn harm(listener: &TcpListener, sensor: SocketAddr, harms: &[Harm], count: &AtomicUsize, is_stopped: &AtomicBool) {
    listener.set_nonblocking(true).unwrap();
    while !is_stopped.load(Ordering::Relaxed) {
        let Ok((mut host, _)) = listener.accept() else {
            std::thread::yield_now();
            continue;
        };
        let harm = harms[count.fetch_add(1, Ordering::Relaxed).min(harms.len() - 1)];
        host.set_nonblocking(true).unwrap();
        let mut sensor = TcpStream::connect(sensor).unwrap();
        sensor.set_nonblocking(true).unwrap();
        let mut passed = 0;
        let mut late: VecDeque<Vec<u8>> = VecDeque::new();
        let mut stalled_until: Option<Instant> = None;
        let mut buffer = [0; 4096];
        while !is_stopped.load(Ordering::Relaxed) {
            match host.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => sensor.write_all(&buffer[..count]).unwrap_or_default(),
                Err(_) => std::thread::yield_now(),
            }
            match sensor.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => {
                    passed += count;
                    let is_cut = match harm {
                        Harm::Cut(limit) => passed > limit,
                        Harm::Stall => passed > 100_000,
                        Harm::Rubbish | Harm::Silence => false,
                    };
                    if is_cut {
                        break;
                    }
                    let is_whole = buffer.first() == Some(&2);
                    let bytes = match harm {
                        Harm::Silence => &[],
                        Harm::Stall if passed > 20_000 => {
                            stalled_until.get_or_insert_with(|| Instant::now() + STALL);
                            late.push_back(buffer[..count].to_vec());
                            &[]
                        }
                        Harm::Rubbish if is_whole && passed < 60_000 => {
                            &[&b"rubbish\0"[..], &buffer[..count]].concat()[..]
                        }
                        _ => &buffer[..count],
                    };
                    write(&mut host, bytes, is_stopped);
                }
                Err(_) => std::thread::yield_now(),
            }
            if stalled_until.is_some_and(|until| Instant::now() >= until) {
                for bytes in late.drain(..) {
                    write(&mut host, &bytes, is_stopped);
                }
            }
        }
    }
}

#[test]
fn a_bad_line_is_survived_and_told() {
    let recording = recording();
    let drive = Drive::new(&recording, SensorFrame::default()).unwrap();
    let turns = drive.turns().to_vec();
    let sensor = Nav350::new(drive, Options { speed: SPEED, ..Options::default() });
    let (listener, address) = listener();
    let (line, line_address) = self::listener();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.agvlog");
    let (is_stopped, connections) = (AtomicBool::new(false), AtomicUsize::new(0));
    let harms = [Harm::Cut(30), Harm::Cut(40_000), Harm::Silence, Harm::Stall, Harm::Rubbish];
    let summary = std::thread::scope(|scope| {
        let _stop = StopOnDrop(&is_stopped);
        scope.spawn(|| sensor.serve(&listener, &is_stopped).unwrap());
        scope.spawn(|| harm(&line, address, &harms, &connections, &is_stopped));
        record(line_address, &recording, 60.0, Dialect::Binary, &path)
    });
    assert!(connections.load(Ordering::Relaxed) >= harms.len());
    assert!(summary.lost >= 4, "{summary:?}");
    let (again, damages) = log::read(&path).unwrap();
    assert!(damages.is_empty());
    assert!(raw::read_drive(&path, &NODES).unwrap().0 == again);
    // The drive may be over before the line is good; what comes then is its last turn.
    let (numbers, _) = check_events(&turns, &again.events);
    assert!(numbers.len() > 10);
    let notes = notes(&path);
    for expected in [
        "nav350: lost: the connection was closed",
        "nav350: lost: no answer while identifying",
        "nav350: 8 bytes belong to no telegram",
        "nav350: running",
    ] {
        assert!(notes.iter().any(|note| note.contains(expected)), "{expected}: {notes:#?}");
    }
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
