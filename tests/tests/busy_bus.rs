//! A bus that other nodes fill: our encoders' samples are whole and in time, and nothing of the others is taken for ours.
//!
//! The bus is simulated bit by bit, with its arbitration and its errors, so that every run is the same; behind it is the
//! code that runs in the firmware. A second test has the firmware itself, in emulation, among the same frames.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::localizer::{Event, Localizer, PoseFix};
use agv_core::measurement::{EncoderFault, EncoderFaults, EncoderSample, Time};
use agv_core::odometry::{Counted, Vehicle};
use agv_core::state::Mode;
use agv_host_sim::emulate::foreign_traffic::ForeignTraffic;
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::emulate::vehicle::{self, Driven, VehicleOptions, Watch};
use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_host_sim::{log, replay};
use agv_tests::{emulator, heard_in_time, image, sound_drive};
use agv_wire::can::canopen::{Message, NodeId, transmit_pdo_id};
use agv_wire::can::controller::{Health, OrderReceiver, PoseReceiver};
use agv_wire::can::controller_node::{ControllerNode, NodeSettings, ProcessData, WithoutSettings};
use agv_wire::can::encoder::{EncoderSettings, EncoderState};
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup};
use agv_wire::can::frame::{Frame, Id};
use agv_wire::can::plausibility::PlausibilityLimits;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

fn hall() -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    simulate(&Scenario::read(&path).unwrap()).unwrap().recording
}

fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

/// The bits of a frame on the wire up to its checksum, before stuffing (ISO 11898-1, 10.4).
fn plain_bits(frame: &Frame) -> Vec<bool> {
    let mut bits = vec![false];
    let mut put = |value: u32, count: u32| bits.extend((0..count).rev().map(|bit| value >> bit & 1 == 1));
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        // Identifier, RTR, IDE and a reserved bit.
        Id::Standard(id) => {
            put(id.as_raw().into(), 11);
            put(remote << 2, 3);
        }
        // Base, SRR and IDE, extension, RTR and two reserved bits.
        Id::Extended(id) => {
            put(id.as_raw() >> 18, 11);
            put(0b11, 2);
            put(id.as_raw() & 0x3_FFFF, 18);
            put(remote << 2, 3);
        }
    }
    put(frame.length() as u32, 4);
    frame.data().iter().for_each(|byte| put(u32::from(*byte), 8));
    let mut checksum = 0_u32;
    for bit in &bits {
        let is_set = (checksum >> 14 & 1 == 1) != *bit;
        checksum = (checksum << 1 & 0x7FFF) ^ if is_set { 0x4599 } else { 0 };
    }
    bits.extend((0..15).rev().map(|bit| checksum >> bit & 1 == 1));
    bits
}

/// How many bits a frame takes: with stuffing, delimiters, acknowledgement, end of frame and the pause behind it.
fn length(frame: &Frame) -> u64 {
    let (mut stuffed, mut run, mut last) = (0, 0, None);
    for bit in plain_bits(frame) {
        run = if Some(bit) == last { run + 1 } else { 1 };
        (stuffed, last) = (stuffed + 1, Some(bit));
        if run == 5 {
            // The bit that is put in begins a run of its own.
            (stuffed, run, last) = (stuffed + 1, 1, Some(!bit));
        }
    }
    stuffed + 13
}

/// What decides who goes first: the bits up to the one that asks for data, the lowest value wins.
fn priority(frame: &Frame) -> u32 {
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        Id::Standard(id) => u32::from(id.as_raw()) << 21 | remote << 20,
        Id::Extended(id) => {
            let (base, extension) = (id.as_raw() >> 18, id.as_raw() & 0x3_FFFF);
            base << 21 | 0b11 << 19 | extension << 1 | remote
        }
    }
}

