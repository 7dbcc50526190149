//! The service port of a vehicle that localises, attacked by peers who have not the key.
//!
//! The vehicle stands, so that nothing but its key protects its settings. Everything takes real time; what is asserted are
//! values.

use std::collections::BTreeSet;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::path::Path;
use std::time::{Duration, Instant};

use agv_core::geometry::Point;
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, ReflectorObservation};
use agv_core::state::Mode;
use agv_host_sim::emulate::vehicle::{self, VehicleOptions, Watch};
use agv_host_sim::link::service::{Client, Setting};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_settings::leaf::Value;
use agv_settings::service::authentication::{Nonce, TAG, tag};
use agv_settings::service::{Change, Frames, LONGEST_MESSAGE, Refusal, Request, Response, encode};
use agv_tests::{emulator, image, too_busy};
use socket2::{Domain, Socket, Type};

const KEY: [u8; 32] = [0x42; 32];
/// How long the controller may take to close a connection or to serve the next: its own patience is 10 s.
const PATIENCE: Duration = Duration::from_secs(30);
/// How long the vehicle is emulated at most, s.
const SECONDS: f64 = 120.0;
/// Reflectors that it sees: a vehicle that stands is not believed to have found itself with fewer than five.
const SEEN: usize = 8;

/// The standard hall, seen by a vehicle that stands at the start of the drive.
fn standing() -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    let mut recording = simulate(&Scenario::read(&path).unwrap()).unwrap().recording;
    let first = |events: &[RecordedEvent]| {
        events.iter().find_map(|event| match event {
            RecordedEvent::Encoders(sample) => Some(*sample),
            _ => None,
        })
    };
    let stand = first(&recording.events).unwrap();
    let sensor = recording.truth[0].pose.compose(recording.parameters.lasers.first());
    let places = recording.landmarks.iter().filter(|landmark| landmark.kind == LandmarkKind::Reflector);
    let mut seen: Vec<_> = places.map(|landmark| sensor.inverse_transform(&landmark.position())).collect();
    seen.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let revolution = recording.events.iter().find(|event| matches!(event, RecordedEvent::Reflectors(_))).unwrap();
    let revolutions = (0..(8.0 * SECONDS) as u32).map(|number| {
        let mut revolution = revolution.clone();
        if let RecordedEvent::Reflectors(told) = &mut revolution {
            let time = stand.time.offset(0.125 * f64::from(number) + 0.06);
            let observe =
                |at: &Point| ReflectorObservation { time, range: at.norm() as f32, bearing: at.y.atan2(at.x) as f32 };
            told.observations = seen[..SEEN].iter().map(observe).collect();
        }
        revolution
    });
    let counts = (0..(100.0 * SECONDS) as u32).map(|step| {
        RecordedEvent::Encoders(EncoderSample { time: stand.time.offset(0.01 * f64::from(step)), ..stand })
    });
    let mut events: Vec<RecordedEvent> = revolutions.chain(counts).collect();
    events.sort_by_key(RecordedEvent::time);
    recording.events = events;
    let pose = recording.truth[0].pose;
    recording.truth.iter_mut().for_each(|truth| truth.pose = pose);
    recording
}

/// A peer that may say anything.
struct Peer {
    stream: TcpStream,
    nonce: Nonce,
}

/// What came back.
#[derive(Debug, PartialEq)]
enum Said {
    Done,
    Refused(Refusal),
    Nonce(Nonce),
    Other,
    Closed,
}

