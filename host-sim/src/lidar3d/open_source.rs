//! A source that has been looked at: its revolutions, one after the other.

use std::net::IpAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use agv_core::measurement::Time;
use agv_lidar3d::packet::{Packet, Tally, ouster};

use super::bag_clouds;
use super::capture::{self, Wanted};
use super::clouds;
use super::kind::Datagram;
use super::live::Listener;
use super::live_clouds::LiveClouds;
use super::revolution::{Revolution, Revolutions};
use super::setup::Setup;
use super::setup_options::{SetupError, SetupOptions};
use super::source_error::SourceError;
use super::survey::Survey;
use crate::import::range_image::RangeImages;

/// Time between two range images, us: the sensor turned ten times a second.
const IMAGE_INTERVAL: u64 = 100_000;

/// Where the packets of a source come from.
pub(super) enum Packets {
    Capture {
        path: PathBuf,
        port: Option<u16>,
        address: Option<IpAddr>,
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
    pub(super) options: SetupOptions,
    /// The sensor and its parameters, if the source states them.
    pub(super) setup: Option<Setup>,
    /// What it says about itself.
    pub survey: Survey,
    pub(super) packets: Packets,
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
            Self::Capture { path, port, address, ouster } => {
                let wanted = Wanted { port: *port, address: *address, ouster: ouster.as_deref() };
                capture::for_each_until(path, wanted, push)?;
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
