//! Recordings of ROS 2 vehicles: a planar laser and integrated odometry.

mod attached_log;
mod messages;
mod mounting;
mod scans;
mod stamps;
mod steps;

use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::{GyroSample, PoseFix, Time};
use agv_core::odometry::{GyroParameters, Vehicle};

use attached_log::NoAttachedLog;
use messages::{Arrived, Heard, Messages};
use mounting::{Frames, Mounting, plain};
use stamps::Stamped;
use steps::{TimedOdometry, is_orientation};

use super::Imported;
use crate::account::Account;
use crate::recording::{RecordedEvent, Recording};
use crate::ros::messages::PoseWithCovarianceStamped;
use crate::ros::{Bag, BagError};

/// What is taken from a recording that holds more.
#[derive(Clone, Debug, Default, PartialEq)]
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
    /// Not one message of that topic can be used.
    #[error("{}: none of the {count} messages of {topic} can be used: {why}", path.display())]
    Unusable {
        /// The recording.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// How many messages there are.
        count: usize,
        /// What is wrong with them.
        why: String,
    },
    /// The laser does not look along the ground.
    #[error(
        "{}: the laser {laser} is tilted by {degrees:.0} deg; only lasers that look along the ground can be used. If that is wrong, state where \
         it is with --laser X,Y,HEADING",
        path.display()
    )]
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

/// Reads the drive of a vehicle that reports increments of its pose. Times count from the earliest stamp. A recording that this program has
/// exported gives the whole drive, unless something was chosen.
///
/// # Errors
/// If the recording cannot be read, or does not hold one laser and one odometry.
pub fn read(path: &Path, choice: &Choice) -> Result<Imported, RosImportError> {
    let bag = Bag::open(path)?;
    let attached = if *choice == Choice::default() { attached_log::read(&bag) } else { Err(NoAttachedLog::Missing) };
    let is_damaged = match attached {
        Ok(recording) => {
            let mut account = Account::default();
            account.take(recording.events.len());
            account
                .note("the log that the recording was made of is attached to it, and was read instead of its messages");
            return Ok(Imported { recording, account });
        }
        Err(why) => why == NoAttachedLog::Damaged,
    };
    let Messages { mut heard, frames, names, mut account } = messages::read(path, &bag, choice)?;
    if is_damaged {
        account.warn("the log that is attached to the recording is damaged: only its messages were read");
    }
    // Recorders store messages as they come, but not always one topic in the order of the other.
    sort_by_arrival(&mut heard);
    let restarts = settle(&mut heard, &names.odometry, &mut account);
    let laser = mounting(path, &heard, &frames, choice.laser, &mut account)?;
    let sign = gyro_sign(path, &heard, &frames, &mut account)?;
    let events = events(&heard, &restarts, &laser, &mut account);
    for (topic, is_its) in
        [(&names.scan, is_scan as fn(&RecordedEvent) -> bool), (&names.odometry, RecordedEvent::is_odometry)]
    {
        if !events.iter().any(is_its) {
            let count = heard.iter().filter(|one| one.topic == *topic).count();
            let why: Vec<String> = account.left_out().iter().map(ToString::to_string).collect();
            return Err(RosImportError::Unusable {
                path: path.to_owned(),
                topic: topic.clone(),
                count,
                why: why.join("; "),
            });
        }
    }
    let mut parameters = Parameters::new(Vehicle::Increments, laser.pose);
    if let Some(factor) = sign {
        parameters.gyro = GyroParameters { is_fitted: true, factor, ..GyroParameters::default() };
    }
    let recording =
        Recording { events, parameters, landmarks: Vec::new(), truth: Vec::new(), references: Vec::new(), state: None };
    Ok(Imported { recording, account })
}

const fn is_scan(event: &RecordedEvent) -> bool {
    matches!(event, RecordedEvent::Scan(_))
}

/// A recorder's clock that goes back by more was set, ns: what comes behind is later nevertheless.
const SET_BACK: i64 = 5_000_000_000;

/// Sorts by the time of arrival, between two moments at which the recorder's clock was set back.
fn sort_by_arrival(heard: &mut [Arrived]) {
    let mut latest = i64::MIN;
    let mut run = 0_u32;
    for one in heard.iter_mut() {
        if one.received < latest.saturating_sub(SET_BACK) {
            run += 1;
            latest = one.received;
        }
        latest = latest.max(one.received);
        one.run = run;
    }
    heard.sort_by_key(|one| (one.run, one.received));
}

/// Mends stamps that cannot be; gives when the clock of the odometry started again, as the recorder saw it.
fn settle(heard: &mut [Arrived], leading: &str, account: &mut Account) -> Vec<i64> {
    let mut stamped: Vec<Stamped> =
        heard.iter().map(|one| Stamped { topic: &one.topic, received: one.received, stamp: one.stamp }).collect();
    let restarts = stamps::settle(&mut stamped, leading, account);
    let stamps: Vec<i64> = stamped.iter().map(|one| one.stamp).collect();
    heard.iter_mut().zip(stamps).for_each(|(one, stamp)| one.stamp = stamp);
    restarts
}

