//! One event in, outputs out.

use heapless::Vec;

use super::evidence::DistanceSince;
use super::integrity::{Corrected, Estimate};
use super::maps::Maps;
use super::sighting::{Workspace, see_reflectors};
use super::slam::{SLAM_ENTRIES, SLAM_STATES, Slam};
use super::{Event, Mode, Outputs, Parameters, PoseFix, PoseOutput, Reason};
use crate::features::{PointScan, SensorPath, detect_reflectors, falko};
use crate::filter::{Consistency, DriftCheck, Ekf, MotionCheck, Suspect, Timeline};
use crate::geometry::{Point, Pose, wrap};
use crate::landmarks::{DynamicLandmark, DynamicMap, FixedMap, Landmark, LandmarkKind, MapError};
use crate::measurement::{EncoderFaults, Scan, Time};
use crate::odometry::{Coasting, Motion, Odometer, OdometryError};
use crate::record::{Capacities, Header};

/// Entries of the filter's past: about 0.4 s at 100 samples and 230 corrections a second.
const PAST: usize = 128;

/// Localises one vehicle. All of its memory is in this value.
///
/// Room for `BEAMS` beams of a scan, `REFLECTORS` and `FEATURES` landmarks of the fixed maps, and `DYNAMIC` landmarks
/// that are found while driving; in the filter's state for `KEYS` past poses and `LANDMARKS` landmarks, which make `STATES`
/// states and `ENTRIES` entries of their covariance ([`crate::filter::augmented_states`],
/// [`crate::filter::packed_entries`]).
#[derive(Clone, Debug)]
pub struct Localizer<
    const BEAMS: usize = 1440,
    const REFLECTORS: usize = 1000,
    const FEATURES: usize = 1000,
    const DYNAMIC: usize = 256,
    const KEYS: usize = 4,
    const LANDMARKS: usize = 64,
    const STATES: usize = SLAM_STATES,
    const ENTRIES: usize = SLAM_ENTRIES,
> {
    pub(super) parameters: Parameters,
    pub(super) odometer: Odometer,
    pub(super) maps: Maps<REFLECTORS, FEATURES, DYNAMIC>,
    pub(super) timeline: Timeline<PAST>,
    pub(super) slam: Slam<KEYS, LANDMARKS, STATES, ENTRIES>,
    pub(super) consistency: Consistency,
    pub(super) motion_check: MotionCheck,
    pub(super) drift_check: DriftCheck,
    pub(super) corrected_at: Option<Corrected>,
    pub(super) lost: Option<Reason>,
    blindness: Option<Blindness>,
    pub(super) distance: DistanceSince,
    pub(super) workspace: Workspace<BEAMS>,
    pub(super) outputs: Outputs,
}

/// The odometry is not believed.
#[derive(Clone, Copy, Debug)]
struct Blindness {
    reason: Reason,
    coasting: Coasting,
}

impl<
    const BEAMS: usize,
    const REFLECTORS: usize,
    const FEATURES: usize,
    const DYNAMIC: usize,
    const KEYS: usize,
    const LANDMARKS: usize,
    const STATES: usize,
    const ENTRIES: usize,
