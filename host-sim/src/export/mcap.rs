//! A drive as an MCAP file with messages of ROS 2, which Foxglove, Rerun, PlotJuggler and ROS 2 open.
//!
//! Frames: `map` is W, `base_link` is R, `laser` is S; `odom` is where the odometry began.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::integrity::{Alarm, AlertLimits};
use agv_core::localizer::{LandmarkUse, Mode, PoseOutput, Reason};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::{EncoderFault, EncoderFaults, GyroSample, PoseFix, Time};
use agv_core::odometry::{Motion, VehicleOdometer};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use serde::Serialize;

use crate::drive::{KINDS, kind_name, mode_name, reason_name};
use crate::log::{self, LogError, SOFTWARE};
use crate::output_file::OutputFile;
use crate::recording::{RecordedEvent, RecordedScan, Recording};
use crate::replay::Replay;
use crate::ros::messages::{
    Colour, DiagnosticStatus, Diagnostics, Header, Imu, KeyValue, LaserScan, Level, Marker, MarkerShape, Markers,
    Odometry, Pose as RosPose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, TransformStamped,
    Transforms, Twist, TwistWithCovariance, Vector, covariance,
};
use crate::ros::{ATTACHED_LOG, Kind, MessageError, attachment, definition, encode};

/// Why a drive cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum McapExportError {
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The container cannot be written.
    #[error("{}: {source}", path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: mcap::McapError,
    },
    /// The log cannot be attached.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A message is too large.
    #[error(transparent)]
    Message(#[from] MessageError),
}

/// A topic of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Topic {
    StaticTransforms,
    Transforms,
    Landmarks,
    Scan,
    Imu,
    Odometry,
    Pose,
    InitialPose,
    Observations,
    Diagnostics,
    Truth,
    Reference,
}

impl Topic {
    const ALL: [Self; 12] = [
        Self::StaticTransforms,
        Self::Transforms,
        Self::Landmarks,
        Self::Scan,
        Self::Imu,
        Self::Odometry,
        Self::Pose,
        Self::InitialPose,
        Self::Observations,
        Self::Diagnostics,
        Self::Truth,
        Self::Reference,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::StaticTransforms => "/tf_static",
            Self::Transforms => "/tf",
            Self::Landmarks => "/landmarks",
            Self::Scan => "/scan",
            Self::Imu => "/imu",
            Self::Odometry => "/odom",
            Self::Pose => "/pose",
            Self::InitialPose => "/initialpose",
            Self::Observations => "/observations",
            Self::Diagnostics => "/diagnostics",
            Self::Truth => "/truth",
            Self::Reference => "/reference",
        }
    }

    fn kind(self) -> Kind {
        match self {
            Self::StaticTransforms | Self::Transforms => Kind::Transforms,
            Self::Landmarks | Self::Observations => Kind::Markers,
            Self::Scan => Kind::LaserScan,
            Self::Imu => Kind::Imu,
            Self::Odometry => Kind::Odometry,
            Self::Pose | Self::InitialPose => Kind::PoseWithCovarianceStamped,
            Self::Diagnostics => Kind::Diagnostics,
            Self::Truth | Self::Reference => Kind::PoseStamped,
        }
    }

    /// Quality of service, empty for the usual one. What is said once must reach those who listen later.
    fn qualities(self) -> &'static str {
        if matches!(self, Self::StaticTransforms | Self::Landmarks) { KEPT } else { "" }
    }
}

/// Quality of service of what is kept for later listeners, as rosbag2 writes it.
const KEPT: &str = "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9223372036\n    \
                    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  \
                    liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  \
                    avoid_ros_namespace_conventions: false";

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct McapSummary {
    /// Number of messages of each topic that has any.
    pub messages: BTreeMap<&'static str, u64>,
    /// Whether the log is attached. One that is too long is not.
    pub has_log: bool,
}

/// What is said of a topic outside of the file.
pub(super) struct TopicDescription {
    pub(super) name: &'static str,
    pub(super) kind: &'static str,
    pub(super) qualities: &'static str,
}

/// All topics of a file.
pub(super) fn topics() -> impl Iterator<Item = TopicDescription> {
    Topic::ALL.into_iter().map(|topic| TopicDescription {
        name: topic.name(),
        kind: topic.kind().name(),
        qualities: topic.qualities(),
    })
}

