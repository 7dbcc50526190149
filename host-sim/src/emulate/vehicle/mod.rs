//! A whole vehicle in emulation: the firmware on its board, with a NAV350 and encoders that see a simulated drive.
//!
//! The vehicle stands until the controller is told where it is and localises; then it drives. What the controller says on
//! its bus is kept, and held against the truth afterwards: the firmware never sees that.

use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use agv_core::geometry::{Pose, wrap};
use agv_core::measurement::Time;
use agv_core::state::Mode;
use agv_settings::Settings;
use agv_settings::store::KEY;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::{Content, PoseReceiver, PublishedPose};
use agv_wire::can::emcy::Emergency;
use agv_wire::nav350::SensorFrame;
use serde::Serialize;

use super::board::{self, Board, BoardError, Ports};
use super::encoder_pair::{EmulatedPair, PairError};
use super::foreign_traffic::ForeignTraffic;
use crate::bus::{Bus, SlcanBus};
use crate::live::relay::Relay;
use crate::live::stream::{StreamSummary, record_stream};
use crate::log::LogError;
use crate::provision::{ProvisionError, flash_image};
use crate::recording::{Recording, truth_at};
use crate::serve::nav350::{Drive, DriveError, Nav350, Options};

/// Why there is no drive.
#[derive(Debug, thiserror::Error)]
pub enum VehicleError {
    /// The board does not run.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The recording has nothing for the laser to see.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// The recording has nothing for the encoders.
    #[error(transparent)]
    Pair(#[from] PairError),
    /// The settings do not fit.
    #[error(transparent)]
    Provision(#[from] ProvisionError),
    /// A file or a socket fails.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The log stream fails.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The controller does not localise though it was told where it is.
    #[error("the controller does not localise: {0:?}")]
    NotLocalised(Option<Mode>),
}

/// A pose that the controller has said, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeardPose {
    /// When it was heard.
    pub heard: Instant,
    /// What it says.
    pub pose: PublishedPose,
}

/// An emergency that the controller has sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeardEmergency {
    /// When it was heard.
    pub heard: Instant,
    /// What it says.
    pub emergency: Emergency,
}

/// What is wrong with the bus, switched on and off while the vehicle drives.
#[derive(Debug, Default)]
pub struct BusTrouble {
    /// Whether the driving wheel's encoder is silent.
    pub is_drive_silent: AtomicBool,
    /// Of so many frames to the controller one has a wrong bit; none if 0.
    pub corrupted_in: AtomicU32,
    /// Frames of other nodes in each second.
    pub foreign: AtomicU32,
    /// How many of them were sent.
    pub foreign_sent: AtomicU32,
    /// Whether somebody is about to tell the vehicle where it is; off again when that was done.
    pub is_pose_told: AtomicBool,
}

/// How a drive is emulated.
pub struct VehicleOptions<'a> {
    /// The firmware.
    pub image: &'a Path,
    /// A folder for the board's files and the log; what is there is replaced.
    pub folder: &'a Path,
    /// The key that is provisioned.
    pub key: Option<[u8; KEY]>,
    /// Whether the flash begins with settings. If not, the controller finds the file `flash.bin` that is there.
    pub provision: bool,
    /// Whether the controller is told where it is when it starts. If not, it has to find out.
    pub is_told: bool,
}

/// Standard deviations of the pose that the controller is told, m and rad.
const START_DEVIATIONS: [f64; 2] = [0.05, 0.02];
/// How long the controller may take to localise.
const PATIENCE: Duration = Duration::from_secs(60);
/// Most frames of other nodes at once.
const LONGEST_BURST: f64 = 20.0;
/// How long the vehicle stands when everything is ready.
const LEAD: Duration = Duration::from_millis(500);

/// What is known of a drive while it goes on.
pub struct Watch<'a> {
    /// The ports of the board.
    pub ports: Ports,
    /// Port of the emulated NAV350 on this machine.
    pub laser_port: u16,
    /// Port of this machine where everybody may listen to the log stream.
    pub stream_port: u16,
    /// What is wrong with the bus.
    pub trouble: &'a BusTrouble,
    /// Whether the laser answers; the connections end when it does not.
    pub is_laser_on: &'a AtomicBool,
    /// What was heard so far.
    heard: &'a Mutex<Heard>,
    stopped: &'a AtomicBool,
}

