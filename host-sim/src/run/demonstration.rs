//! A vehicle that is not there: encoders on a bus inside this program and a NAV350 over loopback, in a simulated hall.

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::measurement::Time;
use agv_settings::Settings;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::PoseReceiver;
use agv_wire::can::frame::Frame;
use agv_wire::nav350::SensorFrame;

use super::real_time::{self, Lacks};
use super::{DiscretePort, FLASH, Logs, Options, Ports, RealTime, RunError, Running, Summary};
use crate::bus::{Bus, BusError, InProcessBus, InProcessNode};
use crate::emulate::gyro::EmulatedGyro;
use crate::emulate::motion::{EmulatedMotion, MotionError};
use crate::link::clock::Clock;
use crate::output_file;
use crate::provision::{ProvisionError, flash_image};
use crate::recording::Recording;
use crate::serve::nav350::{Drive, DriveError, Nav350, Options as SensorOptions};
use crate::simulate::scenario::{Scenario, ScenarioError};
use crate::simulate::{SimulateError, simulate, standard};

/// How long the vehicle stands when it knows where it is.
const LEAD: Duration = Duration::from_millis(200);
/// How often the encoders look what is due.
const STEP: Duration = Duration::from_millis(1);

/// Why there is no demonstration.
#[derive(Debug, thiserror::Error)]
pub enum DemonstrationError {
    /// The scenario of the hall.
    #[error("the standard hall: {0}")]
    Text(#[from] toml::de::Error),
    /// The same.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The hall cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The laser sees nothing.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// Nothing tells the motion.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The map does not fit.
    #[error(transparent)]
    Provision(#[from] ProvisionError),
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A file or a socket fails.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The controller.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// A vehicle that will drive.
pub struct Demonstration {
    recording: Recording,
    lines: Option<Box<dyn DiscretePort>>,
}

impl Demonstration {
    /// The vehicle of the standard hall.
    ///
    /// # Errors
    /// If the hall cannot be simulated.
    pub fn new() -> Result<Self, DemonstrationError> {
        let scenario: Scenario = toml::from_str(standard::HALL)?;
        Ok(Self::of(simulate(&scenario)?.recording))
    }

    /// The vehicle of a recorded or simulated drive.
    #[must_use]
    pub const fn of(recording: Recording) -> Self {
        Self { recording, lines: None }
    }

    /// The same with discrete lines.
    #[must_use]
    pub fn with_lines(self, lines: Box<dyn DiscretePort>) -> Self {
        Self { lines: Some(lines), ..self }
    }

    /// The settings of the controller, whose laser is at that port of this machine.
    fn settings(&self, laser_port: u16) -> Settings {
        let mut settings = Settings::of(self.recording.parameters);
        settings.network.laser = Ipv4Addr::LOCALHOST.octets();
        settings.network.laser_port = laser_port;
        settings
    }

    /// Drives with a controller whose store is in `folder`, until `is_stopped`. The controller finds out by itself where it is; then
    /// the vehicle drives off, and it stands when the drive is over. `logs`, `note` and `watch` are those
    /// of [`super::run`].
    ///
    /// # Errors
    /// If something does not begin or breaks down.
    pub fn run(
        mut self,
        folder: &Path,
        real_time: RealTime,
        logs: Logs,
        is_stopped: &Arc<AtomicBool>,
        note: &(dyn Fn(&str) + Sync),
        watch: impl FnOnce(&Running) + Send,
    ) -> Result<Summary, DemonstrationError> {
        let drive = Drive::new(&self.recording, SensorFrame::default())?;
        let first = drive.turns().first().map_or(Time::default(), |turn| turn.start);
        let sensor = Nav350::new(drive, SensorOptions { stands: true, ..SensorOptions::default() });
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let settings = self.settings(listener.local_addr()?.port());
        std::fs::create_dir_all(folder)?;
        output_file::write(&folder.join(FLASH), flash_image(&settings, &self.recording.landmarks, None)?)?;
        let bus = InProcessBus::new();
        let mut stage = self.stage(bus.join(), &settings, first)?;
        let options = Options {
            store: folder.to_owned(),
            open_bus: Box::new(move || Ok(Box::new(bus.join()) as Box<dyn Bus>)),
            lines: self.lines.take(),
            gyro: None,
            ports: Ports::Any,
            real_time,
            datagrams: Vec::new(),
            socket: None,
            logs,
        };
        let is_over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| sensor.serve(&listener, &is_over));
            let playing = scope.spawn(|| {
                // Encoders are machines of their own, which wait for nothing that this one does; what it does not grant, the bus tells.
                let priority = real_time.bus_priority.map(|priority| priority.saturating_add(1));
                real_time::enter("encoders", priority, None, &Lacks::default());
                let outcome = stage.play(&sensor, &is_over);
                // Without encoders there is nothing to show.
                if outcome.is_err() {
                    is_stopped.store(true, Ordering::Relaxed);
                }
                outcome
            });
            // Even if `watch` panics: the threads are waited for.
            let end = End(&is_over);
            let outcome = super::run(options, is_stopped, note, watch);
            drop(end);
            if let Ok(played) = playing.join() {
                played?;
            }
            Ok(outcome?)
        })
    }

