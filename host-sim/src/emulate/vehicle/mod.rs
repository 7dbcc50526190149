//! A whole vehicle in emulation: the firmware on its board, with a NAV350 and encoders that see a simulated drive.
//!
//! The vehicle stands until the controller is told where it is and localises; then it drives. What the controller says on
//! its bus is kept, and held against the truth afterwards: the firmware never sees that.

mod chip;
mod error;
mod line_watch;
mod network;
mod pose_errors;
mod stage;
mod watch;

use std::net::{Ipv4Addr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use agv_settings::Settings;
use agv_settings::store::KEY;
use agv_wire::can::canopen::NodeId;
use agv_wire::nav350::SensorFrame;

pub use chip::{InChip, InChipOptions, drive_in_chip};
pub use error::VehicleError;
pub use line_watch::LineDelay;
pub use pose_errors::{Errors, errors};
pub use watch::{BusTrouble, HeardEmergency, HeardPose, Watch};

use super::board::{self, Board};
use crate::contour_map::ContourMap;
use crate::live::relay::Relay;
use crate::live::stream::StreamSummary;
use crate::provision::{contour_image, flash_image};
use crate::recording::Recording;
use crate::serve::nav350::{Drive, Nav350, Options};
use stage::Stage;
use watch::Heard;

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
    /// Its map of contours, if it has one; written if the flash begins with settings.
    pub contours: Option<&'a ContourMap>,
    /// Whether the controller is told where it is when it starts. If not, or if the recording has no truth, it has to find out.
    pub is_told: bool,
}

impl<'a> VehicleOptions<'a> {
    /// A vehicle whose flash begins with settings but no key, and which is told where it is.
    #[must_use]
    pub const fn new(image: &'a Path, folder: &'a Path) -> Self {
        Self { image, folder, key: None, provision: true, contours: None, is_told: true }
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
    /// Longest time that this machine kept a thread of the emulator waiting for a core within a fiftieth of a second, s. Not known, and 0,
    /// where the machine does not run Linux.
    pub longest_delay: f64,
    /// What waited on the board's line while the vehicle drove. Not known, and empty, of a chip.
    pub line_delays: Vec<LineDelay>,
    /// Longest time by which this machine sent what the laser saw later than it was due, s. A laser that says nothing for 200 ms is
    /// silent.
    pub longest_laser_delay: f64,
}

/// The settings of a vehicle that is as the recording says, in the emulator's network.
#[must_use]
pub fn settings_like(recording: &Recording, laser_port: u16) -> Settings {
    let mut settings = Settings::of(recording.parameters);
    settings.network.address = board::ADDRESS;
    settings.network.gateway = board::HOST;
    settings.network.laser = board::HOST;
    settings.network.laser_port = laser_port;
    // It is told on the bus where it starts.
    settings.nodes.accepts_pose = true;
    settings
}

/// The controller and its encoders.
fn own_nodes(settings: &Settings) -> Vec<NodeId> {
    let encoders = settings.nodes.encoders.iter().map(|encoder| encoder.node);
    encoders.chain([settings.nodes.controller]).filter_map(NodeId::new).collect()
}

/// Writes the flash of a vehicle that is set up so into a folder, and says where.
fn write_flash(
    folder: &Path,
    settings: &Settings,
    landmarks: &[Landmark],
    key: Option<&[u8; KEY]>,
) -> Result<PathBuf, VehicleError> {
    let path = folder.join("flash.bin");
    std::fs::write(&path, flash_image(settings, landmarks, key)?)?;
    Ok(path)
}

/// Writes the flash of the map of contours into a folder, and says where. Without a map there is none.
fn write_contours(folder: &Path, map: Option<&ContourMap>) -> Result<Option<PathBuf>, VehicleError> {
    let path = folder.join("contours.bin");
    let Some(map) = map else {
        return match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error.into()),
            _ => Ok(None),
        };
    };
    std::fs::write(&path, contour_image(map)?)?;
    Ok(Some(path))
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
        write_flash(options.folder, &settings, &recording.landmarks, options.key.as_ref())?;
        write_contours(options.folder, options.contours)?;
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
    let relay = Relay::bind()?;
    let stream_port = relay.port()?;
    let (outcome, stream) = std::thread::scope(|scope| {
        scope.spawn(|| network::serve_laser(&sensor, &listener, &is_laser_on, &stopped));
        scope.spawn(|| relay.serve(&stopped));
        let stream = scope.spawn(|| network::record(ports.log, &log, &stopped, &is_streaming, &relay));
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
    let Heard { poses, emergencies, begin, longest_stall, longest_delay, line_delays } =
        heard.into_inner().unwrap_or_else(PoisonError::into_inner);
    let begin = begin.ok_or(VehicleError::NotLocalised(poses.last().map(|heard| heard.pose.mode)))?;
    let longest_laser_delay = sensor.longest_delay();
    Ok(Driven {
        log,
        stream,
        poses,
        emergencies,
        begin,
        first,
        longest_stall,
        longest_delay,
        line_delays,
        longest_laser_delay,
    })
}