#[derive(Default)]
struct Heard {
    poses: Vec<HeardPose>,
    emergencies: Vec<HeardEmergency>,
    /// When the drive began.
    begin: Option<Instant>,
    longest_stall: f64,
}

impl Watch<'_> {
    fn with<T>(&self, look: impl FnOnce(&Heard) -> T) -> T {
        look(&self.heard.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The newest pose.
    #[must_use]
    pub fn pose(&self) -> Option<HeardPose> {
        self.with(|heard| heard.poses.last().copied())
    }

    /// How long the vehicle has been driving; None while it stands at the start.
    #[must_use]
    pub fn driven(&self) -> Option<Duration> {
        self.with(|heard| heard.begin).and_then(|begin| Instant::now().checked_duration_since(begin))
    }

    /// All poses that were heard since.
    #[must_use]
    pub fn poses_since(&self, time: Instant) -> Vec<HeardPose> {
        self.with(|heard| heard.poses.iter().filter(|pose| pose.heard >= time).copied().collect())
    }

    /// All emergencies so far.
    #[must_use]
    pub fn emergencies(&self) -> Vec<HeardEmergency> {
        self.with(|heard| heard.emergencies.clone())
    }

    /// Ends the emulation before its time.
    pub fn end(&self) {
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// Whether the emulation has ended.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

/// What a drive has brought.
pub struct Driven {
    /// The log that the controller streamed.
    pub log: PathBuf,
    /// How whole it is.
    pub stream: StreamSummary,
    /// Poses on the bus.
    pub poses: Vec<HeardPose>,
    /// Emergencies on the bus.
    pub emergencies: Vec<HeardEmergency>,
    /// When the drive began.
    pub begin: Instant,
    /// The time of the recording at which it began.
    pub first: Time,
    /// Longest time that this machine kept the encoders waiting, s. Encoders that are late by 20 ms are a fault, so a drive
    /// on a machine that is too busy shows how faults are met, and no more.
    pub longest_stall: f64,
}

/// The settings of a vehicle that is as the recording says, in the emulator's network.
#[must_use]
pub fn settings_like(recording: &Recording, laser_port: u16) -> Settings {
    let mut settings = Settings::of(recording.parameters);
    settings.network.address = board::ADDRESS;
    settings.network.gateway = board::HOST;
    settings.network.laser = board::HOST;
    settings.network.laser_port = laser_port;
    settings
}

/// Lets the vehicle drive for `seconds` of a recording, or to its end. `watch` is called once, at the start, to look on
/// and make trouble.
///
/// # Errors
/// [`VehicleError`] if something does not begin or breaks down.
pub fn drive(
    recording: &Recording,
    options: &VehicleOptions,
    seconds: f64,
    watch: impl FnOnce(&Watch) + Send,
) -> Result<Driven, VehicleError> {
    let sensor_drive = Drive::new(recording, SensorFrame::default())?;
    let first = sensor_drive.turns().first().map_or(Time::default(), |turn| turn.start);
    let sensor = Nav350::new(sensor_drive, Options { stands: true, ..Options::default() });
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    let laser_port = listener.local_addr()?.port();
    let settings = settings_like(recording, laser_port);
    if options.provision {
        let image = flash_image(&settings, &recording.landmarks, options.key.as_ref())?;
        std::fs::write(options.folder.join("flash.bin"), image)?;
    }
    let (board, bus) = Board::start(options.image, options.folder)?;
    let log = options.folder.join("stream.agvlog");
    let heard = Mutex::new(Heard::default());
    let (trouble, is_laser_on) = (BusTrouble::default(), AtomicBool::new(true));
    let (is_streaming, stopped) = (AtomicBool::new(false), Arc::new(AtomicBool::new(false)));
    let ports = board.ports;
    let stage = Stage {
        recording,
        settings: &settings,
        sensor: &sensor,
        heard: &heard,
        trouble: &trouble,
        stopped: &stopped,
        first,
        is_told: options.is_told,
    };
    let stream_host = format!("127.0.0.1:{}", ports.log);
    let relay = Relay::bind()?;
    let stream_port = relay.port()?;
    let (outcome, stream) = std::thread::scope(|scope| {
        scope.spawn(|| serve_laser(&sensor, &listener, &is_laser_on, &stopped));
        scope.spawn(|| relay.serve(&stopped));
        let stream = scope.spawn(|| {
            // Until the controller listens, the emulator's network resets the connection.
            loop {
                let begun = || is_streaming.store(true, Ordering::Release);
                match record_stream(&stream_host, &log, &stopped, begun, |record| relay.pass(record)) {
                    Err(LogError::Empty { .. } | LogError::Io { .. }) if !stopped.load(Ordering::Relaxed) => {
                        std::thread::sleep(Duration::from_millis(20));
                    }
                    outcome => return outcome,
                }
            }
        });
        let watched = Watch {
            ports,
            laser_port,
            stream_port,
            trouble: &trouble,
            is_laser_on: &is_laser_on,
            heard: &heard,
            stopped: &stopped,
        };
        scope.spawn(move || watch(&watched));
        let outcome = stage.run(bus, board, &is_streaming, seconds);
        stopped.store(true, Ordering::Relaxed);
        (outcome, stream.join())
    });
    outcome?;
    let stream = stream.map_err(|_| std::io::Error::other("the recording of the log stream broke down"))??;
    let Heard { poses, emergencies, begin, longest_stall } = heard.into_inner().unwrap_or_else(PoisonError::into_inner);
    let begin = begin.ok_or(VehicleError::NotLocalised(poses.last().map(|heard| heard.pose.mode)))?;
    Ok(Driven { log, stream, poses, emergencies, begin, first, longest_stall })
}

/// Serves the sensor while it is on.
fn serve_laser(sensor: &Nav350, listener: &TcpListener, is_on: &AtomicBool, stopped: &AtomicBool) {
    while !stopped.load(Ordering::Relaxed) {
        if !is_on.load(Ordering::Relaxed) {
            // Who connects meanwhile is sent away.
            if let Ok((stream, _)) = listener.accept() {
                drop(stream);
            }
            std::thread::sleep(Duration::from_millis(5));
            continue;
        }
        let is_off = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while is_on.load(Ordering::Relaxed) && !stopped.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(2));
                }
                is_off.store(true, Ordering::Relaxed);
            });
            // A failure ends the drive without the laser, which the controller says.
            let _ = sensor.serve(listener, &is_off);
        });
    }
}