#[test]
fn frames_are_as_long_as_the_standard_says() {
    let data = |length: usize| [0x55; 8][..length].to_vec();
    for count in 0..=8 {
        let standard = Frame::new(agv_wire::can::frame::standard_id(0x2AA), &data(count)).unwrap();
        let extended = Frame::new(agv_wire::can::frame::extended_id(0x0AAA_AAAA), &data(count)).unwrap();
        let zero = Frame::new(agv_wire::can::frame::standard_id(0), &vec![0; count]).unwrap();
        let count = count as u64;
        // Without a stuffed bit a frame has 47 or 67 bits and those of its data; one in four can be stuffed.
        assert_eq!(plain_bits(&standard).len() as u64 + 13, 47 + 8 * count);
        assert_eq!(plain_bits(&extended).len() as u64 + 13, 67 + 8 * count);
        for frame in [standard, zero] {
            let plain = 47 + 8 * count;
            assert!((plain..=plain + (34 + 8 * count - 1) / 4).contains(&length(&frame)), "{frame:?}");
        }
    }
    // 34 equal bits: every fifth is followed by a stuffed one.
    assert_eq!(length(&Frame::new(agv_wire::can::frame::standard_id(0), &[]).unwrap()), 47 + 6);
}

/// A frame that waits, and since when.
#[derive(Clone, Copy)]
struct Waiting {
    frame: Frame,
    since: Time,
}

/// Who sends.
const ENCODERS: [usize; 2] = [0, 1];
const CONTROLLER: usize = 2;
const FIRST_FOREIGN: usize = 3;
/// Other nodes; each sends its frames one after the other.
const FOREIGN: usize = 12;

/// One of so many frames is destroyed on its way and sent again.
const DESTROYED: u32 = 300;
/// Bits of an error: flags of all nodes, delimiter, pause (ISO 11898-1, 10.4.4).
const ERROR: u64 = 12 + 8 + 3;

struct Bus {
    rate: f64,
    queues: Vec<VecDeque<Waiting>>,
    /// Who sends, what, and until when; it may be destroyed.
    sending: Option<(usize, Time, bool)>,
    busy_bits: u64,
    errors: u32,
    generator: ChaCha8Rng,
    longest_wait: [f64; 3],
}

impl Bus {
    fn new(rate: f64) -> Self {
        Self {
            rate,
            queues: vec![VecDeque::new(); FIRST_FOREIGN + FOREIGN],
            sending: None,
            busy_bits: 0,
            errors: 0,
            generator: ChaCha8Rng::seed_from_u64(7),
            longest_wait: [0.0; 3],
        }
    }

    fn queue(&mut self, who: usize, frame: Frame, now: Time) {
        self.queues[who].push_back(Waiting { frame, since: now });
    }

    /// The frame that has ended by `now`, who has sent it and when it ended. Call until there is none.
    fn advance(&mut self, now: Time) -> Option<(usize, Waiting, Time)> {
        loop {
            if let Some((who, end, is_destroyed)) = self.sending {
                if end > now {
                    return None;
                }
                self.sending = None;
                if is_destroyed {
                    self.begin(end);
                    continue;
                }
                let waiting = self.queues[who].pop_front().unwrap();
                if let Some(longest) = self.longest_wait.get_mut(who) {
                    *longest = longest.max(end.since(waiting.since));
                }
                self.begin(end);
                return Some((who, waiting, end));
            }
            self.begin(now);
            self.sending?;
        }
    }

    /// The most urgent of the first frames of all nodes goes.
    fn begin(&mut self, now: Time) {
        let first = |(who, queue): (usize, &VecDeque<Waiting>)| queue.front().map(|waiting| (who, waiting.frame));
        let all = self.queues.iter().enumerate().filter_map(first);
        let Some((who, frame)) = all.min_by_key(|(who, frame)| (priority(frame), *who)) else { return };
        let whole = length(&frame);
        let is_destroyed = self.generator.next_u32().is_multiple_of(DESTROYED);
        let bits = if is_destroyed { u64::from(self.generator.next_u32()) % whole + ERROR } else { whole };
        self.errors += u32::from(is_destroyed);
        self.busy_bits += bits;
        self.sending = Some((who, now.offset(bits as f64 / self.rate), is_destroyed));
    }
}

/// What the controller's own code made of it.
#[derive(Default)]
struct Heard {
    samples: Vec<EncoderSample>,
    faults: Vec<EncoderFaults>,
    /// When both encoders were set up.
    ready: Option<Time>,
    foreign: BTreeMap<&'static str, usize>,
    published: usize,
    received: usize,
}

