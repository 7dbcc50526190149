//! Everything about one instant.

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::Alarm;
use agv_core::localizer::{LandmarkUse, Mode, PoseOutput, Reason};
use agv_core::measurement::{EncoderFault, Time};
use serde::Serialize;

use super::hits::FoundLandmark;
use super::scans::Found;
use super::timeline::{Revolution, Timeline};
use crate::drive::reason_name;
use crate::recording::{RecordedScan, truth_at};

/// A sensor that has been silent for longer is no longer sound, s.
const LASER_PATIENCE: f64 = 0.5;
const ODOMETRY_PATIENCE: f64 = 0.25;

/// Observations of a revolution are shown for so long, s.
const SHOWN: f64 = 0.3;

/// Answers that are not further apart than this belong to one revolution, s.
const SAME_REVOLUTION: f64 = 0.05;

/// The pose and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseMoment {
    /// When the pose was true, s.
    pub time_s: f64,
    /// Position of R in W, m, and heading, rad.
    pub pose: [f64; 3],
    /// Covariance: xx, xy, yy, x heading, y heading, heading.
    pub covariance: [f64; 6],
    /// Protection level of the position, m, and of the heading, rad.
    pub level: [f64; 2],
    /// What the pose must not be used for.
    pub alarm: Alarm,
    /// Mode.
    pub mode: Mode,
    /// Mode in words.
    pub mode_name: &'static str,
    /// Reason.
    pub reason: Reason,
    /// Reason in words.
    pub reason_name: &'static str,
    /// Distance travelled since a landmark last corrected the pose, m.
    pub dead_reckoning_m: f64,
    /// Share of the observations that were accepted lately.
    pub acceptance: f64,
    /// Mean normalised squared innovation lately; 2 is expected.
    pub normalised_square: f64,
    /// By how much landmarks last moved the pose, m.
    pub correction_m: f32,
}

/// How the parts of the vehicle are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Health {
    /// Fault of the driving wheel's encoder.
    pub drive: Option<EncoderFault>,
    /// Fault of the steering's encoder.
    pub steering: Option<EncoderFault>,
    /// Whether the odometry came lately: the bus lives.
    pub is_bus_alive: bool,
    /// Whether the laser said something lately.
    pub is_laser_alive: bool,
}

/// A scan as it lies in the map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScanMoment {
    /// When it began, s.
    pub time_s: f64,
    /// Where its returns are in W, each beam from where the laser was at its own time: x and y in turn, mm.
    pub points_mm: Vec<i32>,
}

/// Everything about one instant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// The instant, s.
    pub time_s: f64,
    /// The last pose by then; None before the first one.
    pub pose: Option<PoseMoment>,
    /// Where the vehicle really was, if somebody knows: m and rad.
    pub truth: Option<[f64; 3]>,
    /// Pose of S in R, m and rad.
    pub laser: [f64; 3],
    /// How the parts of the vehicle are.
    pub health: Health,
    /// The last scan that began by then.
    pub scan: Option<ScanMoment>,
    /// Observations of the newest revolution, unless it is old.
    pub observations: Vec<LandmarkUse>,
    /// How often each landmark of the map has corrected the pose by then, in the order of the description.
    pub hits: Vec<usize>,
    /// Landmarks found by then.
    pub found: Vec<FoundLandmark>,
}

/// What is left to do without the timeline: a scan has to be fetched from a file.
pub(super) struct Draft {
    moment: Moment,
    scan: Option<(Found, Vec<PoseOutput>, Pose)>,
}

fn numbers(pose: &Pose) -> [f64; 3] {
    [pose.x, pose.y, pose.theta]
}

/// The last of the times that is not later.
fn last_by(times: &[Time], time: Time) -> Option<Time> {
    times.get(times.partition_point(|one| *one <= time).checked_sub(1)?).copied()
}

