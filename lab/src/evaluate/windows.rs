//! Windows of a real drive: how far a vehicle has drifted after some metres in a building that it does not know.
//!
//! Each window begins at a corrected pose and is driven by odometry, and by features and scans alone. What is drifted is
//! the distance from the corrected pose at the end. The corrected poses are those of others, made from the whole drive.

use std::fmt;

use agv_core::filter::{BiasDeviations, BiasWalk};
use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{KeyScanParameters, MapUse, Mode, Parameters, PoseFix};
use agv_core::measurement::PoseIncrement;
use agv_core::odometry::{OdometryNoise, Vehicle};
use agv_core::sensing::falko;
use agv_core::sensing::{SurfaceAlignmentParameters, SurfaceParameters};
use agv_core::sources::Switches;
use rayon::prelude::*;
use serde::Serialize;

use super::contours::{Followed, follow};
use super::slam::OfficeDrive;
use agv_host_sim::accuracy::Spread;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::{ReplayError, replay};
use agv_host_sim::simulate::random::{Random, Stream};

/// How the vehicle localises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Name.
    pub name: &'static str,
    maps: MapUse,
    detector: falko::Parameters,
    sources: Switches,
}

const NO_MAP: MapUse = MapUse { reflectors: false, features: false, dynamic: false, slam: false };
const SLAM: MapUse = MapUse { slam: true, ..NO_MAP };
const DYNAMIC: MapUse = MapUse { dynamic: true, ..NO_MAP };

const WITHOUT_KEY_SCANS: Switches = Switches { key_scans: false, contours: false, ..Switches::ALL };

impl Candidate {
    /// All candidates; the first is odometry alone.
    pub const ALL: [Self; 6] = [
        Self { name: "odometry", maps: NO_MAP, detector: falko::Parameters::mended(), sources: WITHOUT_KEY_SCANS },
        Self {
            name: "dynamic, FALKO as printed",
            maps: DYNAMIC,
            detector: falko::Parameters::thesis(),
            sources: WITHOUT_KEY_SCANS,
        },
        Self { name: "dynamic", maps: DYNAMIC, detector: falko::Parameters::mended(), sources: WITHOUT_KEY_SCANS },
        Self {
            name: "slam with features alone",
            maps: SLAM,
            detector: falko::Parameters::mended(),
            sources: WITHOUT_KEY_SCANS,
        },
        Self {
            name: "slam with key scans alone",
            maps: SLAM,
            detector: falko::Parameters::mended(),
            sources: Switches { corners: false, end_points: false, contours: false, ..Switches::ALL },
        },
        Self {
            name: "slam with features and key scans",
            maps: SLAM,
            detector: falko::Parameters::mended(),
            sources: Switches { contours: false, ..Switches::ALL },
        },
    ];

    fn parameters(&self) -> Parameters {
        // Odometry and corrected poses are those of the laser.
        let mut parameters = Parameters::new(Vehicle::Increments, Pose::default());
        parameters.maps = self.maps;
        parameters.features.detector = self.detector;
        parameters.features.motion_correction = false;
        // From scan to scan, a third of a metre, the heading of such robots is wrong by 1.4 deg in the median, and by 6 deg
        // at the 95 % mark, which hides any bias.
        parameters.odometry_noise = OdometryNoise { slip: 0.1, side_slip: 0.1, yaw: 0.1, ..OdometryNoise::default() };
        parameters.slam.biases = BiasDeviations { scale: 1e-6, steering: 1e-6, laser_yaw: 1e-6 };
        parameters.slam.bias_walk = BiasWalk::NONE;
        // An increment is all that lies between two scans, however long that took.
        parameters.limits.longest_extrapolation = 1e6;
        // Nothing tells the vehicle where it is, so it may grow uncertain.
        parameters.limits.largest_heading_deviation = 1.0;
        parameters.limits.largest_position_deviation = 10.0;
        parameters.sources = self.sources;
        parameters.slam.key_scans = key_scans();
        parameters
    }
}

/// For a laser with a beam a degree or half of it and 1 to 2 cm of noise, and scans far apart.
fn key_scans() -> KeyScanParameters {
    let surfaces = SurfaceParameters { radius: 0.2, growth: 0.03, residual: 0.03 };
    let alignment = SurfaceAlignmentParameters {
        reach: 0.5,
        tolerance: 0.1,
        iterations: 12,
        every: 1,
        range_deviation: 0.02,
        ..SurfaceAlignmentParameters::default()
    };
    KeyScanParameters { surfaces, alignment, least_share: 0.4, gate: 30.0, ..KeyScanParameters::default() }
}

