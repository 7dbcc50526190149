//! `agv can`.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::measurement::Time;
use agv_core::odometry::{Counted, MOST_COUNTERS};
use agv_host_sim::bus::{self, Bus};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::import::candump;
use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_settings::Settings;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::{Content, PoseReceiver, PublishedPose};
use agv_wire::can::encoder::{EncoderSettings, Profile, Reporting};
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup};
use agv_wire::can::frame::{AnyFrame, Frame};
use agv_wire::can::plausibility::PlausibilityLimits;
use agv_wire::can::sdo::{Object, Request, Response};
use anyhow::Context;
use serde_json::json;

use super::encoder_arguments::node;
use super::output::note;

const HELP: &str = "\
A bus is an interface of SocketCAN, or an adapter that speaks SLCAN.

Examples:
  agv can monitor can0
  agv can encoders slcan:/dev/ttyACM0@500000 --drive 1 --steering 2
  agv can pose slcan-tcp:localhost:3333 --json
  agv can serve-encoders vcan0 --scenario block_storage_p1";

/// Take part in a CAN bus: can0, slcan:/dev/ttyACM0@500000, slcan-tcp:HOST:PORT
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Can {
    #[command(subcommand)]
    action: Action,
    /// Print one JSON object a line.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum Action {
    Monitor(Monitor),
    Encoders(Encoders),
    Pose(Pose),
    ServeEncoders(ServeEncoders),
}

/// Print every frame as candump does, and what it means
#[derive(clap::Args)]
struct Monitor {
    /// The bus
    bus: String,
    /// Node of the controller
    #[arg(long, default_value = "16", value_parser = node)]
    controller: NodeId,
    /// Stop after so many seconds
    #[arg(long)]
    seconds: Option<f64>,
}

/// Set up two encoders and print their positions and faults
#[derive(clap::Args)]
struct Encoders {
    /// The bus
    bus: String,
    /// Node of the driving wheel's encoder
    #[arg(long, default_value = "1", value_parser = node)]
    drive: NodeId,
    /// Node of the steering's encoder
    #[arg(long, default_value = "2", value_parser = node)]
    steering: NodeId,
    /// Read positions at SYNC instead of by the encoders' own timers
    #[arg(long)]
    sync: bool,
    /// Fastest motion, ticks/s
    #[arg(long, default_value = "1e6")]
    fastest: f64,
    /// Hardest braking, ticks/s^2
    #[arg(long, default_value = "1e6")]
    braking: f64,
    /// Stop after so many seconds
    #[arg(long)]
    seconds: Option<f64>,
}

/// Print the pose that the controller says
#[derive(clap::Args)]
struct Pose {
    /// The bus
    bus: String,
    /// Node of the controller
    #[arg(long, default_value = "16", value_parser = node)]
    controller: NodeId,
    /// Stop after so many seconds
    #[arg(long)]
    seconds: Option<f64>,
}

/// Be what tells the motion of a vehicle, encoders, drives or its own controller, in a simulated drive or a log
#[derive(clap::Args)]
struct ServeEncoders {
    /// The bus
    bus: String,
    /// Scenario to simulate, a file or one that comes with the program; see `agv simulate`
    #[arg(long, required_unless_present = "log", conflicts_with = "log")]
    scenario: Option<PathBuf>,
    /// Log to play
    #[arg(long)]
    log: Option<PathBuf>,
    /// Nodes of the counters, in the order in which the vehicle has them
    #[arg(long, value_delimiter = ',', num_args = 1..=4, default_value = "1,2,3,4", value_parser = node)]
    nodes: Vec<NodeId>,
    /// Be drives of CiA 402 that tell their positions, not encoders of CiA 406
    #[arg(long)]
    drives: bool,
    /// Stop after so many seconds; else at the end of the drive
    #[arg(long)]
    seconds: Option<f64>,
}

impl Can {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Monitor(command) => command.run(self.json),
            Action::Encoders(command) => command.run(self.json),
            Action::Pose(command) => command.run(self.json),
            Action::ServeEncoders(command) => command.run(),
        }
    }
}

/// The time since a program began, as the core wants it.
struct Clock {
    start: Instant,
    end: Option<Instant>,
}

impl Clock {
    fn new(seconds: Option<f64>) -> anyhow::Result<Self> {
        let start = Instant::now();
        let duration = seconds.map(Duration::try_from_secs_f64).transpose().context("--seconds")?;
        Ok(Self { start, end: duration.map(|duration| start + duration) })
    }

    fn now(&self) -> Time {
        Time::from_micros(self.start.elapsed().as_micros() as u64)
    }

    fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Waits for a frame, at most so long.
    fn receive(&self, bus: &mut dyn Bus, patience: Duration) -> anyhow::Result<Option<AnyFrame>> {
        let deadline = Instant::now() + patience;
        Ok(bus.receive(self.end.map_or(deadline, |end| deadline.min(end)))?)
    }
}

/// How long a command that only listens waits before it looks at the clock.
const LISTENING: Duration = Duration::from_millis(500);
/// How often state machines are asked what is due.
const STEP: Duration = Duration::from_millis(1);

impl Monitor {
    fn run(self, as_json: bool) -> anyhow::Result<()> {
        let mut bus = bus::open(&self.bus)?;
        let clock = Clock::new(self.seconds)?;
        while !clock.is_over() {
            let Some(frame) = clock.receive(&mut *bus, LISTENING)? else { continue };
            let meaning = frame.classic().and_then(|frame| meaning(frame, self.controller)).unwrap_or_default();
            let line = candump::screen_line(&self.bus, &frame);
            if as_json {
                let time = Some(clock.now());
                let seen = candump::SeenFrame { time, interface: self.bus.clone(), frame };
                println!("{}", json!({ "frame": candump::log_line(&seen), "meaning": meaning }));
                continue;
            }
            println!("{}", format!("{line:<56}  {meaning}").trim_end());
        }
        Ok(())
    }
}

/// What a frame means, in a few words.
fn meaning(frame: &Frame, controller: NodeId) -> Option<String> {
    if let Ok((content, counter)) = Content::decode(frame, controller) {
        return Some(format!("{content:?} #{counter}"));
    }
    Some(match Message::decode(frame).ok()? {
        Message::SdoRequest { node, bytes } => format!("SDO to {}: {}", node.number(), request(bytes)),
        Message::SdoResponse { node, bytes } => format!("SDO of {}: {}", node.number(), response(bytes)),
        Message::Nmt { command, node: None } => format!("NMT {command:?}, all nodes"),
        Message::Nmt { command, node: Some(node) } => format!("NMT {command:?}, node {}", node.number()),
        Message::Sync { .. } => "SYNC".to_owned(),
        Message::Emergency { node, emergency } => {
            format!("emergency of {}: {:04X}, register {:02X}", node.number(), emergency.code, emergency.register)
        }
        Message::TransmitPdo { node, number, .. } => format!("PDO {number} of {}", node.number()),
        Message::ReceivePdo { node, number, .. } => format!("PDO {number} to {}", node.number()),
        Message::Heartbeat { node, state } => format!("node {} is {state:?}", node.number()),
    })
}

fn place(object: Object) -> String {
    format!("{:04X}:{:02X}", object.index, object.sub)
}

fn request(bytes: [u8; 8]) -> String {
    match Request::decode(bytes) {
        Ok(Request::Read(object)) => format!("read {}", place(object)),
        Ok(Request::Write(object, value)) => format!("write {} = {:X}h", place(object), value.unsigned()),
        Ok(Request::Abort(object, reason)) => format!("{} given up, {reason:?}", place(object)),
        Err(_) => "part of a longer transfer".to_owned(),
    }
}

fn response(bytes: [u8; 8]) -> String {
    match Response::decode(bytes) {
        Ok(Response::Read(object, value)) => format!("{} = {:X}h", place(object), value.unsigned()),
        Ok(Response::Segmented(object)) => format!("{} is longer than four bytes", place(object)),
        Ok(Response::Written(object)) => format!("{} written", place(object)),
        Ok(Response::Abort(object, reason)) => format!("{} refused, {reason:?}", place(object)),
        Err(_) => "part of a longer transfer".to_owned(),
    }
}

impl Encoders {
    fn run(self, as_json: bool) -> anyhow::Result<()> {
        let mut bus = bus::open(&self.bus)?;
        let clock = Clock::new(self.seconds)?;
        let reporting = if self.sync { Reporting::Synchronous } else { Reporting::Timer { period: 10 } };
        let channel = |node, counted| ChannelSettings {
            encoder: EncoderSettings { reporting, ..EncoderSettings::new(node) },
            limits: PlausibilityLimits::every(0.010, self.fastest, self.braking),
            counted,
        };
        let channels = [channel(self.drive, Counted::Turn), channel(self.steering, Counted::Steering)];
        let mut group = EncoderGroup::new(&channels, 0.010, clock.now());
        let mut known = None;
        while !clock.is_over() {
            while let Some(frame) = group.poll(clock.now()) {
                bus.send(&frame.into())?;
            }
            if let Some(frame) = clock.receive(&mut *bus, STEP)?
                && let Some(sample) = frame.classic().and_then(|frame| group.handle(frame, clock.now()))
            {
                let Counts { time, counts: [drive, steering, ..] } = sample;
                let time = time.seconds();
                if as_json {
                    println!("{}", json!({ "time_s": time, "drive": drive, "steering": steering }));
                } else {
                    println!("{time:12.6}  drive {drive:10}  steering {steering:10}");
                }
            }
            let now = clock.now();
            let faults = group.faults(now);
            let state = (group.states().collect::<Vec<_>>(), [faults.drive, faults.steering]);
            if known.as_ref() != Some(&state) {
                let (states, faults) = &state;
                if as_json {
                    let states: Vec<_> = states.iter().map(|state| format!("{state:?}")).collect();
                    println!("{}", json!({ "time_s": now.seconds(), "states": states, "faults": faults }));
                } else {
                    println!("{:12.6}  states {states:?}, faults {:?} {:?}", now.seconds(), faults[0], faults[1]);
                }
                known = Some(state);
            }
        }
        Ok(())
    }
}