/// Frames.
const MAP: &str = "map";
const ODOM: &str = "odom";
const BASE: &str = "base_link";
const LASER: &str = "laser";

/// Largest range of a scan, m: farther than any planar laser sees.
const LARGEST_RANGE: f32 = 250.0;

/// Time between two reports on the health of the vehicle where nothing changes, s.
const DIAGNOSTIC_INTERVAL: f64 = 1.0;

/// Writes a drive and what the localiser answered. `progress` is called with the number of events done.
///
/// # Errors
/// If the file cannot be written.
pub fn write(
    path: &Path,
    recording: &Recording,
    answers: &Replay,
    mut progress: Box<dyn FnMut(usize)>,
) -> Result<McapSummary, McapExportError> {
    let mut writer = Writer::create(path)?;
    let first = recording.events.iter().filter_map(RecordedEvent::time).min().unwrap_or_default();
    writer.write_statics(first, recording)?;
    let mut exporter = Exporter::new(recording, first);
    let mut truth = recording.truth.iter().peekable();
    let mut references = recording.references.iter().peekable();
    for (index, event) in recording.events.iter().enumerate() {
        exporter.advance(event);
        while let Some(next) = truth.next_if(|next| next.time <= exporter.now) {
            writer.write_pose(Topic::Truth, next.time, next.pose)?;
        }
        while let Some(next) = references.next_if(|next| next.time <= exporter.now) {
            writer.write_pose(Topic::Reference, next.time, Pose::new(next.x, next.y, next.heading.unwrap_or(0.0)))?;
        }
        exporter.write_event(&mut writer, event)?;
        if let Some(answer) = answers.output(index) {
            exporter.write_answer(&mut writer, &answer.pose, answer.uses)?;
        }
        if index % 1024 == 0 {
            progress(index);
        }
    }
    for next in truth {
        writer.write_pose(Topic::Truth, next.time, next.pose)?;
    }
    let has_log = writer.attach(recording)?;
    writer.finish(has_log)
}

/// The file.
struct Writer {
    path: PathBuf,
    container: mcap::Writer<OutputFile>,
    channels: BTreeMap<Topic, u16>,
    counts: BTreeMap<Topic, u64>,
}

impl Writer {
    fn create(path: &Path) -> Result<Self, McapExportError> {
        let file = OutputFile::create(path).map_err(|source| McapExportError::Io { path: path.to_owned(), source })?;
        let wrap = |source| McapExportError::Container { path: path.to_owned(), source };
        let options = WriteOptions::new().profile("ros2").library(SOFTWARE).compression(Some(Compression::Zstd));
        let mut container = options.create(file).map_err(wrap)?;
        let mut channels = BTreeMap::new();
        for topic in Topic::ALL {
            let kind = topic.kind();
            let schema = container.add_schema(kind.name(), "ros2msg", definition(kind).as_bytes()).map_err(wrap)?;
            let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), topic.qualities().to_owned())]);
            channels.insert(topic, container.add_channel(schema, topic.name(), "cdr", &metadata).map_err(wrap)?);
        }
        Ok(Self { path: path.to_owned(), container, channels, counts: BTreeMap::new() })
    }

    fn write(&mut self, topic: Topic, now: Time, message: &impl Serialize) -> Result<(), McapExportError> {
        let data = encode(message)?;
        let count = self.counts.entry(topic).or_default();
        let time = now.micros().saturating_mul(1000);
        let header = MessageHeader {
            channel_id: self.channels[&topic],
            sequence: *count as u32,
            log_time: time,
            publish_time: time,
        };
        *count += 1;
        let written = self.container.write_to_known_channel(&header, &data);
        written.map_err(|source| McapExportError::Container { path: self.path.clone(), source })
    }

    fn write_pose(&mut self, topic: Topic, time: Time, pose: Pose) -> Result<(), McapExportError> {
        self.write(topic, time, &PoseStamped { header: Header::new(time, MAP), pose: pose.into() })
    }

    /// What is true all the time: where the laser is, and the map.
    fn write_statics(&mut self, now: Time, recording: &Recording) -> Result<(), McapExportError> {
        let laser = transform(now, BASE, LASER, *recording.parameters.lasers.first());
        self.write(Topic::StaticTransforms, now, &Transforms { transforms: vec![laser] })?;
        let mut markers = Vec::new();
        for (number, kind) in (0..).zip(KINDS) {
            let of_kind = recording.landmarks.iter().filter(|landmark| landmark.kind == kind);
            let points: Vec<Vector> = of_kind.map(|landmark| Vector { x: landmark.x, y: landmark.y, z: 0.0 }).collect();
            if !points.is_empty() {
                markers.push(marker(
                    now,
                    kind_name(kind),
                    number,
                    shape(kind),
                    LANDMARK_COLOURS[number as usize],
                    points,
                ));
            }
        }
        self.write(Topic::Landmarks, now, &Markers { markers })
    }

    /// Attaches what the messages have no place for. False if it is too long.
    fn attach(&mut self, recording: &Recording) -> Result<bool, McapExportError> {
        let io = |source| McapExportError::Io { path: self.path.clone(), source };
        let folder = tempfile::tempdir().map_err(io)?;
        let log = folder.path().join(ATTACHED_LOG);
        log::write(&log, recording)?;
        let Some(attachment) = attachment(ATTACHED_LOG, std::fs::read(&log).map_err(io)?) else { return Ok(false) };
        let attached = self.container.attach(&attachment);
        attached.map_err(|source| McapExportError::Container { path: self.path.clone(), source })?;
        Ok(true)
    }

    fn finish(mut self, has_log: bool) -> Result<McapSummary, McapExportError> {
        let path = self.path;
        let container = self.container.finish();
        container.map_err(|source| McapExportError::Container { path: path.clone(), source })?;
        self.container.into_inner().finish().map_err(|source| McapExportError::Io { path, source })?;
        let messages = self.counts.into_iter().map(|(topic, count)| (topic.name(), count)).collect();
        Ok(McapSummary { messages, has_log })
    }
}