fn channels(recording: &Recording) -> [ChannelSettings; 2] {
    let Vehicle::Tricycle(vehicle) = recording.parameters.vehicle else { panic!("a tricycle") };
    let (drive, steering) = (vehicle.drive_scale.abs(), vehicle.steering_scale.abs());
    let channel = |number, counted, fastest, braking| ChannelSettings {
        encoder: EncoderSettings::new(node(number)),
        limits: PlausibilityLimits::every(0.010, fastest, braking),
        counted,
    };
    [
        channel(1, Counted::Turn, recording.parameters.limits.fastest / drive, 2.5 / drive),
        channel(2, Counted::Steering, 3.0 / steering, 100.0 / steering),
    ]
}

fn kind(frame: &Frame) -> &'static str {
    match (frame.id(), frame.is_remote(), Message::decode(frame)) {
        (Id::Extended(_), ..) => "29 bits",
        (_, true, _) => "without data",
        (.., Ok(Message::Nmt { .. })) => "commands for others",
        (.., Ok(Message::Heartbeat { .. })) => "heartbeats",
        (.., Ok(Message::Sync { .. })) => "SYNC",
        (.., Ok(_)) => "messages of others",
        (.., Err(_)) => "of no node",
    }
}

/// Lets the vehicle drive on a bus of that bit rate, of which everybody together takes that share.
fn drive_on(recording: &Recording, rate: f64, load: f64, seconds: f64) {
    let (start, step) = (Time::from_micros(1_000_000), 20e-6);
    let own = [1, 2, 16].map(node);
    let nodes = EncoderNodes::new([1, 2, 3, 4].map(node), own[2]);
    let mut encoders = EmulatedMotion::new(recording, &nodes).unwrap();
    let mut foreign = ForeignTraffic::new(3, &own);
    let mut group = EncoderGroup::new(&channels(recording), 0.010, start);
    let mut controller = ControllerNode::new(NodeSettings::new(own[2]), start);
    let mut orders = OrderReceiver::new(own[2]);
    let limits = recording.parameters.alert_limits;
    let mut receiver = PoseReceiver::new(own[2]);
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(recording.parameters));
    let pose = recording.truth[0].pose;
    localizer.handle(&Event::SetPose(PoseFix { time: start, pose, position_deviation: 0.01, heading_deviation: 0.01 }));
    let (mut bus, mut heard) = (Bus::new(rate), Heard::default());
    let mut generator = ChaCha8Rng::seed_from_u64(11);
    // Counters as they left the driving wheel's encoder, and when.
    let mut sent: VecDeque<(u32, Time)> = VecDeque::new();
    let mut expected = Vec::new();
    let mut offered_bits = 0_u64;
    for tick in 0..(seconds / step) as u64 {
        let now = start.offset(tick as f64 * step);
        for frame in encoders.poll(now) {
            let is_of = |encoder: usize| {
                matches!(Message::decode(&frame), Ok(Message::TransmitPdo { node, .. } | Message::Heartbeat { node, .. } | Message::SdoResponse { node, .. })
                    if node == own[encoder])
            };
            let who = ENCODERS.into_iter().find(|encoder| is_of(*encoder)).unwrap();
            if frame.id() == transmit_pdo_id(own[0], 1) {
                sent.push_back((u32::from_le_bytes(frame.data().try_into().unwrap()), now));
            }
            offered_bits += length(&frame);
            bus.queue(who, frame, now);
        }
        if tick % 50 == 0 {
            heard.faults.extend(group.poll_faults(now));
            let asked = std::iter::from_fn(|| group.poll(now).or_else(|| controller.poll(now)));
            let mut frames: Vec<Frame> = asked.collect();
            let process = ProcessData { pose: localizer.outputs().pose, health: Health::default(), limits };
            let published = controller.publish(now, &process);
            heard.published += usize::from(!published.is_empty());
            frames.extend(published);
            for frame in frames {
                offered_bits += length(&frame);
                bus.queue(CONTROLLER, frame, now);
            }
        }
        // The others come in bursts, and never more than their share.
        if (offered_bits as f64) < load * rate * (now.since(start) + step) {
            for _ in 0..1 + generator.next_u32() % 10 {
                let frame = foreign.next_frame();
                *heard.foreign.entry(kind(&frame)).or_default() += 1;
                offered_bits += length(&frame);
                bus.queue(FIRST_FOREIGN + generator.next_u32() as usize % FOREIGN, frame, now);
            }
        }
        while let Some((who, Waiting { frame, .. }, end)) = bus.advance(now) {
            if who != CONTROLLER {
                let faults = group.poll_faults(end);
                heard.faults.extend(faults);
                let counts = group.handle(&frame, end);
                let sample = counts.map(|Counts { time, counts: [drive, steering, ..] }| EncoderSample {
                    time,
                    drive,
                    steering,
                });
                let (answer, order) =
                    (controller.handle(&frame, end, None, &mut WithoutSettings, Ok(())), orders.handle(&frame, end));
                assert!(answer.is_none() && order.is_none(), "{frame:?} is taken for {answer:?} {order:?}");
                assert!(sample.is_none() || who < CONTROLLER, "{frame:?} is taken for a sample");
                if let Some(sample) = sample {
                    localizer.handle(&Event::Encoders(sample));
                    heard.samples.push(sample);
                }
                if frame.id() == transmit_pdo_id(own[0], 1) && who == ENCODERS[0] {
                    expected.push(sent.pop_front().unwrap());
                }
            }
            if who == CONTROLLER || who >= FIRST_FOREIGN {
                for answer in encoders.handle(&frame) {
                    let Ok(Message::SdoResponse { node, .. }) = Message::decode(&answer) else { panic!("{answer:?}") };
                    assert_eq!(who, CONTROLLER, "an encoder answers a foreign frame: {frame:?}");
                    offered_bits += length(&answer);
                    bus.queue(usize::from(node == own[1]), answer, end);
                }
            }
            if who != CONTROLLER {
                assert!(receiver.handle(&frame).is_none(), "{frame:?} is taken for a pose");
            } else if let Some(pose) = receiver.handle(&frame) {
                heard.received += 1;
                assert_eq!(pose.health, Health::default());
            }
        }
        if heard.ready.is_none() && group.states().all(|state| state == EncoderState::Reporting) {
            heard.ready = Some(now);
        }
        assert!(heard.ready.is_none() || group.states().all(|state| state == EncoderState::Reporting));
        assert!(tick == 0 || controller.is_operational());
    }
    check(&heard, &bus, &expected, rate, load, seconds, start);
}

