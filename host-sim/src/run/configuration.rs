//! What the machine is told about a controller that runs on it. What the vehicle is told is in the store.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Deserialize;

use super::discrete::DiscreteConfiguration;
use super::gyro::GyroConfiguration;
use super::log_ring::RingOptions;
use super::real_time::RealTime;
use crate::text_file::{self, TextFileError};

/// A file of it.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Configuration {
    /// Folder with settings, key and maps: `flash.bin` and `contours.bin`, as `agv provision` writes them.
    pub store: PathBuf,
    /// The CAN bus: `can0`, `slcan:/dev/ttyACM0@500000` or `slcan-tcp:HOST:PORT`.
    pub bus: String,
    /// Address of this machine at which log stream and service port listen, at the ports of the settings.
    #[serde(default = "everywhere")]
    pub listen: IpAddr,
    /// Priorities, cores and memory.
    #[serde(default = "usual")]
    pub real_time: RealTime,
    /// Its discrete lines.
    #[serde(default)]
    pub discrete: DiscreteConfiguration,
    /// Its own gyro.
    #[serde(default)]
    pub gyro: GyroConfiguration,
    /// Who is told each pose.
    #[serde(default)]
    pub pose: PoseConfiguration,
    /// Where state and figures are shown.
    #[serde(default)]
    pub status: StatusConfiguration,
    /// What is kept of what happens; nothing if it is absent.
    pub recording: Option<RecordingConfiguration>,
}

/// What is kept of what happens: the last minutes, and incidents.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingConfiguration {
    /// Folder of both.
    pub folder: PathBuf,
    /// Time that is kept, min.
    #[serde(default = "usual_minutes")]
    pub minutes: u32,
    /// Most that it may take of the disk, MiB.
    #[serde(default = "usual_size")]
    pub ring_mib: u32,
    /// Most that all incidents together may take of it, MiB.
    #[serde(default = "usual_size")]
    pub incidents_mib: u32,
}

impl RecordingConfiguration {
    /// As a run takes it.
    #[must_use]
    pub fn options(&self) -> RingOptions {
        RingOptions {
            span: Duration::from_secs(60 * u64::from(self.minutes)),
            ring_bytes: u64::from(self.ring_mib) << 20,
            incident_bytes: u64::from(self.incidents_mib) << 20,
            ..RingOptions::usual(self.folder.clone())
        }
    }
}

/// Who is told each pose.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseConfiguration {
    /// A socket of Unix at which it is told, as lines of JSON.
    pub unix: Option<PathBuf>,
    /// Addresses to which it is sent, a line of JSON a datagram.
    pub udp: Vec<SocketAddr>,
}

/// Where state and figures are shown.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StatusConfiguration {
    /// Address and port.
    pub listen: SocketAddr,
}

impl Default for StatusConfiguration {
    /// On loopback only.
    fn default() -> Self {
        Self { listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 8051)) }
    }
}

const fn everywhere() -> IpAddr {
    IpAddr::V4(Ipv4Addr::UNSPECIFIED)
}

const fn usual_minutes() -> u32 {
    10
}

const fn usual_size() -> u32 {
    512
}

const fn usual() -> RealTime {
    RealTime::USUAL
}

/// Why a configuration cannot be used.
pub type ConfigurationError = TextFileError;

/// Greatest priority of SCHED_FIFO on Linux.
const GREATEST_PRIORITY: u8 = 99;

impl Configuration {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, has an unknown name, or a value that cannot be.
    pub fn read(path: &Path) -> Result<Self, ConfigurationError> {
        let text = text_file::read(path, "a configuration of agv run")?;
        let configuration: Self = toml::from_str(&text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            TextFileError::of_line(path, before.matches('\n').count() + 1, error.message().replace('\n', ", "))
        })?;
        let line_of =
            |name: &str| text.lines().position(|line| line.trim_start().starts_with(name)).map_or(1, |line| line + 1);
        let RealTime { bus_priority, laser_priority, localizer_priority, .. } = configuration.real_time;
        let priorities = [
            ("bus_priority", bus_priority),
            ("laser_priority", laser_priority),
            ("localizer_priority", localizer_priority),
        ];
        let is_wrong = |priority: Option<u8>| priority.is_some_and(|number| !(1..=GREATEST_PRIORITY).contains(&number));
        if let Some((name, _)) = priorities.into_iter().find(|(_, priority)| is_wrong(*priority)) {
            return Err(TextFileError::of_line(
                path,
                line_of(name),
                format!("{name} must be from 1 to {GREATEST_PRIORITY}"),
            ));
        }
        if let Some((name, problem)) = configuration.discrete.problem().or_else(|| configuration.gyro.problem()) {
            return Err(TextFileError::of_line(path, line_of(name), problem));
        }
        Ok(configuration)
    }
}