    fn stage(&self, node: InProcessNode, settings: &Settings, first: Time) -> Result<Stage, DemonstrationError> {
        let nodes = EncoderNodes::of(settings);
        let first_sample =
            self.recording.events.iter().find(|event| event.is_odometry()).and_then(|event| event.time());
        Ok(Stage {
            node,
            motion: EmulatedMotion::new(&self.recording, &nodes)?.standing(),
            gyro: EmulatedGyro::of(&self.recording, &settings.gyro_frame),
            receiver: NodeId::new(settings.nodes.controller).map(PoseReceiver::new),
            clock: Clock::new(1.0),
            shift: first_sample.map_or(0.0, |time| time.since(first)),
            has_begun: false,
        })
    }
}

/// Ends sensors and encoders when it goes.
struct End<'a>(&'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The encoders on the bus, as far as they have come.
struct Stage {
    node: InProcessNode,
    motion: EmulatedMotion,
    gyro: Option<EmulatedGyro>,
    receiver: Option<PoseReceiver>,
    clock: Clock,
    /// Time from the first turn of the laser to the first sample of the encoders, s.
    shift: f64,
    has_begun: bool,
}

impl Stage {
    fn play(&mut self, sensor: &Nav350, is_over: &AtomicBool) -> Result<(), BusError> {
        while !is_over.load(Ordering::Relaxed) {
            let now = self.clock.now();
            let mut frames = self.motion.poll(now);
            frames.extend(self.gyro.iter_mut().flat_map(|gyro| gyro.poll(now)));
            self.send(&frames)?;
            let Some(frame) = self.node.receive(Instant::now() + STEP)? else { continue };
            let Some(frame) = frame.classic() else { continue };
            let answers = self.motion.handle(frame);
            self.send(&answers)?;
            let pose = self.receiver.as_mut().and_then(|receiver| receiver.handle(frame));
            if !self.has_begun && pose.is_some_and(|pose| pose.mode.is_localised()) {
                self.begin(sensor);
            }
        }
        Ok(())
    }

    fn send(&mut self, frames: &[Frame]) -> Result<(), BusError> {
        frames.iter().try_for_each(|frame| self.node.send(&(*frame).into()))
    }

    /// Begins the drive, laser and encoders together.
    fn begin(&mut self, sensor: &Nav350) {
        self.has_begun = true;
        sensor.begin(Instant::now() + LEAD);
        let begin = self.clock.now().offset(LEAD.as_secs_f64() + self.shift);
        self.motion.begin(begin);
        if let Some(gyro) = &mut self.gyro {
            gyro.begin(begin);
        }
    }
}
