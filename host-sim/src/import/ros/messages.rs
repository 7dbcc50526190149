//! Messages of a recording that matter.

use std::collections::BTreeMap;
use std::path::Path;

use super::mounting::Frames;
use super::{Choice, RosImportError};
use crate::account::Account;
use crate::ros::messages::{Imu, LaserScan, Odometry, PoseWithCovarianceStamped, Stamp, Transforms};
use crate::ros::{Bag, BagMessage, Kind, decode};

/// What a message says.
pub(super) enum Heard {
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

/// A message as it arrived.
pub(super) struct Arrived {
    pub(super) topic: String,
    /// When the recorder received it, ns.
    pub(super) received: i64,
    /// How often the recorder's clock was set back before.
    pub(super) run: u32,
    /// When it was true, ns: as it says, until that is mended.
    pub(super) stamp: i64,
    pub(super) message: Heard,
}

/// Topics of the laser, of the odometry, and of the gyro if there is one.
pub(super) struct Topics {
    pub(super) scan: String,
    pub(super) odometry: String,
    imu: Option<String>,
}

/// What is taken from a recording.
pub(super) struct Messages {
    /// In the order of the recording.
    pub(super) heard: Vec<Arrived>,
    pub(super) frames: Frames,
    pub(super) names: Topics,
    pub(super) account: Account,
}

/// Topic of poses that an operator gives, and those of transforms; before them may stand the name of the vehicle.
const INITIAL_POSE: &str = "initialpose";
const FIXED: &str = "tf_static";
const MOVING: &str = "tf";

fn is_named(topic: &str, name: &str) -> bool {
    topic.rsplit('/').next() == Some(name)
}

/// Reads a recording.
pub(super) fn read(path: &Path, bag: &Bag, choice: &Choice) -> Result<Messages, RosImportError> {
    let mut all: BTreeMap<String, (String, usize)> = BTreeMap::new();
    let mut account = bag.read(|message| {
        let entry = all.entry(message.topic.to_owned()).or_insert_with(|| (message.kind.to_owned(), 0));
        entry.1 += 1;
    })?;
    let names = topics(path, &all, choice)?;
    let used = |topic: &str, kind: &str| {
        topic == names.scan
            || topic == names.odometry
            || names.imu.as_deref() == Some(topic)
            || kind == Kind::Transforms.name()
            || (is_named(topic, INITIAL_POSE) && kind == Kind::PoseWithCovarianceStamped.name())
    };
    for (topic, (kind, count)) in &all {
        if !used(topic, kind) {
            account.set_aside(format!("messages of {topic} ({kind})"), *count);
        }
    }
    let (mut heard, mut fixed, mut moving) = (Vec::new(), Transforms::default(), Transforms::default());
    let mut number = 0;
    bag.read(|message| {
        number += 1;
        let BagMessage { topic, kind, time, data } = *message;
        let mut arrive = |message: Heard| {
            let received = i64::try_from(time).unwrap_or(i64::MAX);
            let stamp = message.stamp().nanoseconds();
            heard.push(Arrived { topic: topic.to_owned(), received, run: 0, stamp, message });
        };
        let taken = if topic == names.scan {
            decode(data).map(|message| arrive(Heard::Scan(message)))
        } else if names.imu.as_deref() == Some(topic) {
            decode(data).map(|message| arrive(Heard::Imu(Box::new(message))))
        } else if topic == names.odometry {
            decode(data).map(|message| arrive(Heard::Odometry(Box::new(message))))
        } else if is_named(topic, INITIAL_POSE) && kind == Kind::PoseWithCovarianceStamped.name() {
            decode(data).map(|message| arrive(Heard::InitialPose(Box::new(message))))
        } else if is_named(topic, FIXED) && kind == Kind::Transforms.name() {
            decode(data).map(|message: Transforms| fixed.transforms.extend(message.transforms))
        } else if is_named(topic, MOVING) && kind == Kind::Transforms.name() {
            decode(data).map(|message: Transforms| moving.transforms.extend(message.transforms))
        } else {
            Ok(())
        };
        if let Err(source) = taken {
            account.leave_out(format!("messages of {topic}, of which {source}"), format!("message {number}"));
        }
    })?;
    let frames = Frames::new(&fixed, &moving, &mut account);
    Ok(Messages { heard, frames, names, account })
}

fn topics(path: &Path, all: &BTreeMap<String, (String, usize)>, choice: &Choice) -> Result<Topics, RosImportError> {
    let one_of = |kind: Kind, stated: &Option<String>, option| {
        let kind = kind.name();
        let of_kind: Vec<String> =
            all.iter().filter(|(_, (found, _))| *found == kind).map(|(name, _)| name.clone()).collect();
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
                let found = all.iter().map(|(name, (kind, _))| format!("{name} ({kind})")).collect();
                Err(RosImportError::NoTopic { path: path.to_owned(), kind, found })
            }
            _ => Err(RosImportError::SeveralTopics { path: path.to_owned(), kind, found: of_kind, option }),
        }
    };
    let has_gyro = choice.imu.is_some() || all.values().any(|(kind, _)| kind == Kind::Imu.name());
    Ok(Topics {
        scan: one_of(Kind::LaserScan, &choice.scan, "--scan-topic")?,
        odometry: one_of(Kind::Odometry, &choice.odometry, "--odometry-topic")?,
        imu: if has_gyro { Some(one_of(Kind::Imu, &choice.imu, "--imu-topic")?) } else { None },
    })
}