/// What plays on the bus.
struct Stage<'a> {
    recording: &'a Recording,
    settings: &'a Settings,
    sensor: &'a Nav350,
    heard: &'a Mutex<Heard>,
    trouble: &'a BusTrouble,
    stopped: &'a AtomicBool,
    first: Time,
    is_told: bool,
}

impl Stage<'_> {
    fn run(
        &self,
        mut bus: SlcanBus,
        mut board: Board,
        is_streaming: &AtomicBool,
        seconds: f64,
    ) -> Result<(), VehicleError> {
        let nodes = self.settings.nodes;
        let node = |number| NodeId::new(number).unwrap_or(FIRST_NODE);
        let controller = node(nodes.controller);
        let mut pair = EmulatedPair::new(self.recording, node(nodes.drive), node(nodes.steering))?.standing();
        let mut receiver = PoseReceiver::new(controller);
        let start = Instant::now();
        let now = || Time::from_micros(1_000_000).offset(start.elapsed().as_secs_f64());
        let mut end = None;
        let mut last_order = start;
        let mut orders = 0_u8;
        let mut sent = 0_u32;
        let mut looked = start;
        let own = [nodes.drive, nodes.steering, nodes.controller].map(node);
        let mut foreign = ForeignTraffic::new(1, &own);
        let mut foreign_due = 0.0_f64;
        loop {
            let now_looked = Instant::now();
            let rate = f64::from(self.trouble.foreign.load(Ordering::Relaxed));
            // What a stall has held up is left out: a bus takes no more frames than it has time for.
            foreign_due = (foreign_due + rate * (now_looked - looked).as_secs_f64()).min(LONGEST_BURST);
            if end.is_some() {
                let mut heard = self.heard();
                heard.longest_stall = heard.longest_stall.max((now_looked - looked).as_secs_f64());
            }
            looked = now_looked;
            if self.stopped.load(Ordering::Relaxed) || end.is_some_and(|end| Instant::now() > end) {
                return Ok(());
            }
            while foreign_due >= 1.0 {
                foreign_due -= 1.0;
                bus.send(&foreign.next_frame().into()).map_err(BoardError::from)?;
                self.trouble.foreign_sent.fetch_add(1, Ordering::Relaxed);
            }
            if !board.is_running() {
                return Err(BoardError::Ended.into());
            }
            // Everything that the localiser is told is in the stream, from the first sample on.
            if is_streaming.load(Ordering::Acquire) {
                for frame in pair.poll(now()) {
                    self.send_sensor_frame(&mut bus, &frame, &mut sent)?;
                }
            }
            if let Some(frame) = bus.receive(Instant::now() + Duration::from_millis(1)).map_err(BoardError::from)?
                && let Some(frame) = frame.classic()
            {
                for answer in pair.handle(frame) {
                    bus.send(&answer.into()).map_err(BoardError::from)?;
                }
                self.hear(frame, controller, &mut receiver);
            }
            if end.is_some() {
                if self.trouble.is_pose_told.swap(false, Ordering::Relaxed) {
                    orders = (orders + 1) % 16;
                    for frame in self.initial_pose(controller, orders) {
                        bus.send(&frame.into()).map_err(BoardError::from)?;
                    }
                }
                continue;
            }
            let is_localised = self.mode().is_some_and(|mode| mode == Mode::Reflectors || mode == Mode::Mixed);
            if is_localised {
                let begin = Instant::now() + LEAD;
                self.sensor.begin(begin);
                let first_sample = self.recording.events.iter().find_map(|event| match event.view() {
                    agv_core::localizer::Event::Encoders(sample) => Some(sample.time),
                    _ => None,
                });
                let shift = first_sample.map_or(0.0, |time| time.since(self.first));
                pair.begin(now().offset(LEAD.as_secs_f64() + shift));
                self.heard().begin = Some(begin);
                end = Some(begin + Duration::from_secs_f64(seconds.min(pair.duration())));
            } else if self.is_told && pair.are_operational() && last_order.elapsed() > Duration::from_millis(500) {
                last_order = Instant::now();
                orders = (orders + 1) % 16;
                for frame in self.initial_pose(controller, orders) {
                    bus.send(&frame.into()).map_err(BoardError::from)?;
                }
            }
            if start.elapsed() > PATIENCE {
                return Err(VehicleError::NotLocalised(self.mode()));
            }
        }
    }

    fn heard(&self) -> std::sync::MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn mode(&self) -> Option<Mode> {
        self.heard().poses.last().map(|heard| heard.pose.mode)
    }

    fn hear(&self, frame: &agv_wire::can::frame::Frame, controller: NodeId, receiver: &mut PoseReceiver) {
        let time = Instant::now();
        if let Some(pose) = receiver.handle(frame) {
            self.heard().poses.push(HeardPose { heard: time, pose });
        } else if let Ok(Message::Emergency { node, emergency }) = Message::decode(frame)
            && node == controller
        {
            self.heard().emergencies.push(HeardEmergency { heard: time, emergency });
        }
    }

    /// Sends what an encoder says, with the trouble that there is.
    fn send_sensor_frame(
        &self,
        bus: &mut SlcanBus,
        frame: &agv_wire::can::frame::Frame,
        sent: &mut u32,
    ) -> Result<(), BoardError> {
        use agv_wire::can::frame::Frame;
        let is_drive = matches!(
            Message::decode(frame),
            Ok(Message::TransmitPdo { node, .. } | Message::Heartbeat { node, .. })
                if node.number() == self.settings.nodes.drive
        );
        if is_drive && self.trouble.is_drive_silent.load(Ordering::Relaxed) {
            return Ok(());
        }
        *sent = sent.wrapping_add(1);
        let every = self.trouble.corrupted_in.load(Ordering::Relaxed);
        if every > 0 && sent.is_multiple_of(every) {
            let mut data = frame.data().to_vec();
            let bit = (*sent / every) as usize % (8 * data.len().max(1));
            if let Some(byte) = data.get_mut(bit / 8) {
                *byte ^= 1 << (bit % 8);
            }
            if let Some(frame) = Frame::new(frame.id(), &data) {
                return Ok(bus.send(&frame.into())?);
            }
        }
        Ok(bus.send(&(*frame).into())?)
    }

    fn initial_pose(&self, controller: NodeId, counter: u8) -> [agv_wire::can::frame::Frame; 2] {
        let driven = self.heard().begin.map_or(0.0, |begin| begin.elapsed().as_secs_f64());
        let Pose { x, y, theta } = truth_at(&self.recording.truth, self.first.offset(driven)).unwrap_or_default();
        let [position_deviation, heading_deviation] = START_DEVIATIONS;
        [
            Content::InitialPosition { x, y },
            Content::InitialHeading { heading: theta, position_deviation, heading_deviation },
        ]
        .map(|content| content.encode(controller, counter))
    }
}

