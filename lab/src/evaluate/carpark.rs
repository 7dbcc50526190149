//! The car park: a real vehicle among surveyed reflectors, against a satellite receiver.
//!
//! The localiser gets odometry, scans, the nominal geometry and the surveyed reflectors, which its own detector finds in
//! the scans. It starts at the receiver's first position with a rough heading. Nothing is fitted to the receiver.

use std::path::Path;

use agv_core::filter::BiasDeviations;
use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{MapUse, Mode, Parameters, PoseFix, PoseOutput};
use agv_core::maps::{Landmark, LandmarkKind, Verdict};
use agv_core::measurement::Time;
use agv_core::odometry::OdometryNoise;
use agv_core::sensing::ReflectorDetection;
use agv_core::sources::Switches;
use serde::Serialize;

use agv_host_sim::accuracy::{Spread, pose_at, truth_at};
use agv_host_sim::import::carpark;
use agv_host_sim::recording::{RecordedEvent, Recording, Truth};
use agv_host_sim::replay::{Replay, ReplayError, replay};
use agv_host_sim::text_file::TextFileError;

/// What is believed of the vehicle's own sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Noise {
    /// Wide enough for a car whose wheel slips.
    #[default]
    Nominal,
    /// 0.1 m/s and 1 degree: too sure of itself.
    Tight,
}

/// What the localiser knows of the reflectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Knowledge {
    /// Where all of them are.
    #[default]
    Map,
    /// Nothing: it finds them on its way and keeps them in the state of its filter.
    Slam,
    /// The same, and contours of the way behind correct the pose, as where there is room for them.
    SlamAndContours,
}

/// What came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Root mean square distance of the laser from the receiver, m.
    pub rmse_m: f64,
    /// Median of that distance, m.
    pub median_m: f64,
    /// 95th percentile of it, m.
    pub p95_m: f64,
    /// Largest, m.
    pub max_m: f64,
    /// Root mean square difference of the heading from that of a batch solution without the receiver, deg.
    pub heading_rmse_deg: f64,
    /// When the localiser said that it was lost, s of the recording; none if it never did.
    pub lost_at_s: Option<f64>,
    /// When the distance from the receiver first passed half a metre, s of the recording.
    pub wrong_at_s: Option<f64>,
    /// Observations that corrected the pose.
    pub accepted: usize,
    /// Observations that did not.
    pub rejected: usize,
    /// Reflectors that were found on the way and kept; none if they were given.
    pub landmarks: usize,
    /// Root mean square distance of those from the nearest surveyed one, of those that have one within a metre, m.
    pub map_error_m: Option<f64>,
    /// How many have none within a metre.
    pub landmarks_elsewhere: usize,
    /// Recorded time by processor time.
    pub realtime_factor: f64,
}

/// A landmark that is further from every surveyed reflector, m, is none of them.
const FARTHEST_OF_ITS_REFLECTOR: f64 = 1.0;

/// Why the experiment cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum CarparkError {
    /// The data cannot be read.
    #[error(transparent)]
    Import(#[from] TextFileError),
    /// The recording cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// There is no satellite position to compare with.
    #[error("the recording has no reference positions")]
    NoReference,
}

/// Distance from the receiver that counts as wrong, m.
const WRONG: f64 = 0.5;

/// First heading as the data's description states it, rad.
const FIRST_HEADING: f64 = -126.0 * std::f64::consts::PI / 180.0;

/// What the localiser is told about the vehicle and its sensors. The noise of reflectors is such that innovations have
/// about the size that the filter expects; the receiver has no part in it. The car passes a reflector in few scans, so
/// errors of the map count as independent.
#[must_use]
pub fn parameters(imported: &Parameters, noise: Noise) -> Parameters {
    let mut parameters = *imported;
    let (speed, steering) = match noise {
        Noise::Nominal => (0.3, 4.0_f64.to_radians()),
        Noise::Tight => (0.1, 1.0_f64.to_radians()),
    };
    parameters.odometry_noise =
        OdometryNoise { speed, steering, slip: 0.0, side_slip: 0.0, yaw: 0.0, ..OdometryNoise::default() };
    parameters.maps = MapUse { reflectors: true, features: false, dynamic: false, slam: false };
    parameters.reflectors.range_deviation = 0.02;
    parameters.reflectors.bearing_deviation = 0.3_f64.to_radians();
    parameters.reflectors.detection = Some(ReflectorDetection::default());
    parameters.association.shared_map_error = 1.0;
    parameters.limits.fastest = 10.0;
    parameters
}