impl Pose {
    fn run(self, as_json: bool) -> anyhow::Result<()> {
        let mut bus = bus::open(&self.bus)?;
        let clock = Clock::new(self.seconds)?;
        let mut receiver = PoseReceiver::new(self.controller);
        while !clock.is_over() {
            let Some(frame) = clock.receive(&mut *bus, LISTENING)? else { continue };
            let Some(pose) = frame.classic().and_then(|frame| receiver.handle(frame)) else { continue };
            if as_json {
                println!("{}", pose_json(&pose));
                continue;
            }
            println!(
                "x {:10.4} m  y {:10.4} m  heading {:9.4} deg  +- {:.4} {:.4} m {:.3} deg  {:?} ({:?})  within {:.3} m {:.2} deg  {:.2} m without correction",
                pose.pose.x,
                pose.pose.y,
                pose.pose.theta.to_degrees(),
                pose.deviations[0],
                pose.deviations[1],
                pose.deviations[2].to_degrees(),
                pose.mode,
                pose.reason,
                pose.level.position,
                pose.level.heading.to_degrees(),
                pose.dead_reckoning_distance,
            );
        }
        Ok(())
    }
}

fn pose_json(pose: &PublishedPose) -> serde_json::Value {
    json!({
        "x_m": pose.pose.x,
        "y_m": pose.pose.y,
        "heading_rad": pose.pose.theta,
        "deviations": pose.deviations,
        "correlations": pose.correlations,
        "mode": pose.mode,
        "reason": pose.reason,
        "dead_reckoning_distance_m": pose.dead_reckoning_distance,
        "drive_fault": pose.health.drive,
        "steering_fault": pose.health.steering,
        "laser": format!("{:?}", pose.health.laser),
        "resets": pose.resets,
        "last_reset_m": pose.last_reset,
        "overflows": pose.overflows,
        "protection_level": {"position_m": pose.level.position, "heading_deg": pose.level.heading.to_degrees()},
        "alarm": pose.alarm,
        "counter": pose.counter,
        "time_ms": pose.time,
    })
}

impl ServeEncoders {
    fn run(self) -> anyhow::Result<()> {
        let recording = self.recording()?;
        let mut motion = EmulatedMotion::new(&recording, &self.encoder_nodes())?;
        let mut bus = bus::open(&self.bus)?;
        let clock = Clock::new(self.seconds)?;
        while !clock.is_over() {
            let now = clock.now();
            // Without a stated time the program ends with the drive.
            let is_done = motion.start().is_some_and(|start| now.since(start) > motion.duration());
            if self.seconds.is_none() && is_done {
                break;
            }
            for frame in motion.poll(now) {
                bus.send(&frame.into())?;
            }
            let Some(frame) = clock.receive(&mut *bus, STEP)? else { continue };
            for answer in frame.classic().map(|frame| motion.handle(frame)).unwrap_or_default() {
                bus.send(&answer.into())?;
            }
        }
        Ok(())
    }

    fn encoder_nodes(&self) -> EncoderNodes {
        let usual = EncoderNodes::of(&Settings::default());
        let mut encoders = usual.encoders;
        encoders.iter_mut().zip(&self.nodes).for_each(|(node, given)| *node = *given);
        let profile = if self.drives { Profile::Drive } else { Profile::Encoder };
        EncoderNodes { encoders, profiles: [profile; MOST_COUNTERS], ..usual }
    }

    fn recording(&self) -> anyhow::Result<Recording> {
        if let Some(scenario) = &self.scenario {
            let mut scenario = Scenario::read(scenario)?;
            scenario.laser.scans = false;
            return Ok(simulate(&scenario)?.recording);
        }
        let log = self.log.as_ref().context("neither a scenario nor a log")?;
        let (recording, damages) = agv_host_sim::log::read(log)?;
        if !damages.is_empty() {
            note(&format!("{}: {} places are damaged", log.display(), damages.len()));
        }
        Ok(recording)
    }
}