const FIRST_NODE: NodeId = match NodeId::new(1) {
    Some(node) => node,
    None => panic!("1 is a node"),
};

/// How far the poses on the bus were from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Poses with reflectors, while driving.
    pub poses: usize,
    /// Share of all poses while driving that had reflectors.
    pub localised_share: f64,
    /// Position: 95 % mark, m.
    pub position_p95_m: f64,
    /// Position: largest, m.
    pub position_max_m: f64,
    /// Heading: 95 % mark, deg.
    pub heading_p95_deg: f64,
    /// Heading: largest, deg.
    pub heading_max_deg: f64,
    /// Longest time between poses, s.
    pub longest_gap_s: f64,
}

/// Compares the poses of a drive with its truth, each at the time that it states. The controller's clock is read from
/// the pose that came fastest.
#[must_use]
pub fn errors(driven: &Driven, recording: &Recording) -> Option<Errors> {
    let origin = driven.poses.first()?.heard;
    let seconds = |time: Instant| time.saturating_duration_since(origin).as_secs_f64();
    let mut stated = Vec::with_capacity(driven.poses.len());
    let mut last: Option<f64> = None;
    for heard in &driven.poses {
        let low = f64::from(heard.pose.time) * 1e-3;
        // Sixteen bits of milliseconds: the turn that is nearest to when it was heard, counted from the first pose.
        let first = f64::from(driven.poses[0].pose.time) * 1e-3;
        let expected = first + seconds(heard.heard);
        let time = low + 65.536 * ((expected - low) / 65.536).round();
        let gap = last.map_or(0.0, |last| time - last);
        last = Some(time);
        stated.push((time, gap, heard));
    }
    let offset = stated.iter().map(|(time, _, heard)| seconds(heard.heard) - time).fold(f64::INFINITY, f64::min);
    let begin = seconds(driven.begin);
    let (mut positions, mut headings, mut all, mut longest_gap) = (Vec::new(), Vec::new(), 0, 0.0_f64);
    for (time, gap, heard) in stated {
        let since = time + offset - begin;
        if since < 0.0 {
            continue;
        }
        let Some(truth) = truth_at(&recording.truth, driven.first.offset(since)) else { continue };
        all += 1;
        longest_gap = longest_gap.max(gap);
        if !matches!(heard.pose.mode, Mode::Reflectors | Mode::Mixed) {
            continue;
        }
        let Pose { x, y, theta } = heard.pose.pose;
        positions.push((x - truth.x).hypot(y - truth.y));
        headings.push(wrap(theta - truth.theta).abs().to_degrees());
    }
    positions.sort_by(f64::total_cmp);
    headings.sort_by(f64::total_cmp);
    let mark = |sorted: &[f64]| sorted.get(sorted.len() * 95 / 100).copied();
    Some(Errors {
        poses: positions.len(),
        localised_share: positions.len() as f64 / f64::from(all.max(1)),
        position_p95_m: mark(&positions)?,
        position_max_m: *positions.last()?,
        heading_p95_deg: mark(&headings)?,
        heading_max_deg: *headings.last()?,
        longest_gap_s: longest_gap,
    })
}