/// What is known on the way through a drive.
struct Exporter {
    odometer: VehicleOdometer,
    /// Integrated odometry.
    odometry: Pose,
    /// When the newest event arrived: the latest time that any event spoke of.
    now: Time,
    scan_start: Option<Time>,
    faults: EncoderFaults,
    diagnosed: Option<(Time, Mode, Reason, Alarm, EncoderFaults)>,
    limits: AlertLimits,
}

impl Exporter {
    fn new(recording: &Recording, now: Time) -> Self {
        let parameters = &recording.parameters;
        Self {
            odometer: VehicleOdometer::new(&parameters.vehicle, &parameters.odometer()),
            odometry: Pose::default(),
            now,
            scan_start: None,
            faults: EncoderFaults::default(),
            diagnosed: None,
            limits: parameters.alert_limits,
        }
    }

    fn advance(&mut self, event: &RecordedEvent) {
        let end = event.span().map(|(_, end)| end);
        self.now = end.map_or(self.now, |end| end.max(self.now));
    }

    fn write_event(&mut self, writer: &mut Writer, event: &RecordedEvent) -> Result<(), McapExportError> {
        let motion = match event {
            RecordedEvent::Encoders(sample) => self.odometer.encoders(sample).ok(),
            RecordedEvent::Speed(sample) => self.odometer.speed(sample).ok(),
            RecordedEvent::Increment(increment) => self.odometer.increment(increment).ok(),
            RecordedEvent::Wheels(sample) => self.odometer.wheels(sample).ok(),
            RecordedEvent::EncoderFaults(faults) => {
                self.odometer.restart();
                self.faults = *faults;
                None
            }
            RecordedEvent::Scan(scan) => return self.write_scan(writer, scan),
            RecordedEvent::SetPose(fix) => return writer.write(Topic::InitialPose, self.now, &initial_pose(fix)),
            RecordedEvent::Gyro(sample) => return writer.write(Topic::Imu, self.now, &imu(sample)),
            RecordedEvent::Reflectors(_) => None,
        };
        match motion {
            Some(motion) => self.write_odometry(writer, &motion),
            None => Ok(()),
        }
    }

    fn write_scan(&mut self, writer: &mut Writer, scan: &RecordedScan) -> Result<(), McapExportError> {
        let message = laser_scan(scan, self.scan_start);
        self.scan_start = Some(scan.start);
        writer.write(Topic::Scan, self.now, &message)
    }