> Localizer<BEAMS, REFLECTORS, FEATURES, DYNAMIC, KEYS, LANDMARKS, STATES, ENTRIES>
{
    /// How much it has room for, as the log of its vehicle states it.
    pub const CAPACITIES: Capacities =
        Capacities { landmarks: (REFLECTORS + FEATURES) as u32, beams: BEAMS as u32, history: PAST as u32 };

    /// What the log of its vehicle begins with.
    #[must_use]
    pub const fn header<'a>(software: &'a str, parameters: &'a Parameters) -> Header<'a> {
        Header { software, parameters, capacities: Self::CAPACITIES }
    }

    /// A localiser with empty maps that does not know where it is.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: Parameters) -> Self {
        let pose = PoseOutput {
            time: Time::default(),
            pose: Pose::default(),
            covariance: [0.0; 6],
            mode: Mode::NotLocalised,
            reason: Reason::NoPose,
            dead_reckoning_distance: 0.0,
            correction: 0.0,
            smooth: Pose::default(),
            drift: [0.0; 2],
            acceptance: 1.0,
            normalised_square: 2.0,
            resets: 0,
            last_reset: 0.0,
            overflows: 0,
        };
        Self {
            odometer: Odometer::new(
                parameters.vehicle,
                parameters.odometry_noise,
                parameters.integration,
                parameters.limits.fastest,
            ),
            maps: Maps {
                reflectors: FixedMap::new(),
                features: FixedMap::new(),
                dynamic: DynamicMap::new(parameters.dynamic_map),
            },
            timeline: Timeline::new(parameters.laser, parameters.limits.longest_extrapolation),
            slam: Slam::new(),
            consistency: Consistency::new(parameters.consistency),
            motion_check: MotionCheck::new(),
            drift_check: DriftCheck::new(),
            corrected_at: None,
            lost: None,
            blindness: None,
            distance: DistanceSince::NEVER,
            workspace: Workspace {
                points: PointScan::new(),
                path: SensorPath::default(),
                detector: falko::Detector::new(parameters.features.detector),
                keypoints: Vec::new(),
                reflectors: Vec::new(),
                sightings: Vec::new(),
            },
            outputs: Outputs { pose, uses: Vec::new(), has_cut: false },
            parameters,
        }
    }

    /// Adds landmarks to the fixed maps, each to the one of its kind.
    ///
    /// # Errors
    /// [`MapError`] if a landmark does not fit; those before it are in the map.
    pub fn add_landmarks(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        let is_reflector = |landmark: &Landmark| landmark.kind == LandmarkKind::Reflector;
        // Runs of one kind, so that each map is indexed once for a list that is sorted by kind.
        let mut rest = landmarks;
        while let Some(first) = rest.first() {
            let are_reflectors = is_reflector(first);
            let length = rest.iter().take_while(|landmark| is_reflector(landmark) == are_reflectors).count();
            let Some((run, others)) = rest.split_at_checked(length) else { break };
            if are_reflectors {
                self.maps.reflectors.extend(run)?;
            } else {
                self.maps.features.extend(run)?;
            }
            rest = others;
        }
        Ok(())
    }

    /// What the localiser believes of its vehicle and its sensors.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The landmarks that were found while driving.
    #[must_use]
    pub fn dynamic_landmarks(&self) -> &[DynamicLandmark] {
        self.maps.dynamic.landmarks()
    }

    /// The map of the reflectors.
    #[must_use]
    pub fn reflectors(&self) -> &FixedMap<REFLECTORS> {
        &self.maps.reflectors
    }

    /// The landmarks in the state of the filter, those too that were given: kind and position in W, m.
    pub fn state_landmarks(&self) -> impl Iterator<Item = (LandmarkKind, Point)> + '_ {
        self.slam.landmarks()
    }

    /// What the last event gave.
    #[must_use]
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// Takes one event. Events of one sensor come in order of time; those of different sensors may overtake each other
    /// by as much as the filter remembers, about 0.4 s.
    pub fn handle(&mut self, event: &Event) -> &Outputs {
        self.outputs.uses.clear();
        self.outputs.has_cut = false;
        let sees = matches!(event, Event::Reflectors(_) | Event::Scan(_));
        let before = if sees { self.estimate() } else { None };
        match event {
            Event::Encoders(sample) => {
                let motion = self.odometer.encoders(sample);
                self.move_by(sample.time, motion);
            }
            Event::EncoderFaults(faults) => self.doubt_encoders(faults),
            Event::Speed(sample) => {
                let motion = self.odometer.speed(sample);
                self.move_by(sample.time, motion);
            }
            Event::Increment(increment) => {
                let motion = self.odometer.increment(increment);
                self.move_by(increment.time, motion);
            }
            Event::Reflectors(reflectors) if self.parameters.maps.reflectors => {
                self.workspace.sightings.clear();
                self.outputs.has_cut |=
                    see_reflectors(&self.parameters, reflectors.observations, &mut self.workspace.sightings);
                if self.parameters.maps.slam {
                    self.fuse_lone_reflectors_by_slam();
                } else {
                    self.fuse();
                }
            }
            Event::Reflectors(_) => {}
            Event::Scan(scan) => self.scan(scan),
            Event::SetPose(fix) => self.set_pose(fix),
        }
        if let Some(before) = before {
            self.check_motion(&before);
        }
        self.publish(sees);
        &self.outputs
    }

    fn set_pose(&mut self, fix: &PoseFix) {
        if !fix.is_sound() {
            return;
        }
        let pose = Pose { theta: wrap(fix.pose.theta), ..fix.pose };
        let state = Ekf::new(pose, fix.position_deviation, fix.heading_deviation);
        self.restart_checks(fix);
        self.timeline.begin(fix.time, state);
        self.slam.begin(fix.time, &state, &self.parameters.slam);
        self.consistency = Consistency::new(self.parameters.consistency);
        self.lost = None;
        self.blindness =
            self.blindness.map(|blindness| Blindness { coasting: Coasting::new(Motion::none(fix.time)), ..blindness });
        self.distance = DistanceSince { fix: 0.0, ..DistanceSince::NEVER };
        self.maps.dynamic.clear();
        self.count_given_pose();
    }

    fn count_given_pose(&mut self) {
        let Some(Estimate { pose, .. }) = self.estimate() else { return };
        let last = &mut self.outputs.pose;
        let is_first = last.mode == Mode::NotLocalised;
        let distance = if is_first { 0.0 } else { libm::hypot(pose.x - last.pose.x, pose.y - last.pose.y) };
        last.count_reset(distance);
    }

    fn move_by(&mut self, time: Time, motion: Result<Motion, OdometryError>) {
        let Some(timeline) = self.timeline.begun_mut() else {
            return;
        };
        match motion {
            // A pose may be given for a time between two samples; only what follows it counts.
            Ok(motion) if motion.end > timeline.start() => {
                let motion = if motion.start < timeline.start() { motion.split(timeline.start()).1 } else { motion };
                let motion = if self.parameters.maps.slam {
                    motion.corrected(&self.slam.bias(), self.parameters.vehicle.steering_lever())
                } else {
                    motion
                };
                self.blindness = None;
                self.distance.advance(motion.distance);
                timeline.advance(&motion);
            }
            Err(OdometryError::Implausible) => self.coast(time, Reason::OdometryImplausible),
            // The first sample behind a fault: the next one says how the vehicle moves.
            Err(OdometryError::First) => {
                if let Some(blindness) = self.blindness {
                    self.coast(time, blindness.reason);
                }
            }
            _ => {}
        }
    }

    fn doubt_encoders(&mut self, faults: &EncoderFaults) {
        let reason = match (faults.drive, faults.steering) {
            (Some(_), _) => Reason::DriveEncoder,
            (None, Some(_)) => Reason::SteeringEncoder,
            // Samples follow, and end the blindness.
            (None, None) => return,
        };
        // What the counters did meanwhile is not to be taken for a motion.
        self.odometer.restart();
        self.coast(faults.time, reason);
    }

    /// Goes on to `time` without the odometry.
    fn coast(&mut self, time: Time, reason: Reason) {
        let Some(timeline) = self.timeline.begun_mut() else {
            return;
        };
        let mut coasting =
            self.blindness.map_or_else(|| Coasting::new(*timeline.last_motion()), |blindness| blindness.coasting);
        if let Some(motion) = coasting.to(time, &self.parameters.odometry_noise) {
            self.distance.advance(motion.distance);
            timeline.advance(&motion);
        }
        self.blindness = Some(Blindness { reason, coasting });
    }

    fn scan(&mut self, scan: &Scan) {
        let Some(timeline) = self.timeline.begun() else {
            return;
        };
        let workspace = &mut self.workspace;
        let maps = self.parameters.maps;
        if maps.features || maps.dynamic || maps.slam {
            workspace.path.set(scan.start, &self.parameters.laser, timeline.relative_path(scan.start, scan.end()));
        }
        if let Some(detection) = &self.parameters.reflectors.detection
            && maps.reflectors
            && !scan.intensities.is_empty()
        {
            self.outputs.has_cut |= detect_reflectors(scan, detection, &mut workspace.reflectors) > 0;
            workspace.sightings.clear();
            see_reflectors(&self.parameters, &workspace.reflectors, &mut workspace.sightings);
            if maps.slam {
                self.fuse_reflectors_by_slam(scan.start);
            } else {
                self.fuse();
            }
        }
        if maps.slam {
            self.fuse_scan_by_slam(scan);
        } else if maps.features || maps.dynamic {
            self.outputs.has_cut |= self.workspace.see_features(&self.parameters, scan);
            self.fuse();
            self.update_dynamic_map();
        }
    }

    fn publish(&mut self, may_be_corrected: bool) {
        let Some(timeline) = self.timeline.begun_mut() else {
            return;
        };
        let state = timeline.state();
        let smooth = *timeline.odometry_pose();
        let correction = if may_be_corrected { correction(&self.outputs.pose, &state.pose, &smooth) } else { 0.0 };
        let limits = &self.parameters.limits;
        let distance = self.distance;
        if self.lost.is_none() {
            let is_uncertain = state.position_deviation() > limits.largest_position_deviation
                || state.heading_deviation() > limits.largest_heading_deviation;
            if is_uncertain {
                self.lost = Some(Reason::Uncertain);
            } else if distance.any() > limits.lost_after {
                self.lost = Some(Reason::NoLandmarks);
            }
        }
        let by_reflectors = distance.reflector <= limits.dead_reckoning_from;
        let by_features = distance.feature <= limits.dead_reckoning_from;
        let suspect = self.drift_check.suspect();
        let remark = if suspect == Some(Suspect::Odometry) { Reason::OdometryDisagrees } else { Reason::None };
        let acceptance = self.consistency.acceptance();
        let (mode, reason) = match (self.lost, self.blindness, by_reflectors, by_features) {
            (Some(reason), ..) => (Mode::Lost, reason),
            (None, Some(blindness), ..) => (Mode::WithoutOdometry, blindness.reason),
            (None, None, false, false) => (Mode::DeadReckoning, Reason::NoLandmarks),
            (None, None, ..) if suspect == Some(Suspect::Laser) => (Mode::Degraded, Reason::LaserMoved),
            (None, None, ..) if self.consistency.is_doubtful() => (Mode::Degraded, Reason::LandmarksRejected),
            (None, None, true, true) => (Mode::Mixed, remark),
            (None, None, true, false) => (Mode::Reflectors, remark),
            (None, None, false, true) => (Mode::Features, remark),
        };
        self.outputs.pose = PoseOutput {
            time: timeline.now(),
            pose: state.pose,
            covariance: state.covariance_entries(),
            mode,
            reason,
            dead_reckoning_distance: distance.any(),
            correction,
            smooth,
            drift: self.drift_check.trend(),
            acceptance,
            normalised_square: self.consistency.mean_normalised_square(),
            ..self.outputs.pose
        };
        if self.outputs.pose.has_jumped() {
            self.outputs.pose.count_reset(correction);
        }
        self.outputs.pose.overflows = self.outputs.pose.overflows.wrapping_add(u8::from(self.outputs.has_cut));
    }
}

/// By how far landmarks have moved the pose in W since the last output, m, beside what the odometry has.
fn correction(last: &PoseOutput, pose: &Pose, smooth: &Pose) -> f64 {
    let is_moved = last.smooth != *smooth;
    let expected = if is_moved { last.pose.compose(&last.smooth.between(smooth)) } else { last.pose };
    libm::hypot(pose.x - expected.x, pose.y - expected.y)
}