fn check(heard: &Heard, bus: &Bus, expected: &[(u32, Time)], rate: f64, load: f64, seconds: f64, start: Time) {
    let share = bus.busy_bits as f64 / (rate * seconds);
    let foreign: usize = heard.foreign.values().sum();
    println!("{:.0} kbit/s, load {:.1} %, {foreign} foreign frames, {} errors", rate * 1e-3, 100.0 * share, bus.errors);
    println!("foreign: {:?}", heard.foreign);
    let wait = bus.longest_wait.map(|wait| format!("{:.2}", 1e3 * wait));
    println!("longest wait of drive, steering, controller, ms: {}", wait.join(", "));
    assert!((share - load).abs() < 0.02, "{share}");
    assert!(foreign > 10_000 && heard.foreign.len() == 7 && bus.errors > 50, "{foreign} {}", bus.errors);
    // Encoders that were not set up yet are missing; that is withdrawn when they have been sound for 0.2 s.
    let ready = heard.ready.expect("the encoders are set up");
    println!("encoders set up after {:.0} ms", 1e3 * ready.since(start));
    assert!(ready.since(start) < 1.0, "{}", ready.since(start));
    let later: Vec<_> = heard.faults.iter().filter(|faults| faults.any() && faults.time.since(ready) > 0.25).collect();
    assert!(later.is_empty(), "{} faults: {:?}", later.len(), later.first());
    let early = |faults: &&EncoderFaults| faults.time.since(ready) <= 0.25;
    let is_known = |fault: Option<EncoderFault>| {
        fault.is_none_or(|fault| matches!(fault, EncoderFault::Late | EncoderFault::Missing))
    };
    assert!(heard.faults.iter().filter(early).all(|faults| is_known(faults.drive) && is_known(faults.steering)));
    // From then on every counter that was sent is a sample: once, in its order, and at its time.
    let from = expected.iter().position(|(_, time)| time.since(ready) > 0.25).unwrap();
    let first = heard.samples.iter().position(|sample| sample.time.since(expected[from].1) > -0.005).unwrap();
    // The last reading may wait for the steering's.
    let (expected, samples) = (&expected[from..], &heard.samples[first..]);
    assert!(samples.len() as f64 > 99.0 * (seconds - 2.0), "{}", samples.len());
    assert!(expected.len() - samples.len() <= 1, "{} sent, {} arrived", expected.len(), samples.len());
    let mut errors: Vec<f64> = Vec::new();
    for ((counter, time), sample) in expected.iter().zip(samples) {
        assert_eq!(sample.drive, *counter);
        errors.push(sample.time.since(*time).abs());
    }
    errors.sort_by(f64::total_cmp);
    let worst = errors[errors.len() - 1];
    println!("{} samples, all that were sent", samples.len());
    println!("time of a sample: 95 % {:.2} ms, worst {:.2} ms", 1e3 * errors[errors.len() * 95 / 100], 1e3 * worst);
    assert!(worst <= bus.longest_wait[0] + 1e-3, "{worst}");
    // Every pose that was said is heard whole, but for the last ones.
    println!("{} poses said, {} heard", heard.published, heard.received);
    assert!(heard.published - heard.received <= 2, "{} {}", heard.published, heard.received);
}

