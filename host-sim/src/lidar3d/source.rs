//! Where packets come from: a capture, a sensor on the network, or range images.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use agv_lidar3d::packet::{PORT, STATUS_CYCLE, Sensor};

use super::bag_clouds;
use super::clouds;
use super::kind::Kind;
use super::live::Listener;
use super::live_clouds::LiveClouds;
use super::open_source::{OpenSource, Packets};
use super::setup::Setup;
use super::setup_options::SetupOptions;
use super::source_error::SourceError;
use super::survey::{Survey, SurveyError, Surveyor};
use crate::import::range_image::RangeImages;

/// Packets of a live sensor that are looked at before any is decoded, at least, and if it is one that may still send its
/// calibration.
const LOOK: usize = 100;
const LONG_LOOK: usize = 2 * STATUS_CYCLE;

/// Where packets come from.
#[derive(Clone, Debug)]
pub enum Source {
    /// A capture, pcap or pcapng.
    Capture(PathBuf),
    /// A UDP port of this machine.
    Live(u16),
    /// A folder of range images.
    Images(PathBuf),
    /// Point clouds, a scan each.
    Clouds(PathBuf, Vec<PathBuf>),
    /// Clouds in a recording of ROS 2, and their topic if it was named.
    Bag(PathBuf, Option<String>),
    /// Clouds of a running ROS 2: where its bridge is, and their topic if it was named.
    LiveClouds(String, Option<String>),
}

impl Source {
    /// `udp` or `udp:PORT` is the network, `ws://HOST[:PORT][#TOPIC]` a running ROS 2, a folder holds range images or point clouds, a name that ends in .pcd, .bin,
    /// .ply or .las is a point cloud, one that ends in .mcap or .db3 and a folder of rosbag2 is a recording of ROS 2, behind which
    /// `#TOPIC` may stand, and any other is a capture.
    ///
    /// # Errors
    /// If the port is no number.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.strip_prefix("udp") {
            Some("") => Ok(Self::Live(PORT)),
            Some(rest) if rest.starts_with(':') => {
                rest[1..].parse().map(Self::Live).map_err(|_| format!("'{}' is no port", &rest[1..]))
            }
            _ if text.starts_with(WEB_SOCKET) => live_clouds(text),
            _ if bag(text).is_some() => bag(text).ok_or_else(String::new),
            _ if Path::new(text).is_dir() => {
                let found = clouds::in_folder(Path::new(text));
                if found.is_empty() { Ok(Self::Images(text.into())) } else { Ok(Self::Clouds(text.into(), found)) }
            }
            _ if clouds::is_cloud(Path::new(text)) => Ok(Self::Clouds(text.into(), vec![text.into()])),
            _ => Ok(Self::Capture(text.into())),
        }
    }

    /// What people call it.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Capture(path) | Self::Images(path) | Self::Clouds(path, _) | Self::Bag(path, _) => {
                path.display().to_string()
            }
            Self::Live(port) => format!("UDP port {port}"),
            Self::LiveClouds(address, None) => format!("{WEB_SOCKET}{address}"),
            Self::LiveClouds(address, Some(topic)) => format!("{WEB_SOCKET}{address}#{topic}"),
        }
    }

    /// Whether it is a sensor that sends now, and does not wait.
    #[must_use]
    pub fn is_live(&self) -> bool {
        matches!(self, Self::Live(_) | Self::LiveClouds(..))
    }

    /// Looks at the source, as far as is needed to decode it; a live one is listened to until `stop` is set.
    ///
    /// # Errors
    /// See [`SourceError`].
    pub fn open(self, options: &SetupOptions, stop: &AtomicBool) -> Result<OpenSource, SourceError> {
        let (survey, setup, packets) = match self {
            Self::Capture(path) => opened_capture(path, options)?,
            Self::Images(path) => opened_images(&path)?,
            Self::Clouds(path, files) => opened_clouds(&path, files, options)?,
            Self::Bag(path, topic) => opened_bag(path, topic.as_deref(), options)?,
            Self::Live(port) => opened_port(port, options, stop)?,
            Self::LiveClouds(address, topic) => opened_live_clouds(&address, topic.as_deref(), options, stop)?,
        };
        Ok(OpenSource { options: options.clone(), setup, survey, packets })
    }
}

/// What a source says about itself, the sensor and its parameters if it states them, and where its packets come from.
type Opened = Result<(Survey, Option<Setup>, Packets), SourceError>;

fn opened_capture(path: PathBuf, options: &SetupOptions) -> Opened {
    let survey = Survey::of_capture(&path, options).map_err(|error| match error {
        SurveyError::Capture(error) => SourceError::Capture(error),
        SurveyError::Setup(error) => SourceError::Setup(error),
    })?;
    let packets =
        Packets::Capture { port: survey.port, address: survey.address, path, ouster: options.ouster()?.map(Box::new) };
    Ok((survey, None, packets))
}

