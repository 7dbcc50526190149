//! Where packets come from: a capture, a sensor on the network, or range images.

use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use agv_core::measurement::Time;
use agv_lidar3d::packet::{PORT, Packet, STATUS_CYCLE, Sensor, Tally, ouster};

use super::bag_clouds;
use super::capture::{self, CaptureError};
use super::clouds;
use super::kind::{Datagram, Kind};
use super::live::Listener;
use super::live_clouds::LiveClouds;
use super::revolution::{Revolution, Revolutions};
use super::setup::Setup;
use super::setup_options::{SetupError, SetupOptions};
use super::survey::{Survey, SurveyError, Surveyor};
use crate::import::range_image::{RangeImageError, RangeImages};

/// Time between two range images, us: the sensor turned ten times a second.
const IMAGE_INTERVAL: u64 = 100_000;
/// Packets of a live sensor that are looked at before any is decoded, at least, and if it is one that may still send its
/// calibration.
const LOOK: usize = 100;
const LONG_LOOK: usize = 2 * STATUS_CYCLE;

/// Why there are no points.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The capture.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The range images.
    #[error(transparent)]
    Images(#[from] RangeImageError),
    /// The sensor or its calibration.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A point cloud.
    #[error("{0}")]
    Cloud(String),
    /// The network.
    #[error("UDP port {port}: {problem}")]
    Network {
        /// The port.
        port: u16,
        /// What the operating system says.
        problem: io::Error,
    },
    /// Nothing was received.
    #[error("nothing was received on UDP port {port}")]
    Silent {
        /// The port.
        port: u16,
    },
    /// No return of any packet is a point.
    #[error("{name}: nothing was seen: {detail}")]
    Blind {
        /// The source.
        name: String,
        /// What became of the returns.
        detail: String,
    },
}

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
    let packets = Packets::Capture { port: survey.port, path, ouster: options.ouster()?.map(Box::new) };
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
    let survey = Survey { kind: Some(Kind::Cloud), turns: files.len() as f64, ..Survey::default() };
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

enum Packets {
    Capture {
        path: PathBuf,
        port: Option<u16>,
        ouster: Option<Box<ouster::Sensor>>,
    },
    Images(RangeImages),
    Clouds(Vec<PathBuf>),
    Bag(PathBuf, String, usize),
    /// And the first cloud, which has been looked at.
    LiveClouds(Box<LiveClouds>, Revolution),
    Live {
        port: u16,
        listener: Box<Listener>,
        waiting: Vec<(Time, Vec<u8>)>,
        ouster: Option<Box<ouster::Sensor>>,
    },
}

/// A source that has been looked at.
pub struct OpenSource {
    options: SetupOptions,
    setup: Option<Setup>,
    /// What it says about itself.
    pub survey: Survey,
    packets: Packets,
}

impl OpenSource {
    /// The sensor and its parameters.
    ///
    /// # Errors
    /// See [`SetupError`].
    pub fn setup(&self) -> Result<Setup, SetupError> {
        match &self.setup {
            Some(setup) => Ok(setup.clone()),
            None => Setup::new(&self.options, &self.survey),
        }
    }

    /// When the time of a live source began; None of a recording.
    #[must_use]
    pub fn began(&self) -> Option<Instant> {
        match &self.packets {
            Packets::Live { listener, .. } => Some(listener.start()),
            _ => None,
        }
    }

    /// Decodes with other parameters than those that were stated.
    pub fn decode_with(&mut self, setup: Setup) {
        self.setup = Some(setup);
    }

    /// How many revolutions there will be, if that is known.
    #[must_use]
    pub fn length(&self) -> Option<u64> {
        match &self.packets {
            Packets::Capture { .. } => Some(self.survey.turns.ceil() as u64),
            Packets::Images(images) => Some(images.files.len() as u64),
            Packets::Clouds(files) => Some(files.len() as u64),
            Packets::Bag(_, _, count) => Some(*count as u64),
            Packets::Live { .. } | Packets::LiveClouds(..) => None,
        }
    }

    /// Calls `take` with each revolution until it breaks off, the source ends or `stop` is set. The first and the last
    /// revolution of a stream may be parts of one. Returns what became of the returns.
    ///
    /// # Errors
    /// See [`SourceError`]; [`SourceError::Blind`] if there was no point at all.
    pub fn revolutions(
        mut self,
        stop: &AtomicBool,
        mut take: impl FnMut(Revolution) -> ControlFlow<()>,
    ) -> Result<Tally, SourceError> {
        let setup = self.setup()?;
        if let Packets::LiveClouds(clouds, first) = self.packets {
            return live_revolutions(*clouds, first, &setup, stop, take);
        }
        match &self.packets {
            Packets::Clouds(files) => return cloud_revolutions(files, &setup, stop, take),
            Packets::Bag(path, topic, _) => return bag_revolutions(path, topic, &setup, stop, take),
            _ => {}
        }
        let mut revolutions = Revolutions::new(&setup);
        if let Packets::Images(images) = &self.packets {
            revolutions.begin_at(images.first_azimuth());
        }
        let mut flow = ControlFlow::Continue(());
        let push = |time: Time, datagram: &Datagram<'_>| {
            revolutions.datagram(time, datagram, |revolution| {
                if flow.is_continue() {
                    flow = take(revolution);
                }
            });
            if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { flow }
        };
        let name = self.packets.for_each(stop, push)?;
        let (last, tally) = revolutions.finish();
        if let (Some(mut last), ControlFlow::Continue(())) = (last, flow) {
            last.is_whole = matches!(self.packets, Packets::Images(_));
            let _ = take(last);
        }
        if tally.points == 0 {
            let detail = format!(
                "{} returns are empty, {} too near, {} too far, {} of lasers that are not in use",
                tally.empty, tally.near, tally.far, tally.unused
            );
            return Err(SourceError::Blind { name, detail });
        }
        Ok(tally)
    }
}

