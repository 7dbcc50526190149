//! Sensors that do not do what they should, and what the commands say of them.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::odometry::Vehicle;
use agv_host_sim::bus::InProcessBus;
use agv_host_sim::layout_file;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::Link;
use agv_host_sim::live::{self, Limits, Recorder};
use agv_host_sim::log::Writer;
use agv_wire::nav350::Configuration;

use super::commands::Server;
use crate::support::{Files, agv, refusal, text};

/// What becomes of bytes on the way from the sensor.
type Twist = fn(Vec<u8>) -> Vec<u8>;

/// A sensor behind a line that twists what it says. The line stays as long as the test program runs.
fn behind(sensor: &Server, twist: Twist) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let sensor = sensor.host.clone();
    std::thread::spawn(move || {
        for mut host in listener.incoming().flatten() {
            let mut line = TcpStream::connect(&sensor).unwrap();
            let (mut from_host, mut to_sensor) = (host.try_clone().unwrap(), line.try_clone().unwrap());
            std::thread::spawn(move || pass(&mut from_host, &mut to_sensor, |bytes| bytes));
            std::thread::spawn(move || pass(&mut line, &mut host, twist));
        }
    });
    address
}

fn pass(from: &mut TcpStream, to: &mut TcpStream, twist: Twist) {
    let mut buffer = vec![0; 1 << 16];
    while let Ok(count) = from.read(&mut buffer)
        && count > 0
        && to.write_all(&twist(buffer[..count].to_vec())).is_ok()
    {}
    let _ = to.shutdown(std::net::Shutdown::Both);
}

fn position(bytes: &[u8], part: &[u8]) -> Option<usize> {
    bytes.windows(part.len()).position(|window| window == part)
}

/// The user level is not granted.
fn deny(mut bytes: Vec<u8>) -> Vec<u8> {
    const GRANTED: &[u8] = b"sAN SetAccessMode 1";
    if let Some(place) = position(&bytes, GRANTED) {
        bytes[place + GRANTED.len() - 1] = b'0';
    }
    bytes
}

/// The question for the user level is refused.
fn refuse(bytes: Vec<u8>) -> Vec<u8> {
    if position(&bytes, b"sAN SetAccessMode").is_some() { b"\x02sFA 3\x03".to_vec() } else { bytes }
}

/// The checksum, which is the last byte of a telegram, is wrong.
fn spoil(mut bytes: Vec<u8>) -> Vec<u8> {
    if let Some(last) = bytes.last_mut() {
        *last ^= 0xFF;
    }
    bytes
}

#[test]
fn a_sensor_that_gives_nothing_is_a_failure_with_its_reason() {
    let [ascii, binary] = ["cola-a", "cola-b"].map(|dialect| Server::start(&["--dialect", dialect]));
    let cases: [(&Server, Twist, &str); 3] = [
        (&ascii, deny, "the user level was not granted"),
        (&ascii, refuse, "refused while logging in"),
        (&binary, spoil, "no answer while identifying"),
    ];
    std::thread::scope(|scope| {
        for (sensor, twist, reason) in cases {
            scope.spawn(move || {
                let host = behind(sensor, twist);
                let files = Files::new();
                let keep = files.write("keep.agvlog", b"a long day's work");
                let complaint = refusal(&["record", "--nav350", &host, "--duration", "3", "-o", &keep]);
                assert!(complaint.contains(&host) && complaint.contains(reason), "{complaint}");
                assert_eq!(std::fs::read(&keep).unwrap(), b"a long day's work");
                assert_eq!(std::fs::read_dir(files.folder()).unwrap().count(), 1);
            });
        }
    });
}

/// A recorder of a vehicle that nobody knows.
fn recorder(path: &Path) -> Recorder {
    Recorder::new(Writer::begin(path, &Parameters::new(Vehicle::Increments, Pose::default()), &[]).unwrap())
}

