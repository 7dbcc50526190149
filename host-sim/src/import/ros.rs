//! Recordings of ROS 2 vehicles: a planar laser and integrated odometry.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::{GyroSample, LaserId, PoseFix, PoseIncrement, Time};
use agv_core::odometry::{GyroParameters, Vehicle};

use super::mounting::{self, Mounting, MountingError, plain};
use crate::recording::{RecordedEvent, RecordedScan, Recording};
use crate::ros::messages::{Imu, LaserScan, Odometry, PoseWithCovarianceStamped, Stamp, Transforms};
use crate::ros::{Bag, BagError, BagMessage, Kind, MessageError, decode};

/// What is taken from a recording that holds more.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Topic of the laser; the only one of its kind if None.
    pub scan: Option<String>,
    /// Topic of the odometry; the only one of its kind if None.
    pub odometry: Option<String>,
    /// Topic of the gyro; the only one of its kind, if there is one, if None.
    pub imu: Option<String>,
    /// Pose of the laser on the vehicle; what the recording states if None. Whether it hangs upside down, the recording says.
    pub laser: Option<Pose>,
}

/// Why there is no drive in a recording.
#[derive(Debug, thiserror::Error)]
pub enum RosImportError {
    /// It cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// There is no topic of that name and kind.
    #[error("{}: there is no topic {name} of {kind} in the recording; {option} can be {}", path.display(), found.join(", "))]
    OtherTopics {
        /// The recording.
        path: PathBuf,
        /// The kind.
        kind: &'static str,
        /// What was asked for.
        name: String,
        /// How to choose.
        option: &'static str,
        /// What there is of that kind.
        found: Vec<String>,
    },
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
    /// The laser does not look along the ground.
    #[error("{}: the laser {laser} is tilted by {degrees:.0} deg; only lasers that look along the ground can be used", path.display())]
    Tilted {
        /// The recording.
        path: PathBuf,
        /// Frame of the laser.
        laser: String,
        /// Angle between its plane and the ground.
        degrees: f64,
    },
    /// The gyro has no axis that points up or down.
    #[error("{}: no axis z of the gyro {gyro} points up or down, it is off by {degrees:.0} deg", path.display())]
    TiltedGyro {
        /// The recording.
        path: PathBuf,
        /// Frame of the gyro.
        gyro: String,
        /// Angle between its third axis and the vertical.
        degrees: f64,
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
    Imu(Box<Imu>),
    InitialPose(Box<PoseWithCovarianceStamped>),
}

impl Heard {
    fn stamp(&self) -> Stamp {
        match self {
            Self::Scan(message) => message.header.stamp,
            Self::Odometry(message) => message.header.stamp,
            Self::Imu(message) => message.header.stamp,
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
    let wanted = topics(path, &bag, choice)?;
    let (mut heard, transforms) = messages(path, &bag, &wanted)?;
    // Recorders store messages as they come, but not always one topic in the order of the other.
    heard.sort_by_key(|(time, _)| *time);
    let first = heard.iter().map(|(_, message)| message.stamp().nanoseconds()).min().unwrap_or_default();
    let clock = |stamp: Stamp| Time::from_micros(((stamp.nanoseconds() - first).max(0).unsigned_abs() + 500) / 1000);
    let laser = mounting(path, &heard, &transforms, choice.laser)?;
    let sign = gyro_sign(path, &heard, &transforms)?;
    let mut before: Option<Pose> = None;
    let events = heard.iter().map(|(_, message)| match message {
        Heard::Scan(message) => RecordedEvent::Scan(scan(clock(message.header.stamp), message, laser.is_upside_down)),
        Heard::Odometry(message) => {
            let pose = message.pose.pose.planar();
            let displacement = before.replace(pose).map_or(Pose::default(), |before| before.between(&pose));
            RecordedEvent::Increment(PoseIncrement { time: clock(message.header.stamp), displacement })
        }
        Heard::Imu(message) => {
            RecordedEvent::Gyro(GyroSample { time: clock(message.header.stamp), rate: message.angular_velocity.z })
        }
        Heard::InitialPose(message) => RecordedEvent::SetPose(fix(clock(message.header.stamp), message)),
    });
    let mut parameters = Parameters::new(Vehicle::Increments, laser.pose);
    if let Some(factor) = sign {
        parameters.gyro = GyroParameters { is_fitted: true, factor, ..GyroParameters::default() };
    }
    Ok(Recording {
        events: events.collect(),
        parameters,
        landmarks: Vec::new(),
        truth: Vec::new(),
        references: Vec::new(),
    })
}

/// Topics of the laser, of the odometry, and of the gyro if there is one.
struct Topics {
    scan: String,
    odometry: String,
    imu: Option<String>,
}

fn topics(path: &Path, bag: &Bag, choice: &Choice) -> Result<Topics, RosImportError> {
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
            [] if !of_kind.is_empty() => Err(RosImportError::OtherTopics {
                path: path.to_owned(),
                kind,
                name: stated.clone().unwrap_or_default(),
                option,
                found: of_kind,
            }),
            [] => {
                let found = all.iter().map(|(name, kind)| format!("{name} ({kind})")).collect();
                Err(RosImportError::NoTopic { path: path.to_owned(), kind, found })
            }
            _ => Err(RosImportError::SeveralTopics { path: path.to_owned(), kind, found: of_kind, option }),
        }
    };
    let has_gyro = choice.imu.is_some() || all.values().any(|kind| kind == Kind::Imu.name());
    Ok(Topics {
        scan: one_of(Kind::LaserScan, &choice.scan, "--scan-topic")?,
        odometry: one_of(Kind::Odometry, &choice.odometry, "--odometry-topic")?,
        imu: if has_gyro { Some(one_of(Kind::Imu, &choice.imu, "--imu-topic")?) } else { None },
    })
}

/// Messages with the times of their arrival, ns.
type Messages = Vec<(u64, Heard)>;

fn messages(path: &Path, bag: &Bag, wanted: &Topics) -> Result<(Messages, Transforms), RosImportError> {
    let (mut heard, mut transforms) = (Messages::new(), Transforms::default());
    let mut problem = None;
    let mut number = 0;
    bag.read(|message| {
        number += 1;
        let BagMessage { topic, kind, time, data } = *message;
        let taken = if topic == wanted.scan {
            decode(data).map(|message| heard.push((time, Heard::Scan(message))))
        } else if wanted.imu.as_deref() == Some(topic) {
            decode(data).map(|message| heard.push((time, Heard::Imu(Box::new(message)))))
        } else if topic == wanted.odometry {
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

/// True rate over that about the gyro's third axis: negative if it hangs upside down. None without a gyro. A gyro of which no
/// transform tells is upright.
fn gyro_sign(path: &Path, heard: &Messages, transforms: &Transforms) -> Result<Option<f64>, RosImportError> {
    let gyro = heard.iter().find_map(|(_, message)| match message {
        Heard::Imu(imu) => Some(plain(&imu.header.frame_id).to_owned()),
        _ => None,
    });
    let base = heard.iter().find_map(|(_, message)| match message {
        Heard::Odometry(odometry) => Some(plain(&odometry.child_frame_id)),
        _ => None,
    });
    let Some(gyro) = gyro else { return Ok(None) };
    match mounting::find(transforms, base.unwrap_or_default(), &gyro) {
        Ok(found) => Ok(Some(if found.is_upside_down { -1.0 } else { 1.0 })),
        Err(MountingError::Unknown) => Ok(Some(1.0)),
        Err(MountingError::Tilted(tilt)) => {
            Err(RosImportError::TiltedGyro { path: path.to_owned(), gyro, degrees: tilt.to_degrees() })
        }
    }
}

/// Where the laser is on the vehicle: as stated, and turned over if the transforms that never change say so.
fn mounting(
    path: &Path,
    heard: &Messages,
    transforms: &Transforms,
    stated: Option<Pose>,
) -> Result<Mounting, RosImportError> {
    let laser = heard.iter().find_map(|(_, message)| match message {
        Heard::Scan(scan) => Some(plain(&scan.header.frame_id).to_owned()),
        _ => None,
    });
    let base = heard.iter().find_map(|(_, message)| match message {
        Heard::Odometry(odometry) => Some(plain(&odometry.child_frame_id).to_owned()),
        _ => None,
    });
    let (laser, base) = (laser.unwrap_or_default(), base.unwrap_or_default());
    match (mounting::find(transforms, &base, &laser), stated) {
        (Ok(found), Some(pose)) => Ok(Mounting { pose, ..found }),
        (Err(_), Some(pose)) => Ok(Mounting { pose, is_upside_down: false }),
        (Ok(found), None) => Ok(found),
        (Err(MountingError::Unknown), None) => Err(RosImportError::NoLaserPose { path: path.to_owned(), base, laser }),
        (Err(MountingError::Tilted(tilt)), None) => {
            Err(RosImportError::Tilted { path: path.to_owned(), laser, degrees: tilt.to_degrees() })
        }
    }
}

fn scan(start: Time, message: &LaserScan, is_upside_down: bool) -> RecordedScan {
    // Seen from above, the bearings of what hangs upside down grow the other way.
    let sign = if is_upside_down { -1.0 } else { 1.0 };
    let limits = message.range_min..=message.range_max;
    let strength = |value: &f32| value.round().clamp(0.0, f32::from(u16::MAX)) as u16;
    // A list of another length belongs to other beams.
    let has_strengths = message.intensities.len() == message.ranges.len();
    RecordedScan {
        laser: LaserId::FIRST,
        start,
        beam_interval: f64::from(message.time_increment.max(0.0)),
        first_bearing: sign * f64::from(message.angle_min),
        bearing_step: sign * f64::from(message.angle_increment),
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