/// One at a time: the emulator works in real time.
static ALONE: Mutex<()> = Mutex::new(());

#[test]
fn encoders_are_heard_on_a_bus_that_is_nearly_full() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let recording = hall();
    for rate in [250_000.0, 500_000.0] {
        drive_on(&recording, rate, 0.9, 30.0);
    }
}

/// Frames of others in each second on the emulated board's line, beside some 200 of the encoders. From about 1000 on the
/// emulated line holds back, and the encoders are late.
const FOREIGN_RATE: u32 = 500;

#[test]
fn the_board_localises_among_foreign_frames() {
    const NAME: &str = "the_board_localises_among_foreign_frames";
    let Some(image) = image(NAME, "an500", "vehicle").filter(|_| emulator(NAME)) else { return };
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let recording = hall();
    let drive = || {
        let folder = tempfile::tempdir().unwrap();
        let options = VehicleOptions::new(&image, folder.path());
        let mut sent = 0;
        let look = |watch: &Watch| {
            let start = Instant::now();
            while watch.driven().is_none() && !watch.is_over() && start.elapsed() < Duration::from_secs(90) {
                std::thread::sleep(Duration::from_millis(2));
            }
            watch.trouble.foreign.store(FOREIGN_RATE, Ordering::Relaxed);
            while !watch.is_over() {
                std::thread::sleep(Duration::from_millis(20));
            }
            sent = watch.trouble.foreign_sent.load(Ordering::Relaxed);
        };
        let driven = vehicle::drive(&recording, &options, 8.0, look).unwrap();
        println!("{sent} foreign frames");
        // What the firmware was told is in its log, and it answered as the host does.
        let contents = log::read_contents(&driven.log, |_| ()).unwrap();
        assert!(driven.stream.damages == 0 && contents.damages.is_empty());
        let again = replay::replay(&contents.recording, |_| ()).unwrap();
        assert_eq!(replay::compare(&contents.outputs, &again).first_difference, None);
        assert!(sent > 5 * FOREIGN_RATE, "{sent}");
        driven
    };
    let judge = |driven: &Driven| {
        let errors = vehicle::errors(driven, &recording).expect("it localises");
        println!("{errors:?}");
        assert!(agv_tests::faults(driven).is_empty(), "{:?}", driven.emergencies);
        // What the emulated line has held back is late, whatever the firmware does.
        let in_time = heard_in_time(driven);
        println!("{} of {} poses while the line was in time", in_time.len(), driven.poses.len());
        assert!(in_time.len() > 200, "{}", in_time.len());
        for heard in &in_time {
            let health = heard.pose.health;
            assert!(health.drive.is_none() && health.steering.is_none(), "{health:?}");
        }
        let localised = in_time.iter().filter(|heard| heard.pose.mode == Mode::Reflectors).count();
        assert!(localised * 10 > in_time.len() * 9, "{localised} of {}", in_time.len());
        assert!(errors.position_p95_m < 0.02 && errors.heading_p95_deg < 0.1, "{errors:?}");
        // And all the while nothing else is said of an encoder than that its samples do not come in time.
        for heard in driven.poses.iter().filter(|heard| heard.heard > driven.begin) {
            let health = heard.pose.health;
            for fault in [health.drive, health.steering].into_iter().flatten() {
                assert!(matches!(fault, EncoderFault::Late | EncoderFault::Missing), "{fault:?}");
            }
        }
    };
    let _ = sound_drive(NAME, drive, |driven| driven, judge);
}