#[test]
fn scans_and_frames_that_never_come_are_waited_for_only_so_long() {
    let files = Files::new();
    let path = files.path("new.agvlog");
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let is_stopped = AtomicBool::new(false);
    // A minute lasts half a second.
    let clock = Clock::new(120.0);
    let recorder = recorder(Path::new(&path));
    let begin = clock.now();
    let limits = Limits { until: begin.offset(1e6), first: begin.offset(30.0) };
    let mut link = Link::new(&closed, Configuration::default(), clock);
    let summary = live::record_nav350(&mut link, &limits, 5, &is_stopped, &recorder).unwrap();
    assert!(summary.is_empty() && summary.lost > 0, "{summary:?}");
    let ended = clock.now().since(begin);
    assert!(ended >= 30.0, "{ended} s");
    // Who waits, waits to the end.
    let begin = clock.now();
    let summary =
        live::record_nav350(&mut link, &Limits::until(begin.offset(60.0)), 5, &is_stopped, &recorder).unwrap();
    assert!(summary.is_empty() && clock.now().since(begin) >= 60.0);

    let bus = InProcessBus::new();
    let begin = clock.now();
    let limits = Limits { until: begin.offset(1e6), first: begin.offset(30.0) };
    let node = |number| agv_wire::can::canopen::NodeId::new(number).unwrap();
    let nodes = agv_controller::EncoderNodes::new([1, 2, 3, 4].map(node), node(16));
    let parameters = Parameters::new(Vehicle::Increments, Pose::default());
    let open = || Ok(Box::new(bus.join()) as Box<dyn agv_host_sim::bus::Bus>);
    let summary = live::record_can(open, &nodes, &parameters, clock, &limits, &is_stopped, &recorder).unwrap();
    assert_eq!(summary.frames, 0);
    assert!(clock.now().since(begin) >= 30.0 && !recorder.has_data());
    // It has no name, for there is nothing in it.
    drop(recorder);
    assert_eq!(std::fs::read_dir(files.folder()).unwrap().count(), 0);
}

/// Another name for the first landmark of a layout.
fn rename(bytes: Vec<u8>) -> Vec<u8> {
    const ANSWER: &[u8] = b"sAN mNLAYGetLandmark ";
    let Some(place) = position(&bytes, ANSWER) else { return bytes };
    let telegram = String::from_utf8(bytes[place..].to_vec()).unwrap();
    let mut words: Vec<&str> = telegram.split(' ').collect();
    // Behind the answer's name: an error, a count, and the first landmark's name.
    assert_eq!(words[4], "0");
    words[4] = "7FF";
    [&bytes[..place], words.join(" ").as_bytes()].concat()
}

/// A layout without names, though there are landmarks.
fn forget(bytes: Vec<u8>) -> Vec<u8> {
    const ANSWER: &[u8] = b"sAN mNLAYGetLandmark ";
    if position(&bytes, ANSWER).is_some() { b"\x02sAN mNLAYGetLandmark 0 0\x03".to_vec() } else { bytes }
}

#[test]
fn a_layout_that_was_not_asked_for_is_not_written() {
    let scenario = "[world]\nkind = \"block_storage\"\nreflectors = \"aisle\"\n";
    let files = Files::new();
    let scenario = files.write("aisle.toml", scenario.as_bytes());
    let sensor = Server::start(&["--scenario", &scenario, "--dialect", "cola-a"]);
    let layout = files.path("hall.imk");
    let honest = behind(&sensor, |bytes| bytes);
    let run = agv(&["nav350", "layout", "download", &honest, &layout]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    assert!(layout_file::load(Path::new(&layout)).unwrap().len() > 5);
    let before = std::fs::read(&layout).unwrap();
    for twist in [rename as Twist, forget] {
        let complaint = refusal(&["nav350", "layout", "download", &behind(&sensor, twist), &layout]);
        assert!(complaint.contains("other landmarks than it was asked for"), "{complaint}");
        assert_eq!(std::fs::read(&layout).unwrap(), before);
    }
}

/// The kind of the reflectors is no number.
fn garble(bytes: Vec<u8>) -> Vec<u8> {
    const ANSWER: &[u8] = b"sRA NLMDReflType ";
    if position(&bytes, ANSWER).is_some() { b"\x02sRA NLMDReflType zz\x03".to_vec() } else { bytes }
}

#[test]
fn an_answer_that_cannot_be_read_is_not_called_silence() {
    let sensor = Server::start(&["--dialect", "cola-a"]);
    let complaint = refusal(&["nav350", "probe", &behind(&sensor, garble)]);
    assert!(complaint.contains("the answer to NLMDReflType cannot be read"), "{complaint}");
}