fn is_slow(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

fn request(request: &Request) -> Vec<u8> {
    let mut room = [0; LONGEST_MESSAGE];
    let length = encode(request, |_| None, &mut room).unwrap();
    room[..length].to_vec()
}

/// A change with a tag under `key`.
fn signed(change: Change, key: &[u8; 32], nonce: &Nonce, number: u32) -> Vec<u8> {
    let mut room = [0; LONGEST_MESSAGE];
    let sign = |bytes: &[u8]| Some(tag(key, nonce, number, bytes));
    let length = encode(&Request::Change(change), sign, &mut room).unwrap();
    room[..length].to_vec()
}

/// The same message with another end, and a length that fits it.
fn ending(message: &[u8], end: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut body = message[2..].to_vec();
    end(&mut body);
    let length = (body.len() as u16).to_le_bytes();
    [&length[..], &body].concat()
}

impl Peer {
    /// A connection, perhaps one that the controller closes at once.
    fn knock(port: u16) -> Option<TcpStream> {
        let stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        stream.set_nodelay(true).ok()?;
        stream.set_read_timeout(Some(PATIENCE)).ok()?;
        stream.set_write_timeout(Some(PATIENCE)).ok()?;
        Some(stream)
    }

    /// A connection that takes little before it is read: this machine holds back megabytes for others.
    fn knock_with_small_buffers(port: u16) -> Option<TcpStream> {
        let socket = Socket::new(Domain::IPV4, Type::STREAM, None).ok()?;
        socket.set_tcp_mss(536).ok()?;
        socket.set_recv_buffer_size(4096).ok()?;
        socket.connect(&SocketAddr::from(([127, 0, 0, 1], port)).into()).ok()?;
        socket.set_read_timeout(Some(PATIENCE)).ok()?;
        Some(socket.into())
    }

    /// A connection that the controller answers on.
    fn connect(port: u16) -> Self {
        Self::connect_by(|| Self::knock(port))
    }

    fn connect_by(knock: impl Fn() -> Option<TcpStream>) -> Self {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(stream) = knock() {
                let mut peer = Self { stream, nonce: [0; 16] };
                if let Said::Nonce(nonce) = peer.ask(&request(&Request::Nonce)) {
                    peer.nonce = nonce;
                    return peer;
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("the service port serves nobody");
    }

    fn ask(&mut self, bytes: &[u8]) -> Said {
        // The controller may have closed the connection before it was told everything.
        let _ = self.stream.write_all(bytes);
        self.hear()
    }

    fn hear(&mut self) -> Said {
        let mut frames = Frames::new();
        let mut byte = [0];
        loop {
            match self.stream.read(&mut byte) {
                Ok(0) => return Said::Closed,
                Ok(_) => {}
                Err(error) if is_slow(&error) => panic!("neither answered nor closed"),
                Err(_) => return Said::Closed,
            }
            if frames.push(&byte).unwrap().1 {
                return match postcard::from_bytes(frames.message()).unwrap() {
                    Response::Done => Said::Done,
                    Response::Refused(refusal) => Said::Refused(refusal),
                    Response::Nonce(nonce) => Said::Nonce(nonce),
                    _ => Said::Other,
                };
            }
        }
    }
}

/// What somebody who can read it sees of the controller, and what it keeps.
#[derive(Debug, PartialEq)]
struct Kept {
    settings: Vec<Setting>,
    map: Vec<Landmark>,
    panic: String,
    starts: u32,
    flash: Vec<u8>,
}

fn client(port: u16) -> Client {
    let start = Instant::now();
    loop {
        match Client::connect(&format!("127.0.0.1:{port}"), Some(KEY)) {
            Ok(client) => return client,
            Err(error) => assert!(start.elapsed() < PATIENCE, "a client is not served: {error}"),
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn kept(port: u16, folder: &Path) -> Kept {
    let mut client = client(port);
    Kept {
        settings: client.list().unwrap(),
        map: client.download_map().unwrap(),
        panic: client.last_panic().unwrap(),
        starts: client.version().unwrap().starts,
        flash: std::fs::read(folder.join("flash.bin")).unwrap(),
    }
}

const FASTEST: &str = "limits.fastest";

fn set(value: f64) -> Change<'static> {
    Change::Set(FASTEST, Value::Number(value))
}

/// Changes that were recorded on their way are sent again.
fn replay(port: u16) -> usize {
    let mut owner = Peer::connect(port);
    let recorded = [signed(set(3.0), &KEY, &owner.nonce, 0), signed(set(5.0), &KEY, &owner.nonce, 1)];
    for bytes in &recorded {
        assert_eq!(owner.ask(bytes), Said::Done);
    }
    // One that never arrived on its own connection.
    let held = signed(set(3.0), &KEY, &owner.nonce, 2);
    let mut count = 0;
    for bytes in &recorded {
        assert_eq!(owner.ask(bytes), Said::Refused(Refusal::Tag));
        count += 1;
    }
    let mut other = Peer::connect(port);
    for bytes in recorded.iter().chain([&held]) {
        assert_eq!(other.ask(bytes), Said::Refused(Refusal::Tag));
        count += 1;
    }
    drop(other);
    drop(owner);
    // Before a nonce was asked for, and with the connection's own nonce said anew.
    let mut silent = Peer::connect(port);
    let before = signed(set(3.0), &KEY, &silent.nonce, 0);
    assert!(matches!(silent.ask(&request(&Request::Nonce)), Said::Nonce(_)));
    assert_eq!(silent.ask(&before), Said::Refused(Refusal::Tag));
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < PATIENCE, "a stranger is not heard");
        let Some(stream) = Peer::knock(port) else { continue };
        let mut stranger = Peer { stream, nonce: [0; 16] };
        match stranger.ask(&recorded[0]) {
            Said::Closed => continue,
            said => assert_eq!(said, Said::Refused(Refusal::Tag)),
        }
        return count + 2;
    }
}

/// Every change, with tags that are wrong in every way.
fn forge(port: u16) -> usize {
    let mut peer = Peer::connect(port);
    let mut count = 0;
    let mut refused = |peer: &mut Peer, bytes: &[u8]| {
        assert_eq!(peer.ask(bytes), Said::Refused(Refusal::Tag));
        count += 1;
    };
    let changes = [
        set(3.0),
        Change::Store,
        Change::BeginMap(1),
        Change::MapPiece(heapless::Vec::new()),
        Change::FinishMap,
        Change::SetPose { pose: [0.0; 3], deviations: [0.1; 2] },
        Change::ForgetPanic,
        Change::Reboot,
    ];
    for change in changes {
        let nonce = peer.nonce;
        let foreign = signed(change.clone(), &[0x43; 32], &nonce, 0);
        refused(&mut peer, &foreign);
        for number in [1, u32::MAX] {
            let wrong = signed(change.clone(), &KEY, &nonce, number);
            refused(&mut peer, &wrong);
        }
        let mut other = nonce;
        other[0] ^= 1;
        let wrong = signed(change.clone(), &KEY, &other, 0);
        refused(&mut peer, &wrong);
        let right = signed(change.clone(), &KEY, &nonce, 0);
        let zero = ending(&right, |body| {
            let end = body.len() - TAG;
            body[end..].fill(0);
        });
        refused(&mut peer, &zero);
    }
    let right = signed(set(3.0), &KEY, &peer.nonce, 0);
    for bit in 0..8 * TAG {
        let mut wrong = right.clone();
        let place = right.len() - TAG + bit / 8;
        wrong[place] ^= 1 << (bit % 8);
        refused(&mut peer, &wrong);
    }
    // A value that the owner has not signed.
    let mut wrong = right.clone();
    wrong[right.len() - TAG - 1] ^= 0x40;
    refused(&mut peer, &wrong);
    // A tag of another length is no message.
    for length in [0, 1, TAG / 2, TAG - 1, TAG + 1, 2 * TAG] {
        let mut peer = Peer::connect(port);
        let right = signed(set(3.0), &KEY, &peer.nonce, 0);
        let cut = ending(&right, |body| body.resize(body.len() - TAG + length, 0x5A));
        assert_eq!(peer.ask(&cut), Said::Closed, "{length}");
        count += 1;
    }
    count
}

/// What is no message.
fn talk_rubbish(port: u16) -> usize {
    let mut state = 1_u32;
    let mut random = |count: usize| -> Vec<u8> {
        let next = |_| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state as u8
        };
        (0..count).map(next).collect()
    };
    let version = request(&Request::Version);
    let messages: Vec<Vec<u8>> = vec![
        // Lengths beyond any message.
        [&[0xFF, 0xFF][..], &random(65_536)].concat(),
        [&(LONGEST_MESSAGE as u16 - 1).to_le_bytes()[..], &random(2000)].concat(),
        vec![0xFF; 65_536],
        // The longest message, of nothing.
        [&(LONGEST_MESSAGE as u16 - 2).to_le_bytes()[..], &[0xEE; LONGEST_MESSAGE - 2]].concat(),
        // No message at all, and a request with something behind it.
        vec![0, 0],
        ending(&version, |body| body.push(0)),
        // A name and a list that claim to be longer than the message.
        ending(&request(&Request::Get("")), |body| *body = vec![body[0], 0xFF, 0xFF, 0xFF, 0xFF, 0x0F]),
        ending(&request(&Request::Change(Change::MapPiece(heapless::Vec::new()))), |body| {
            body.pop();
            body.extend([0xFF, 0x7F]);
            body.extend([0; TAG]);
        }),
        // Other languages.
        b"GET / HTTP/1.1\r\nHost: vehicle\r\n\r\n".to_vec(),
        b"SSH-2.0-OpenSSH_9.9\r\n".to_vec(),
    ];
    for message in &messages {
        assert_eq!(Peer::connect(port).ask(message), Said::Closed, "{:02X?}", &message[..message.len().min(8)]);
    }
    for _ in 0..10 {
        // Random bytes that happen to be questions are answered; then the peer has nothing more to say.
        let mut peer = Peer::connect(port);
        let _ = peer.stream.write_all(&random(65_536));
        let _ = peer.stream.shutdown(Shutdown::Write);
        let start = Instant::now();
        while peer.hear() != Said::Closed {
            assert!(start.elapsed() < PATIENCE, "random bytes are answered for ever");
        }
    }
    messages.len() + 10
}

/// Says a message byte by byte and never ends it. Gives how long that was endured, s.
fn dribble(mut peer: Peer) -> f64 {
    let start = Instant::now();
    peer.stream.set_read_timeout(Some(Duration::from_millis(250))).unwrap();
    let mut message = (LONGEST_MESSAGE as u16 - 2).to_le_bytes().to_vec();
    message.resize(LONGEST_MESSAGE, 0);
    for byte in message {
        let is_told = peer.stream.write_all(&[byte]).is_ok();
        let mut answer = [0];
        let is_closed = match peer.stream.read(&mut answer) {
            Ok(count) => count == 0,
            Err(error) => !is_slow(&error),
        };
        if !is_told || is_closed {
            return start.elapsed().as_secs_f64();
        }
        assert!(start.elapsed() < PATIENCE, "a message without end is waited for");
    }
    unreachable!("the message is longer than the patience")
}

/// Asks for the longest answers and takes none. Gives how long that was endured, s.
fn ask_without_reading(mut peer: Peer) -> f64 {
    let start = Instant::now();
    peer.stream.set_write_timeout(Some(Duration::from_millis(100))).unwrap();
    let questions = request(&Request::Map(0)).repeat(1000);
    loop {
        match peer.stream.write(&questions) {
            Ok(_) => {}
            Err(error) if is_slow(&error) => {}
            Err(_) => return start.elapsed().as_secs_f64(),
        }
        assert!(start.elapsed() < PATIENCE, "a peer that reads nothing is kept");
    }
}

/// Connections that are there for nothing, while both that are served are held by slow peers. Gives how many.
fn crowd(port: u16) -> usize {
    let crowd: Vec<TcpStream> = (0..60).filter_map(|_| Peer::knock(port)).collect();
    let count = crowd.len();
    for mut stream in crowd {
        let mut byte = [0];
        match stream.read(&mut byte) {
            Ok(0) => {}
            Ok(_) => panic!("an answer to no question"),
            Err(error) => assert!(!is_slow(&error), "a connection that says nothing is kept"),
        }
    }
    count
}

/// Poses during attacks.
#[derive(Default)]
struct Poses {
    all: usize,
    with_reflectors: usize,
    /// Whether the place was lost.
    has_lost: bool,
}

/// How the poses went on during an attack.
fn check_poses(name: &str, watch: &Watch, start: Instant, seen: &mut Poses) {
    let poses = watch.poses_since(start);
    let duration = start.elapsed().as_secs_f64();
    let with_reflectors = poses.iter().filter(|heard| heard.pose.mode == Mode::Reflectors).count();
    let worst = poses.windows(2).map(|pair| (pair[1].heard - pair[0].heard).as_secs_f64()).fold(0.0, f64::max);
    let others = poses.iter().filter(|heard| heard.pose.mode != Mode::Reflectors);
    let others: BTreeSet<String> =
        others.map(|heard| format!("{:?} {:?}", heard.pose.mode, heard.pose.health)).collect();
    others.iter().for_each(|other| println!("{other}"));
    println!(
        "{name:<12} {duration:>5.1} s, {} poses, {with_reflectors} with reflectors, longest gap {:.0} ms",
        poses.len(),
        1e3 * worst
    );
    // Encoders that come late are the machine's affair; if they are so for long that the place is lost is asked at the end.
    let is_known = |mode| matches!(mode, Mode::Reflectors | Mode::WithoutOdometry | Mode::DeadReckoning);
    seen.has_lost |= poses.iter().any(|heard| !is_known(heard.pose.mode));
    assert!(poses.len() as f64 > 25.0 * duration && worst < 0.5, "{name}: {} poses, {worst} s", poses.len());
    seen.all += poses.len();
    seen.with_reflectors += with_reflectors;
}

fn attack(watch: &Watch, folder: &Path) -> Poses {
    let port = watch.ports.service;
    let start = Instant::now();
    // It has stood for longer than the second that it must before it is changed.
    while watch.driven().is_none_or(|driven| driven < Duration::from_secs(2)) {
        assert!(start.elapsed() < 2 * PATIENCE && !watch.is_over(), "the vehicle does not localise");
        std::thread::sleep(Duration::from_millis(2));
    }
    let before = kept(port, folder);
    let mut poses = Poses::default();
    let mut check = |name: &str, work: &dyn Fn()| {
        let start = Instant::now();
        work();
        check_poses(name, watch, start, &mut poses);
    };
    check("replay", &|| println!("{} replayed changes", replay(port)));
    check("forgery", &|| println!("{} forged changes", forge(port)));
    check("rubbish", &|| println!("{} connections with rubbish", talk_rubbish(port)));
    check("slow peers", &|| {
        let writer = Peer::connect(port);
        let reader = Peer::connect_by(|| Peer::knock_with_small_buffers(port));
        std::thread::scope(|scope| {
            let writer = scope.spawn(|| dribble(writer));
            let reader = scope.spawn(|| ask_without_reading(reader));
            println!("{} connections that say nothing", crowd(port));
            println!("a slow writer was endured for {:.1} s", writer.join().unwrap());
            println!("a slow reader was endured for {:.1} s", reader.join().unwrap());
        });
    });
    let served = Instant::now();
    let after = kept(port, folder);
    println!("a client was served after {:.1} s", served.elapsed().as_secs_f64());
    assert_eq!(after, before);
    // Who has the key may still change what strangers could not.
    let mut client = client(port);
    client.set(FASTEST, Value::Number(2.5)).unwrap();
    assert_eq!(client.get(FASTEST).unwrap().value, Value::Number(2.5));
    assert!(!watch.is_over(), "the attacks took longer than the emulation");
    poses
}

#[test]
fn strangers_change_nothing_and_stop_nothing() {
    const NAME: &str = "strangers_change_nothing_and_stop_nothing";
    let Some(image) = image(NAME, "an500", "vehicle").filter(|_| emulator(NAME)) else { return };
    let recording = standing();
    // A machine that is too busy for encoders in real time is given some tries.
    for _ in 0..3 {
        let folder = tempfile::tempdir().unwrap();
        let options = VehicleOptions { key: Some(KEY), ..VehicleOptions::new(&image, folder.path()) };
        let mut seen = None;
        let look = |watch: &Watch| {
            // Ends the emulation even if something is found.
            let _end = End(watch);
            seen = Some(attack(watch, folder.path()));
        };
        let driven = vehicle::drive(&recording, &options, SECONDS, look).unwrap();
        let Poses { all, with_reflectors, has_lost } = seen.unwrap();
        // A machine that keeps the encoders waiting adds faults of its own, and may do so until the place is lost, which is told (FF01h).
        let is_fair = agv_tests::is_fair(&driven);
        let is_machine = |code| !is_fair && has_lost && code == 0xFF01;
        let faults = agv_tests::faults(&driven);
        assert!(faults.iter().all(|heard| is_machine(heard.emergency.code)), "{:?}", driven.emergencies);
        let least = if is_fair { all * 9 / 10 } else { all / 2 };
        let last = driven.poses.last().unwrap().pose.mode;
        let is_held = !has_lost && with_reflectors >= least && last == Mode::Reflectors;
        if is_held {
            return;
        }
        assert!(!is_fair, "{with_reflectors} of {all} poses with reflectors, lost: {has_lost}, at the end {last:?}");
    }
    too_busy(NAME);
}

struct End<'a>(&'a Watch<'a>);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.end();
    }
}