impl Timeline {
    /// Looks up an instant.
    pub(super) fn draft(&self, time: Time) -> Draft {
        let index = self.poses.partition_point(|pose| pose.time <= time).checked_sub(1);
        let pose = index.map(|index| {
            let output = &self.poses[index];
            PoseMoment {
                time_s: output.time.seconds(),
                pose: numbers(&output.pose),
                covariance: output.covariance,
                level: [output.level.position, output.level.heading],
                alarm: self.parameters.alert_limits.alarm(output.mode, &output.level),
                mode: output.mode,
                mode_name: self.mode_name(output.mode),
                reason: output.reason,
                reason_name: reason_name(output.reason),
                dead_reckoning_m: output.dead_reckoning_distance,
                acceptance: output.acceptance,
                normalised_square: output.normalised_square,
                correction_m: self.last_correction(index),
            }
        });
        let faults = self.faults.partition_point(|faults| faults.time <= time).checked_sub(1);
        let faults = faults.map(|index| self.faults[index]).unwrap_or_default();
        let is_alive = |times: &[Time], patience| last_by(times, time).is_some_and(|last| time.since(last) < patience);
        let truth = truth_at(&self.truth, time);
        let moment = Moment {
            time_s: time.seconds(),
            pose,
            truth: truth.as_ref().map(numbers),
            laser: numbers(self.parameters.lasers.first()),
            health: Health {
                drive: faults.drive,
                steering: faults.steering,
                is_bus_alive: is_alive(&self.odometry, ODOMETRY_PATIENCE),
                is_laser_alive: is_alive(&self.laser, LASER_PATIENCE),
            },
            scan: None,
            observations: self.observations(time).to_vec(),
            hits: self.landmarks.iter().map(|landmark| self.hits.of(landmark.kind, landmark.id, time)).collect(),
            found: self.hits.found(time),
        };
        let scan = self.scans.at(time).map(|found| (found, self.poses_near(time), *self.parameters.lasers.first()));
        Draft { moment, scan }
    }

    /// The poses of the time in which a scan that is shown now may have been measured; true ones where there are none.
    fn poses_near(&self, time: Time) -> Vec<PoseOutput> {
        let [from, to] = [time.offset(-1.0), time.offset(0.3)];
        let range =
            self.poses.partition_point(|pose| pose.time < from)..self.poses.partition_point(|pose| pose.time < to);
        self.poses[range].to_vec()
    }

    fn last_correction(&self, index: usize) -> f32 {
        let recent = &self.corrections[index.saturating_sub(RECENT)..=index];
        recent.iter().rev().copied().find(|correction| *correction > 0.0).unwrap_or_default()
    }

    fn observations(&self, time: Time) -> &[LandmarkUse] {
        let after = self.revolutions.partition_point(|revolution| revolution.time <= time);
        let Some(newest) = after.checked_sub(1).map(|index| self.revolutions[index]) else { return &[] };
        if time.since(newest.time) > SHOWN {
            return &[];
        }
        // Reflectors and features of one revolution are two answers.
        let is_older = |revolution: &Revolution| newest.time.since(revolution.time) > SAME_REVOLUTION;
        let start = self.revolutions[..after].iter().rev().find(|revolution| is_older(revolution));
        &self.uses[start.map_or(0, |before| before.end)..newest.end]
    }
}

/// Poses among which the last correction is looked for.
const RECENT: usize = 100;

impl Draft {
    /// Fetches the scan.
    pub(super) fn finish(self) -> Moment {
        let Self { mut moment, scan } = self;
        if let Some((found, poses, laser)) = scan {
            let fallback = moment.truth;
            moment.scan = found.fetch().and_then(|scan| place(&scan, &poses, &laser, fallback));
        }
        moment
    }
}

/// The pose at a time, at constant velocity between its neighbours, and at the nearest end beyond them.
fn pose_at(poses: &[PoseOutput], time: Time) -> Option<Pose> {
    let after = poses.partition_point(|pose| pose.time < time);
    let next = poses.get(after).or(poses.last())?;
    let Some(last) = after.checked_sub(1).map(|index| &poses[index]) else { return Some(next.pose) };
    let interval = next.time.since(last.time);
    if interval <= 0.0 {
        return Some(next.pose);
    }
    Some(last.pose.compose(&last.pose.between(&next.pose).fraction(time.since(last.time) / interval)))
}

/// A scan in the map, with the motion within it taken out.
fn place(scan: &RecordedScan, poses: &[PoseOutput], laser: &Pose, fallback: Option<[f64; 3]>) -> Option<ScanMoment> {
    let view = scan.view();
    let at = |time| pose_at(poses, time).or(fallback.map(|[x, y, theta]| Pose::new(x, y, theta)));
    let (first, last) = (at(view.start)?, at(view.end())?);
    let motion = first.between(&last).log();
    let beams = scan.ranges.len();
    let mut points_mm = Vec::with_capacity(2 * beams);
    for (beam, range) in scan.ranges.iter().enumerate() {
        if !(range.is_finite() && *range > 0.0) {
            continue;
        }
        let share = beam as f64 / beams.saturating_sub(1).max(1) as f64;
        let vehicle = first.compose(&Pose::exp(&agv_core::geometry::Twist {
            x: motion.x * share,
            y: motion.y * share,
            theta: motion.theta * share,
        }));
        let (sine, cosine) = view.bearing(beam).sin_cos();
        let range = f64::from(*range);
        let point = vehicle.compose(laser).transform(&Point::new(range * cosine, range * sine));
        points_mm.extend([point.x, point.y].map(|metres| (1000.0 * metres).round() as i32));
    }
    Some(ScanMoment { time_s: scan.start.seconds(), points_mm })
}