impl Packets {
    /// Hands over each datagram until `push` breaks off, the source ends or `stop` is set. Returns what people call the source.
    fn for_each(
        &mut self,
        stop: &AtomicBool,
        mut push: impl FnMut(Time, &Datagram<'_>) -> ControlFlow<()>,
    ) -> Result<String, SourceError> {
        match self {
            Self::Capture { path, port, ouster } => {
                capture::for_each_until(path, *port, ouster.as_deref(), push)?;
                Ok(path.display().to_string())
            }
            Self::Images(images) => {
                image_packets(images, push)?;
                Ok("the range images".to_owned())
            }
            Self::Clouds(_) | Self::Bag(..) | Self::LiveClouds(..) => Ok(String::new()),
            Self::Live { port, listener, waiting, ouster } => {
                let port_now = listener.port();
                let mut is_going = waiting.drain(..).try_for_each(|(time, bytes)| {
                    match Datagram::recognise(&bytes, port_now, ouster.as_deref()) {
                        Ok(Some(datagram)) => push(time, &datagram),
                        Ok(None) | Err(_) => ControlFlow::Continue(()),
                    }
                });
                while is_going.is_continue() && !stop.load(Ordering::Relaxed) {
                    listener
                        .receive(|time, datagram, _| is_going = push(time, datagram))
                        .map_err(|problem| SourceError::Network { port: *port, problem })?;
                }
                Ok(format!("UDP port {port}"))
            }
        }
    }
}

/// The packets that a sensor would have sent for each image.
fn image_packets(
    images: &RangeImages,
    mut push: impl FnMut(Time, &Datagram<'_>) -> ControlFlow<()>,
) -> Result<(), SourceError> {
    for index in 0..images.files.len() {
        let time = Time::from_micros(index as u64 * IMAGE_INTERVAL);
        let counts = images.counts(index)?;
        let flow = images.packets(&counts).iter().try_for_each(|bytes| match Packet::new(bytes) {
            Ok(packet) => push(time, &Datagram::Velodyne(packet)),
            Err(_) => ControlFlow::Continue(()),
        });
        if flow.is_break() {
            break;
        }
    }
    Ok(())
}

/// Each cloud of a topic as a revolution.
fn bag_revolutions(
    path: &Path,
    topic: &str,
    setup: &Setup,
    stop: &AtomicBool,
    mut take: impl FnMut(Revolution) -> ControlFlow<()>,
) -> Result<Tally, SourceError> {
    let mut tally = Tally::default();
    let each = |mut revolution: Revolution, _| {
        filtered(&mut revolution, setup, &mut tally);
        let flow = take(revolution);
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { flow }
    };
    bag_clouds::for_each(path, topic, each).map_err(SourceError::Cloud)?;
    Ok(tally)
}

/// Each cloud that comes as a revolution, until `stop` is set.
fn live_revolutions(
    mut clouds: LiveClouds,
    first: Revolution,
    setup: &Setup,
    stop: &AtomicBool,
    mut take: impl FnMut(Revolution) -> ControlFlow<()>,
) -> Result<Tally, SourceError> {
    let mut tally = Tally::default();
    let mut next = Some(first);
    while !stop.load(Ordering::Relaxed) {
        if let Some(mut revolution) = next {
            filtered(&mut revolution, setup, &mut tally);
            if take(revolution).is_break() {
                break;
            }
        }
        next = clouds.receive().map_err(SourceError::Cloud)?.map(|(revolution, _)| revolution);
    }
    Ok(tally)
}

/// Each file as a revolution.
fn cloud_revolutions(
    files: &[PathBuf],
    setup: &Setup,
    stop: &AtomicBool,
    mut take: impl FnMut(Revolution) -> ControlFlow<()>,
) -> Result<Tally, SourceError> {
    let mut tally = Tally::default();
    for (number, path) in files.iter().enumerate() {
        let (mut revolution, _) = clouds::read(path).map_err(SourceError::Cloud)?;
        revolution.start = Time::from_micros(number as u64 * IMAGE_INTERVAL);
        filtered(&mut revolution, setup, &mut tally);
        if take(revolution).is_break() || stop.load(Ordering::Relaxed) {
            break;
        }
    }
    Ok(tally)
}

/// Leaves out what is too near or too far.
fn filtered(revolution: &mut Revolution, setup: &Setup, tally: &mut Tally) {
    let range = |[x, y, z]: [f32; 3]| (x * x + y * y + z * z).sqrt();
    let all = revolution.points.len();
    revolution.points.retain(|point| range(point.position) >= setup.filter.near);
    tally.near += (all - revolution.points.len()) as u64;
    let far = revolution.points.len();
    revolution.points.retain(|point| range(point.position) <= setup.filter.far);
    tally.far += (far - revolution.points.len()) as u64;
    tally.points += revolution.points.len() as u64;
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