/// What the messages mean, in the order of their arrival.
fn events(heard: &[Arrived], restarts: &[i64], laser: &Mounting, account: &mut Account) -> Vec<RecordedEvent> {
    let first = heard.iter().map(|one| one.stamp).min().unwrap_or_default();
    let time = |one: &Arrived| Time::from_micros((one.stamp.saturating_sub(first).unsigned_abs() + 500) / 1000);
    let odometry: Vec<TimedOdometry> = heard
        .iter()
        .filter_map(|one| match &one.message {
            Heard::Odometry(message) => {
                Some(TimedOdometry { time: time(one), message, is_restart: restarts.contains(&one.received) })
            }
            _ => None,
        })
        .collect();
    let mut increments = steps::increments(&odometry, account).into_iter();
    let scans = heard.iter().filter_map(|one| match &one.message {
        Heard::Scan(message) => Some(message),
        _ => None,
    });
    let factor = scans::strength_factor(scans, account);
    let mut events = Vec::with_capacity(heard.len());
    for one in heard {
        let event = match &one.message {
            Heard::Scan(message) => {
                scans::scan(time(one), message, laser.is_upside_down, factor, account).map(RecordedEvent::Scan)
            }
            Heard::Odometry(_) => increments.next().flatten().map(RecordedEvent::Increment),
            Heard::Imu(message) if message.angular_velocity.z.is_finite() => {
                account.take(1);
                Some(RecordedEvent::Gyro(GyroSample { time: time(one), rate: message.angular_velocity.z }))
            }
            Heard::Imu(_) => {
                account.leave_out("rates of the gyro that are no numbers", format!("at {:.3} s", time(one).seconds()));
                None
            }
            Heard::InitialPose(message) => fix(time(one), message, account).map(RecordedEvent::SetPose),
        };
        events.extend(event);
    }
    events
}

/// The frame in which the odometry tells the motion.
fn base_of(heard: &[Arrived]) -> String {
    let base = heard.iter().find_map(|one| match &one.message {
        Heard::Odometry(odometry) => Some(plain(&odometry.child_frame_id).to_owned()),
        _ => None,
    });
    base.unwrap_or_default()
}

/// True rate over that about the gyro's third axis: negative if it hangs upside down. None without a gyro. A gyro of which no
/// transform tells is upright.
fn gyro_sign(
    path: &Path,
    heard: &[Arrived],
    frames: &Frames,
    account: &mut Account,
) -> Result<Option<f64>, RosImportError> {
    let gyro = heard.iter().find_map(|one| match &one.message {
        Heard::Imu(imu) => Some(plain(&imu.header.frame_id).to_owned()),
        _ => None,
    });
    let Some(gyro) = gyro else { return Ok(None) };
    match frames.find(&base_of(heard), &gyro, account) {
        Some(found) if !found.is_level() => {
            Err(RosImportError::TiltedGyro { path: path.to_owned(), gyro, degrees: found.tilt.to_degrees() })
        }
        Some(found) => Ok(Some(if found.is_upside_down { -1.0 } else { 1.0 })),
        None => {
            account.note(format!("no transform says how the gyro {gyro} hangs: it was taken to be upright"));
            Ok(Some(1.0))
        }
    }
}

/// Where the laser is on the vehicle: as stated, and turned over if the transforms that never change say so.
fn mounting(
    path: &Path,
    heard: &[Arrived],
    frames: &Frames,
    stated: Option<Pose>,
    account: &mut Account,
) -> Result<Mounting, RosImportError> {
    let laser = heard.iter().find_map(|one| match &one.message {
        Heard::Scan(scan) => Some(plain(&scan.header.frame_id).to_owned()),
        _ => None,
    });
    let (laser, base) = (laser.unwrap_or_default(), base_of(heard));
    match (frames.find(&base, &laser, account), stated) {
        (Some(found), Some(pose)) => {
            if !found.is_level() {
                account.warn(format!(
                    "the laser {laser} is tilted by {:.0} deg: distances to walls beside it are too long",
                    found.tilt.to_degrees()
                ));
            }
            Ok(Mounting { pose, ..found })
        }
        (None, Some(pose)) => {
            account.note(format!("no transform says how the laser {laser} hangs: it was taken to be upright"));
            Ok(Mounting { pose, is_upside_down: false, tilt: 0.0 })
        }
        (Some(found), None) if found.is_level() => Ok(found),
        (Some(found), None) => {
            Err(RosImportError::Tilted { path: path.to_owned(), laser, degrees: found.tilt.to_degrees() })
        }
        (None, None) => Err(RosImportError::NoLaserPose { path: path.to_owned(), base, laser }),
    }
}

/// What RViz states for a pose that was clicked: variances of 0.25 m^2 and 0.0685 rad^2
/// (`rviz_default_plugins`, `initial_pose_tool.cpp`).
const CLICKED: (f64, f64) = (0.5, 0.2617);

/// A pose that somebody told. One without a covariance is believed as one that was clicked is.
fn fix(time: Time, message: &PoseWithCovarianceStamped, account: &mut Account) -> Option<PoseFix> {
    let told = &message.pose.pose;
    let pose = told.planar();
    if !pose.is_finite() || !is_orientation(&told.orientation) {
        account.leave_out("told poses that are no numbers or no rotations", format!("at {:.3} s", time.seconds()));
        return None;
    }
    account.take(1);
    let covariance = &message.pose.covariance;
    let (position, heading) = (covariance[0][0].max(covariance[1][1]), covariance[5][5]);
    let is_one = |variance: f64| variance.is_finite() && variance > 0.0;
    let are_all = [covariance[0][0], covariance[1][1], heading].into_iter().all(is_one);
    if !are_all {
        account.warn(format!(
            "a told pose has no covariance, at {:.3} s: deviations of {} m and {:.0} deg were taken, as of one that was clicked in RViz",
            time.seconds(),
            CLICKED.0,
            CLICKED.1.to_degrees()
        ));
    }
    let (position_deviation, heading_deviation) = if are_all { (position.sqrt(), heading.sqrt()) } else { CLICKED };
    Some(PoseFix { time, pose, position_deviation, heading_deviation })
}