/// How the odometry is made worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worsening {
    /// Name.
    pub name: &'static str,
    /// The way is too long by this share.
    scale: f64,
    /// Walk of the heading, rad for the root of a metre.
    yaw: f64,
}

impl Worsening {
    /// Raw odometry, and odometry whose way is 2 % too long and whose heading walks by a degree in a metre.
    pub const ALL: [Self; 2] = [
        Self { name: "raw", scale: 0.0, yaw: 0.0 },
        Self { name: "worse", scale: 0.02, yaw: std::f64::consts::PI / 180.0 },
    ];

    /// Whether the odometry is left as it was.
    #[must_use]
    pub fn is_raw(&self) -> bool {
        self.scale == 0.0 && self.yaw == 0.0
    }
}

/// Drift of one candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// Name of the candidate.
    pub candidate: &'static str,
    /// How the odometry was made worse.
    pub odometry: &'static str,
    /// Number of windows.
    pub windows: usize,
    /// Share of the windows at whose end the localiser said that it was lost.
    pub lost_share: f64,
    /// Distance from the corrected pose at the end, m.
    pub position_m: Spread,
    /// Difference from its heading, deg.
    pub heading_deg: Spread,
}

/// The way up to each scan, m.
pub(super) fn ways(drive: &OfficeDrive) -> Vec<f64> {
    let mut ways = vec![0.0];
    for pair in drive.truth.windows(2) {
        ways.push(ways[ways.len() - 1] + pair[0].between(&pair[1]).position().norm());
    }
    ways
}

/// Windows of `length` (m) that begin every half of it: first and last scan.
pub(super) fn windows(drive: &OfficeDrive, length: f64) -> Vec<(usize, usize)> {
    let ways = ways(drive);
    let mut windows = Vec::new();
    let mut begin = 0.0;
    loop {
        let first = ways.partition_point(|way| *way < begin);
        let last = ways.partition_point(|way| *way < begin + length);
        if last >= ways.len() {
            return windows;
        }
        windows.push((first, last));
        begin += 0.5 * length;
    }
}

/// The end of one window.
struct End {
    /// Distance from the corrected pose, m.
    position: f64,
    /// Heading minus the corrected one, rad.
    heading: f64,
    is_lost: bool,
}

impl End {
    fn of(found: &Pose, truth: &Pose, is_lost: bool) -> Self {
        Self {
            position: (found.position() - truth.position()).norm(),
            heading: difference(found.theta, truth.theta),
            is_lost,
        }
    }
}

/// The steps of the worsened odometry from each scan of a window to the next.
fn steps(drive: &OfficeDrive, (first, last): (usize, usize), worsening: &Worsening) -> Vec<Pose> {
    let mut random = Random::new(first as u64, Stream::Odometry);
    // The first scan draws a number too: its step is none.
    let _ = random.normal();
    let step = |scan: usize| {
        let moved = drive.odometry[scan - 1].between(&drive.odometry[scan]);
        let way = moved.position().norm();
        Pose::new(
            moved.x * (1.0 + worsening.scale),
            moved.y * (1.0 + worsening.scale),
            moved.theta + worsening.yaw * way.sqrt() * random.normal(),
        )
    };
    (first + 1..=last).map(step).collect()
}

/// One candidate in one window.
fn run(
    drive: &OfficeDrive,
    (first, last): (usize, usize),
    candidate: &Candidate,
    worsening: &Worsening,
) -> Result<End, ReplayError> {
    let start = &drive.scans[first];
    let fix =
        PoseFix { time: start.start, pose: drive.truth[first], position_deviation: 1e-3, heading_deviation: 1e-3 };
    let mut events = vec![RecordedEvent::SetPose(fix)];
    let steps = steps(drive, (first, last), worsening);
    for (scan, displacement) in (first..=last).zip(std::iter::once(Pose::default()).chain(steps)) {
        events.push(RecordedEvent::Increment(PoseIncrement { time: drive.scans[scan].start, displacement }));
        events.push(RecordedEvent::Scan(drive.scans[scan].clone()));
    }
    let recording = Recording {
        parameters: candidate.parameters(),
        landmarks: Vec::new(),
        events,
        truth: Vec::new(),
        references: Vec::new(),
        state: None,
    };
    let replay = replay(&recording, |_| {})?;
    let found = replay.poses.last().map_or(Pose::default(), |pose| pose.pose);
    let is_lost = replay.poses.last().is_some_and(|pose| pose.mode == Mode::Lost);
    Ok(End::of(&found, &drive.truth[last], is_lost))
}