/// Reads the data from `folder` and makes the experiment.
///
/// # Errors
/// See [`CarparkError`].
pub fn run(folder: &Path, noise: Noise, knowledge: Knowledge) -> Result<(Outcome, Recording, Replay), CarparkError> {
    let mut recording = carpark::read(folder, &carpark::WINDOW)?;
    recording.parameters = parameters(&recording.parameters, noise);
    let survey = recording.landmarks.clone();
    let is_mapping = knowledge != Knowledge::Map;
    if is_mapping {
        recording.landmarks.clear();
        for_slam(&mut recording.parameters);
        recording.parameters.sources.contours = knowledge == Knowledge::SlamAndContours;
    }
    let headings = carpark::read_batch_solution(folder)?;
    let first = recording.references.first().ok_or(CarparkError::NoReference)?;
    // Nothing on the way tells the angle of a map that begins here, so the start must.
    let given = headings.first().filter(|_| is_mapping);
    let given = given.map(|first| first.pose.theta + recording.parameters.lasers.first().theta);
    let laser = Pose::new(first.x, first.y, given.unwrap_or(FIRST_HEADING));
    let fix = PoseFix {
        time: first.time,
        pose: laser.compose(&recording.parameters.lasers.first().inverse()),
        position_deviation: 0.3,
        heading_deviation: given.map_or(5.0_f64, |_| 1.0).to_radians(),
    };
    recording.events.insert(0, RecordedEvent::SetPose(fix));
    let replay = replay(&recording, |_| {})?;
    let mut outcome = judge(&recording, &replay, &headings);
    if is_mapping {
        judge_map(&mut outcome, &replay, &survey);
    }
    Ok((outcome, recording, replay))
}

/// Reflectors in the state: there are no walls to align to, and no pallets.
fn for_slam(parameters: &mut Parameters) {
    parameters.maps = MapUse { reflectors: true, features: false, dynamic: false, slam: true };
    parameters.sources = Switches { corners: false, end_points: false, key_scans: false, ..Switches::ALL };
    // A car whose wheel slips and whose steering angle is that of a wheel which does not exist.
    parameters.slam.biases = BiasDeviations { scale: 0.03, steering: 0.02, laser_yaw: 3e-3 };
    // Without a map the uncertainty of the start remains, and grows with the distance from it.
    parameters.limits.largest_position_deviation = 10.0;
    parameters.limits.largest_heading_deviation = 1.0;
}

/// How far the found reflectors are from the surveyed ones. Nothing is aligned: the start pose fixes the map.
fn judge_map(outcome: &mut Outcome, replay: &Replay, survey: &[Landmark]) {
    let nearest: Vec<f64> = replay
        .dynamic_landmarks
        .iter()
        .map(|&[x, y]| {
            survey.iter().map(|landmark| (landmark.x - x).hypot(landmark.y - y)).fold(f64::INFINITY, f64::min)
        })
        .collect();
    let found: Vec<f64> = nearest.iter().copied().filter(|distance| *distance <= FARTHEST_OF_ITS_REFLECTOR).collect();
    outcome.landmarks = nearest.len();
    outcome.landmarks_elsewhere = nearest.len() - found.len();
    outcome.map_error_m = (!found.is_empty()).then(|| root_mean_square(found.into_iter()));
}

fn judge(recording: &Recording, replay: &Replay, headings: &[Truth]) -> Outcome {
    let localised: Vec<PoseOutput> =
        replay.poses.iter().filter(|pose| pose.mode != Mode::NotLocalised).copied().collect();
    let errors: Vec<(Time, f64)> = recording
        .references
        .iter()
        .filter_map(|reference| {
            let laser = pose_at(&localised, reference.time)?.compose(recording.parameters.lasers.first());
            Some((reference.time, (laser.position() - reference.position()).norm()))
        })
        .collect();
    let turned: Vec<f64> = localised
        .iter()
        .filter_map(|pose| Some(difference(pose.pose.theta, truth_at(headings, pose.time)?.theta)))
        .collect();
    let spread = Spread::of(errors.iter().map(|error| error.1));
    let accepted = replay.uses.iter().filter(|used| used.verdict == Verdict::Accepted).count();
    let seen = replay.uses.iter().filter(|used| used.kind == LandmarkKind::Reflector).count();
    let recorded = match (replay.poses.first(), replay.poses.last()) {
        (Some(first), Some(last)) => last.time.since(first.time),
        _ => 0.0,
    };
    Outcome {
        rmse_m: root_mean_square(errors.iter().map(|error| error.1)),
        median_m: spread.median,
        p95_m: spread.p95,
        max_m: spread.max,
        heading_rmse_deg: root_mean_square(turned.iter().copied()).to_degrees(),
        lost_at_s: localised.iter().find(|pose| pose.mode == Mode::Lost).map(|pose| pose.time.seconds()),
        wrong_at_s: errors.iter().find(|error| error.1 > WRONG).map(|error| error.0.seconds()),
        accepted,
        rejected: seen - accepted,
        landmarks: 0,
        map_error_m: None,
        landmarks_elsewhere: 0,
        realtime_factor: recorded / replay.elapsed.as_secs_f64(),
    }
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    (values.map(|value| value * value).sum::<f64>() / count as f64).sqrt()
}