fn opened_images(path: &Path) -> Opened {
    let images = RangeImages::open(path)?;
    let survey = Survey {
        kind: Some(Kind::Velodyne(Sensor::Hdl64e)),
        calibration: Some(images.calibration()),
        ..Survey::default()
    };
    Ok((survey, None, Packets::Images(images)))
}

fn opened_clouds(path: &Path, files: Vec<PathBuf>, options: &SetupOptions) -> Opened {
    let first = files.first().ok_or_else(|| SourceError::Cloud(format!("{}: no cloud", path.display())))?;
    let (_, lasers) = clouds::read(first).map_err(SourceError::Cloud)?;
    let account = clouds::account(first);
    let survey = Survey { kind: Some(Kind::Cloud), turns: files.len() as f64, account, ..Survey::default() };
    Ok((survey, Some(Setup::of_clouds(options, lasers)), Packets::Clouds(files)))
}

fn opened_bag(path: PathBuf, topic: Option<&str>, options: &SetupOptions) -> Opened {
    let (topic, count) = bag_clouds::topic(&path, topic).map_err(SourceError::Cloud)?;
    let mut first = None;
    let take = |_, lasers| {
        first = Some(lasers);
        ControlFlow::Break(())
    };
    bag_clouds::for_each(&path, &topic, take).map_err(SourceError::Cloud)?;
    let survey = Survey { kind: Some(Kind::Cloud), turns: count as f64, ..Survey::default() };
    let setup = Setup::of_clouds(options, first.unwrap_or_default());
    Ok((survey, Some(setup), Packets::Bag(path, topic, count)))
}

fn opened_live_clouds(address: &str, topic: Option<&str>, options: &SetupOptions, stop: &AtomicBool) -> Opened {
    let mut clouds = LiveClouds::subscribe(address, topic, stop).map_err(SourceError::Cloud)?;
    while !stop.load(Ordering::Relaxed) {
        if let Some((revolution, lasers)) = clouds.receive().map_err(SourceError::Cloud)? {
            let survey = Survey { kind: Some(Kind::Cloud), turns: f64::INFINITY, ..Survey::default() };
            let setup = Setup::of_clouds(options, lasers);
            return Ok((survey, Some(setup), Packets::LiveClouds(Box::new(clouds), revolution)));
        }
    }
    Err(SourceError::Cloud(format!("{}: no cloud came", clouds.name())))
}

fn opened_port(port: u16, options: &SetupOptions, stop: &AtomicBool) -> Opened {
    let network = |problem| SourceError::Network { port, problem };
    let ouster = options.ouster()?;
    let mut listener = Listener::new(port, ouster.clone()).map_err(network)?;
    let mut surveyor = Surveyor::default();
    let mut waiting = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        listener
            .receive(|time, datagram, bytes| {
                surveyor.datagram(time, datagram);
                waiting.push((time, bytes.to_vec()));
            })
            .map_err(network)?;
        let needs_calibration =
            options.calibration.is_none() && surveyor.kind() == Some(Kind::Velodyne(Sensor::Hdl64e));
        if waiting.len() >= (if needs_calibration { LONG_LOOK } else { LOOK }) {
            break;
        }
    }
    if waiting.is_empty() {
        return Err(SourceError::Silent { port });
    }
    let packets = Packets::Live { port, listener: Box::new(listener), waiting, ouster: ouster.map(Box::new) };
    Ok((surveyor.finish(), None, packets))
}

/// What an address of a running ROS begins with, and the port of its bridge if none is stated.
const WEB_SOCKET: &str = "ws://";
const BRIDGE_PORT: u16 = 8765;

/// `ws://HOST[:PORT][#TOPIC]`.
fn live_clouds(text: &str) -> Result<Source, String> {
    let rest = text.trim_start_matches(WEB_SOCKET);
    let (host, topic) = rest.split_once('#').map_or((rest, None), |(host, topic)| (host, Some(topic.to_owned())));
    let host = host.trim_end_matches('/');
    if host.is_empty() {
        return Err(format!("'{text}' names no machine: {WEB_SOCKET}HOST[:PORT][#TOPIC]"));
    }
    let has_port = host.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
    let address = if has_port { host.to_owned() } else { format!("{host}:{BRIDGE_PORT}") };
    Ok(Source::LiveClouds(address, topic))
}

/// A recording of ROS 2; None if the name is of something else.
fn bag(text: &str) -> Option<Source> {
    let (path, topic) = text.split_once('#').map_or((text, None), |(path, topic)| (path, Some(topic.to_owned())));
    let path = Path::new(path);
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let is_bag = matches!(ending.as_deref(), Some("mcap" | "db3")) || path.join("metadata.yaml").is_file();
    is_bag.then(|| Source::Bag(path.to_owned(), topic))
}