    fn write_odometry(&mut self, writer: &mut Writer, motion: &Motion) -> Result<(), McapExportError> {
        self.odometry = self.odometry.compose(&motion.displacement);
        let interval = motion.end.since(motion.start);
        let twist = motion.displacement.log();
        let speed = |way: f64| if interval > 0.0 { way / interval } else { 0.0 };
        let twist = Twist {
            linear: Vector { x: speed(twist.x), y: speed(twist.y), z: 0.0 },
            angular: Vector { x: 0.0, y: 0.0, z: speed(twist.theta) },
        };
        let message = Odometry {
            header: Header::new(motion.end, ODOM),
            child_frame_id: BASE.to_owned(),
            pose: PoseWithCovariance { pose: self.odometry.into(), ..PoseWithCovariance::default() },
            twist: TwistWithCovariance { twist, ..TwistWithCovariance::default() },
        };
        writer.write(Topic::Odometry, self.now, &message)
    }

    fn write_answer(
        &mut self,
        writer: &mut Writer,
        output: &PoseOutput,
        uses: &[LandmarkUse],
    ) -> Result<(), McapExportError> {
        self.diagnose(writer, output)?;
        if output.mode == Mode::NotLocalised {
            return Ok(());
        }
        let pose = PoseWithCovariance { pose: output.pose.into(), covariance: covariance(output.covariance) };
        let stamped = PoseWithCovarianceStamped { header: Header::new(output.time, MAP), pose };
        writer.write(Topic::Pose, self.now, &stamped)?;
        // The vehicle in the map, by way of the odometry.
        let odometry_in_map = output.pose.compose(&self.odometry.inverse());
        let transforms =
            vec![transform(output.time, MAP, ODOM, odometry_in_map), transform(output.time, ODOM, BASE, self.odometry)];
        writer.write(Topic::Transforms, self.now, &Transforms { transforms })?;
        if uses.is_empty() {
            Ok(())
        } else {
            writer.write(Topic::Observations, self.now, &observations(self.now, uses))
        }
    }

    fn diagnose(&mut self, writer: &mut Writer, output: &PoseOutput) -> Result<(), McapExportError> {
        let alarm = self.limits.alarm(output.mode, &output.level);
        let state = (self.now, output.mode, output.reason, alarm, self.faults);
        let is_known = self.diagnosed.is_some_and(|(time, mode, reason, last, faults)| {
            (mode, reason, last) == (output.mode, output.reason, alarm)
                && (faults.drive, faults.steering) == (self.faults.drive, self.faults.steering)
                && self.now.since(time) < DIAGNOSTIC_INTERVAL
        });
        if is_known {
            return Ok(());
        }
        self.diagnosed = Some(state);
        writer.write(Topic::Diagnostics, self.now, &diagnostics(self.now, output, alarm, &self.faults))
    }
}

fn transform(time: Time, above: &str, below: &str, pose: Pose) -> TransformStamped {
    TransformStamped { header: Header::new(time, above), child_frame_id: below.to_owned(), transform: pose.into() }
}

/// A rate as it was told; what a gyro of one axis does not measure is marked as ROS does it.
fn imu(sample: &GyroSample) -> Imu {
    let mut unknown = [0.0; 9];
    unknown[0] = -1.0;
    Imu {
        header: Header::new(sample.time, BASE),
        orientation_covariance: unknown,
        angular_velocity: Vector { x: 0.0, y: 0.0, z: sample.rate },
        linear_acceleration_covariance: unknown,
        ..Imu::default()
    }
}

fn initial_pose(fix: &PoseFix) -> PoseWithCovarianceStamped {
    let [position, heading] = [fix.position_deviation, fix.heading_deviation].map(|deviation| deviation * deviation);
    PoseWithCovarianceStamped {
        header: Header::new(fix.time, MAP),
        pose: PoseWithCovariance {
            pose: RosPose::from(fix.pose),
            covariance: covariance([position, 0.0, position, 0.0, 0.0, heading]),
        },
    }
}

