//! Recordings of ROS 2 vehicles: a planar laser and integrated odometry.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::{LaserId, PoseFix, PoseIncrement, Time};
use agv_core::odometry::Vehicle;

use crate::recording::{RecordedEvent, RecordedScan, Recording};
use crate::ros::messages::{LaserScan, Odometry, PoseWithCovarianceStamped, Stamp, Transforms};
use crate::ros::{Bag, BagError, BagMessage, Kind, MessageError, decode};

/// What is taken from a recording that holds more.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Topic of the laser; the only one of its kind if None.
    pub scan: Option<String>,
    /// Topic of the odometry; the only one of its kind if None.
    pub odometry: Option<String>,
    /// Pose of the laser on the vehicle; what the recording states if None.
    pub laser: Option<Pose>,
}

/// Why there is no drive in a recording.
#[derive(Debug, thiserror::Error)]
pub enum RosImportError {
    /// It cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// There is no topic of that kind.
    #[error("{}: there is no topic of {kind} in the recording{}", path.display(), listed(found))]
    NoTopic {
        /// The recording.
        path: PathBuf,
        /// The kind.
        kind: &'static str,
        /// What there is.
        found: Vec<String>,
    },
    /// There are several, and one must be chosen.
    #[error("{}: there are several topics of {kind}: {}; choose one with {option}", path.display(), found.join(", "))]
    SeveralTopics {
        /// The recording.
        path: PathBuf,
        /// The kind.
        kind: &'static str,
        /// Their names.
        found: Vec<String>,
        /// How to choose.
        option: &'static str,
    },
    /// A message is damaged.
    #[error("{}: message {number} of {topic}: {source}", path.display())]
    Message {
        /// The recording.
        path: PathBuf,
        /// Topic of the message.
        topic: String,
        /// Number of the message in the recording, from 1.
        number: usize,
        /// What is wrong with it.
        source: MessageError,
    },
    /// Nobody says where the laser is.
    #[error("{}: no transform leads from {base} to {laser}; state where the laser is with --laser X,Y,HEADING", path.display())]
    NoLaserPose {
        /// The recording.
        path: PathBuf,
        /// Frame of the vehicle.
        base: String,
        /// Frame of the laser.
        laser: String,
    },
}

fn listed(topics: &[String]) -> String {
    if topics.is_empty() { String::new() } else { format!(", which has {}", topics.join(", ")) }
}

/// A message that matters, in the order of its arrival.
enum Heard {
    Scan(LaserScan),
    Odometry(Box<Odometry>),
    InitialPose(Box<PoseWithCovarianceStamped>),
}

impl Heard {
    fn stamp(&self) -> Stamp {
        match self {
            Self::Scan(message) => message.header.stamp,
            Self::Odometry(message) => message.header.stamp,
            Self::InitialPose(message) => message.header.stamp,
        }
    }
}

/// Topic of poses that an operator gives.
const INITIAL_POSE: &str = "/initialpose";

/// Reads the drive of a vehicle that reports increments of its pose. Times count from the earliest stamp.
///
/// # Errors
/// If the recording cannot be read, or does not hold one laser and one odometry.
pub fn read(path: &Path, choice: &Choice) -> Result<Recording, RosImportError> {
    let bag = Bag::open(path)?;
    let (scan_topic, odometry_topic) = topics(path, &bag, choice)?;
    let (mut heard, transforms) = messages(path, &bag, &scan_topic, &odometry_topic)?;
    // Recorders store messages as they come, but not always one topic in the order of the other.
    heard.sort_by_key(|(time, _)| *time);
    let first = heard.iter().map(|(_, message)| message.stamp().nanoseconds()).min().unwrap_or_default();
    let clock = |stamp: Stamp| Time::from_micros(((stamp.nanoseconds() - first).max(0).unsigned_abs() + 500) / 1000);
    let laser = match choice.laser {
        Some(stated) => stated,
        None => laser_pose(path, &heard, &transforms)?,
    };
    let mut before: Option<Pose> = None;
    let events = heard.iter().map(|(_, message)| match message {
        Heard::Scan(message) => RecordedEvent::Scan(scan(clock(message.header.stamp), message)),
        Heard::Odometry(message) => {
            let pose = message.pose.pose.planar();
            let displacement = before.replace(pose).map_or(Pose::default(), |before| before.between(&pose));
            RecordedEvent::Increment(PoseIncrement { time: clock(message.header.stamp), displacement })
        }
        Heard::InitialPose(message) => RecordedEvent::SetPose(fix(clock(message.header.stamp), message)),
    });
    Ok(Recording {
        events: events.collect(),
        parameters: Parameters::new(Vehicle::Increments, laser),
        landmarks: Vec::new(),
        truth: Vec::new(),
        references: Vec::new(),
    })
}