/// Drift of a candidate over all windows of `length` (m).
///
/// # Errors
/// If a window cannot be replayed.
pub fn drift(
    drive: &OfficeDrive,
    length: f64,
    candidate: &Candidate,
    worsening: &Worsening,
) -> Result<Drift, ReplayError> {
    let ends: Vec<End> = windows(drive, length)
        .into_par_iter()
        .map(|window| run(drive, window, candidate, worsening))
        .collect::<Result<_, _>>()?;
    Ok(Drift::of(candidate.name, worsening, &ends))
}

/// Name of the candidate that matches scans to the contours of the way behind.
pub const CONTOURS: &str = "contours";

/// Drift by contours: the matcher of the core alone, without filter and without parameters.
#[must_use]
pub fn contour_drift(drive: &OfficeDrive, length: f64, worsening: &Worsening) -> (Drift, Vec<WindowPose>) {
    let windows = windows(drive, length);
    let followed: Vec<Followed> =
        windows.par_iter().map(|window| follow(drive, *window, &steps(drive, *window, worsening))).collect();
    let mut poses = Vec::new();
    let mut ends = Vec::new();
    for (number, (followed, (first, last))) in followed.iter().zip(&windows).enumerate() {
        let numbered = followed.poses.iter().zip(*first..);
        poses.extend(numbered.map(|(pose, scan)| WindowPose { window: number, scan, pose: *pose }));
        ends.extend(followed.poses.last().map(|found| End::of(found, &drive.truth[*last], followed.is_lost)));
    }
    (Drift::of(CONTOURS, worsening, &ends), poses)
}

/// Name of the candidate that is the vehicle's own filter as it ships.
pub const VEHICLE: &str = "vehicle, slam";

/// Drift of the vehicle's own filter without a map: the default parameters, and the noise of the odometry that the scans of the drive tell.
///
/// # Errors
/// If a window cannot be replayed.
pub fn vehicle_drift(drive: &OfficeDrive, length: f64, worsening: &Worsening) -> Result<Drift, ReplayError> {
    let noise = drive.odometry_noise()?;
    let end = |window: (usize, usize)| {
        let mut recording = drive.recording(window, steps(drive, window, worsening), &noise);
        recording.parameters.maps = SLAM;
        let said = replay(&recording, |_| {})?.poses.pop();
        let pose = said.as_ref().map_or(Pose::default(), |said| said.pose);
        Ok(End::of(&pose, &drive.truth[window.1], said.is_none_or(|said| said.mode == Mode::Lost)))
    };
    let ends: Vec<End> = windows(drive, length).into_par_iter().map(end).collect::<Result<_, ReplayError>>()?;
    Ok(Drift::of(VEHICLE, worsening, &ends))
}

impl Drift {
    fn of(candidate: &'static str, worsening: &Worsening, ends: &[End]) -> Self {
        Self {
            candidate,
            odometry: worsening.name,
            windows: ends.len(),
            lost_share: ends.iter().filter(|end| end.is_lost).count() as f64 / ends.len() as f64,
            position_m: Spread::of(ends.iter().map(|end| end.position)),
            heading_deg: Spread::of(ends.iter().map(|end| end.heading.abs().to_degrees())),
        }
    }
}

/// Where a candidate has the laser at a scan of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowPose {
    /// Number of the window.
    pub window: usize,
    /// Number of the scan in the log.
    pub scan: usize,
    /// Pose of the laser.
    pub pose: Pose,
}

/// First line of a file of such poses.
pub const TRAJECTORY_HEADER: &str = "window,scan,x,y,theta";

impl fmt::Display for WindowPose {
    /// A line of a file of poses.
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let Self { window, scan, pose } = self;
        write!(formatter, "{window},{scan},{:.6},{:.6},{:.6}", pose.x, pose.y, pose.theta)
    }
}