fn laser_scan(scan: &RecordedScan, before: Option<Time>) -> LaserScan {
    let beams = scan.ranges.len();
    let last = scan.first_bearing + beams.saturating_sub(1) as f64 * scan.bearing_step;
    // No return is infinitely far (REP 117).
    let is_return = |range: &f32| range.is_finite() && *range > 0.0;
    LaserScan {
        header: Header::new(scan.start, LASER),
        angle_min: scan.first_bearing as f32,
        angle_max: last as f32,
        angle_increment: scan.bearing_step as f32,
        time_increment: scan.beam_interval as f32,
        scan_time: before.map_or(0.0, |before| scan.start.since(before)) as f32,
        range_min: 0.0,
        range_max: LARGEST_RANGE,
        ranges: scan.ranges.iter().map(|range| if is_return(range) { *range } else { f32::INFINITY }).collect(),
        intensities: scan.intensities.iter().map(|strength| f32::from(*strength)).collect(),
    }
}

/// Colours that people with any common colour blindness tell apart; what differs differs in shape, too.
const BLUE: Colour = Colour { r: 0.0, g: 0.447, b: 0.698, a: 1.0 };
const VERMILION: Colour = Colour { r: 0.835, g: 0.369, b: 0.0, a: 1.0 };
const GREEN: Colour = Colour { r: 0.0, g: 0.62, b: 0.451, a: 1.0 };
const GREY: Colour = Colour { r: 0.5, g: 0.5, b: 0.5, a: 1.0 };

/// In the order of [`KINDS`].
const LANDMARK_COLOURS: [Colour; 3] = [BLUE, GREEN, GREY];

fn shape(kind: LandmarkKind) -> MarkerShape {
    if kind == LandmarkKind::Reflector { MarkerShape::Balls } else { MarkerShape::Cubes }
}

fn marker(now: Time, group: &str, id: i32, shape: MarkerShape, color: Colour, points: Vec<Vector>) -> Marker {
    Marker {
        header: Header::new(now, MAP),
        ns: group.to_owned(),
        id,
        r#type: shape as i32,
        scale: Vector { x: 0.1, y: 0.1, z: 0.1 },
        color,
        points,
        ..Marker::default()
    }
}

/// Where observations lie in the map: what corrected the pose, and what did not. A group without any is empty, which
/// takes away what was there before.
fn observations(now: Time, uses: &[LandmarkUse]) -> Markers {
    let points = |is_accepted: bool| {
        let wanted = uses.iter().filter(|one| (one.verdict == Verdict::Accepted) == is_accepted);
        wanted.map(|one| Vector { x: one.located[0], y: one.located[1], z: 0.0 }).collect()
    };
    Markers {
        markers: vec![
            marker(now, "used", 0, MarkerShape::Balls, BLUE, points(true)),
            marker(now, "not used", 1, MarkerShape::Cubes, VERMILION, points(false)),
        ],
    }
}

fn diagnostics(now: Time, output: &PoseOutput, alarm: Alarm, faults: &EncoderFaults) -> Diagnostics {
    let value = |key: &str, value: String| KeyValue { key: key.to_owned(), value };
    let level = match output.mode {
        Mode::Reflectors | Mode::Features | Mode::Mixed => Level::Ok,
        Mode::NotLocalised | Mode::DeadReckoning | Mode::Degraded => Level::Warning,
        Mode::WithoutOdometry | Mode::Lost => Level::Error,
    };
    let localisation = DiagnosticStatus {
        level: level as u8,
        name: "localisation".to_owned(),
        message: format!("{}: {}", mode_name(output.mode), reason_name(output.reason)),
        hardware_id: String::new(),
        values: vec![
            value("dead reckoning distance, m", output.dead_reckoning_distance.to_string()),
            value("protection level of the position, m", output.level.position.to_string()),
            value("protection level of the heading, rad", output.level.heading.to_string()),
            value("alarm", format!("{alarm:?}").to_lowercase()),
            value("acceptance", output.acceptance.to_string()),
            value("normalised square", output.normalised_square.to_string()),
        ],
    };
    let encoder = |name: &str, fault: Option<EncoderFault>| DiagnosticStatus {
        level: if fault.is_some() { Level::Error } else { Level::Ok } as u8,
        name: name.to_owned(),
        message: fault.map_or("sound".to_owned(), |fault| format!("{fault:?}").to_lowercase()),
        ..DiagnosticStatus::default()
    };
    let status = vec![
        localisation,
        encoder("encoder of the driving wheel", faults.drive),
        encoder("encoder of the steering", faults.steering),
    ];
    Diagnostics { header: Header::new(now, ""), status }
}