/// The topics of the laser and of the odometry.
fn topics(path: &Path, bag: &Bag, choice: &Choice) -> Result<(String, String), RosImportError> {
    let mut all: BTreeMap<String, String> = BTreeMap::new();
    bag.read(|message| {
        if !all.contains_key(message.topic) {
            all.insert(message.topic.to_owned(), message.kind.to_owned());
        }
    })?;
    let one_of = |kind: Kind, stated: &Option<String>, option| {
        let kind = kind.name();
        let of_kind: Vec<String> =
            all.iter().filter(|(_, found)| *found == kind).map(|(name, _)| name.clone()).collect();
        let wanted: Vec<&String> =
            of_kind.iter().filter(|name| stated.as_ref().is_none_or(|stated| *name == stated)).collect();
        match wanted[..] {
            [name] => Ok(name.clone()),
            [] => {
                let found = all.iter().map(|(name, kind)| format!("{name} ({kind})")).collect();
                Err(RosImportError::NoTopic { path: path.to_owned(), kind, found })
            }
            _ => Err(RosImportError::SeveralTopics { path: path.to_owned(), kind, found: of_kind, option }),
        }
    };
    Ok((
        one_of(Kind::LaserScan, &choice.scan, "--scan-topic")?,
        one_of(Kind::Odometry, &choice.odometry, "--odometry-topic")?,
    ))
}

/// Messages with the times of their arrival, ns.
type Messages = Vec<(u64, Heard)>;

fn messages(path: &Path, bag: &Bag, scan: &str, odometry: &str) -> Result<(Messages, Transforms), RosImportError> {
    let (mut heard, mut transforms) = (Messages::new(), Transforms::default());
    let mut problem = None;
    let mut number = 0;
    bag.read(|message| {
        number += 1;
        let BagMessage { topic, kind, time, data } = *message;
        let taken = if topic == scan {
            decode(data).map(|message| heard.push((time, Heard::Scan(message))))
        } else if topic == odometry {
            decode(data).map(|message| heard.push((time, Heard::Odometry(Box::new(message)))))
        } else if topic == INITIAL_POSE && kind == Kind::PoseWithCovarianceStamped.name() {
            decode(data).map(|message| heard.push((time, Heard::InitialPose(Box::new(message)))))
        } else if topic == "/tf_static" && kind == Kind::Transforms.name() {
            decode(data).map(|message: Transforms| transforms.transforms.extend(message.transforms))
        } else {
            Ok(())
        };
        if let Err(source) = taken {
            let topic = topic.to_owned();
            problem.get_or_insert(RosImportError::Message { path: path.to_owned(), topic, number, source });
        }
    })?;
    problem.map_or(Ok((heard, transforms)), Err)
}

/// Longest chain of transforms that is followed.
const CHAIN: usize = 32;

/// Where the laser is on the vehicle, by the transforms that never change.
fn laser_pose(path: &Path, heard: &Messages, transforms: &Transforms) -> Result<Pose, RosImportError> {
    let plain = |frame: &str| frame.trim_start_matches('/').to_owned();
    let laser = heard.iter().find_map(|(_, message)| match message {
        Heard::Scan(scan) => Some(plain(&scan.header.frame_id)),
        _ => None,
    });
    let base = heard.iter().find_map(|(_, message)| match message {
        Heard::Odometry(odometry) => Some(plain(&odometry.child_frame_id)),
        _ => None,
    });
    let (laser, base) = (laser.unwrap_or_default(), base.unwrap_or_default());
    let (mut pose, mut frame) = (Pose::default(), laser.clone());
    for _ in 0..CHAIN {
        if frame == base {
            return Ok(pose);
        }
        let Some(step) = transforms.transforms.iter().find(|step| plain(&step.child_frame_id) == frame) else { break };
        pose = step.transform.planar().compose(&pose);
        frame = plain(&step.header.frame_id);
    }
    Err(RosImportError::NoLaserPose { path: path.to_owned(), base, laser })
}

fn scan(start: Time, message: &LaserScan) -> RecordedScan {
    let limits = message.range_min..=message.range_max;
    let strength = |value: &f32| value.round().clamp(0.0, f32::from(u16::MAX)) as u16;
    // A list of another length belongs to other beams.
    let has_strengths = message.intensities.len() == message.ranges.len();
    RecordedScan {
        laser: LaserId::FIRST,
        start,
        beam_interval: f64::from(message.time_increment.max(0.0)),
        first_bearing: message.angle_min.into(),
        bearing_step: message.angle_increment.into(),
        ranges: message.ranges.iter().map(|range| if limits.contains(range) { *range } else { 0.0 }).collect(),
        intensities: if has_strengths { message.intensities.iter().map(strength).collect() } else { Vec::new() },
    }
}

fn fix(time: Time, message: &PoseWithCovarianceStamped) -> PoseFix {
    let covariance = &message.pose.covariance;
    PoseFix {
        time,
        pose: message.pose.pose.planar(),
        position_deviation: covariance[0][0].max(covariance[1][1]).max(0.0).sqrt(),
        heading_deviation: covariance[5][5].max(0.0).sqrt(),
    }
}
