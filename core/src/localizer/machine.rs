//! One event in, outputs out.

use heapless::Vec;
use nalgebra::Matrix2;

use super::maps::{Association, Maps};
use super::output::OBSERVATIONS;
use super::slam::{SLAM_ENTRIES, SLAM_STATES, Seen, Slam, cartesian};
use super::{Event, LandmarkSource, LandmarkUse, Mode, Outputs, Parameters, PoseFix, PoseOutput, Reason};
use crate::features::{Keypoint, KeypointKind, PointScan, SensorPath, detect_reflectors, falko};
use crate::filter::{Cartesian, Consistency, Ekf, Observation, RangeBearing, Timeline};
use crate::geometry::{Point, Pose, difference, wrap};
use crate::landmarks::{DynamicLandmark, DynamicMap, FixedMap, Landmark, LandmarkKind, MapError, Verdict};
use crate::measurement::{EncoderFaults, ReflectorObservation, Scan, Time};
use crate::odometry::{Coasting, Motion, Odometer, OdometryError};
use crate::order::insertion_sort_by;

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
    parameters: Parameters,
    odometer: Odometer,
    maps: Maps<REFLECTORS, FEATURES, DYNAMIC>,
    timeline: Timeline<PAST>,
    slam: Slam<KEYS, LANDMARKS, STATES, ENTRIES>,
    consistency: Consistency,
    lost: Option<Reason>,
    blindness: Option<Blindness>,
    distance: DistanceSince,
    workspace: Workspace<BEAMS>,
    outputs: Outputs,
}

/// Memory that is used within one event only.
#[derive(Clone, Debug)]
struct Workspace<const BEAMS: usize> {
    points: PointScan<BEAMS>,
    path: SensorPath,
    detector: falko::Detector<BEAMS>,
    keypoints: Vec<Keypoint, OBSERVATIONS>,
    reflectors: Vec<ReflectorObservation, OBSERVATIONS>,
    sightings: Vec<Sighting, OBSERVATIONS>,
}

/// One observation of one event.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    time: Time,
    kind: LandmarkKind,
    observation: Observation,
    /// Direction of a feature in S, rad.
    orientation: f32,
    /// What is left to do for the dynamic map: the landmark that it belongs to, or none if it is new.
    matched: Option<u16>,
    verdict: Verdict,
}

/// The odometry is not believed.
#[derive(Clone, Copy, Debug)]
struct Blindness {
    reason: Reason,
    coasting: Coasting,
}

/// Way since something last happened, m.
#[derive(Clone, Copy, Debug)]
struct DistanceSince {
    reflector: f64,
    feature: f64,
    fix: f64,
}

impl DistanceSince {
    const NEVER: Self = Self { reflector: f64::INFINITY, feature: f64::INFINITY, fix: f64::INFINITY };

    fn any(&self) -> f64 {
        self.reflector.min(self.feature).min(self.fix)
    }

    fn advance(&mut self, distance: f64) {
        self.reflector += distance;
        self.feature += distance;
        self.fix += distance;
    }
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
            acceptance: 1.0,
            normalised_square: 2.0,
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
            outputs: Outputs { pose, uses: Vec::new() },
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
                see_reflectors(&self.parameters, reflectors.observations, &mut self.workspace.sightings);
                if self.parameters.maps.slam {
                    self.fuse_reflectors_by_slam();
                } else {
                    self.fuse();
                }
            }
            Event::Reflectors(_) => {}
            Event::Scan(scan) => self.scan(scan),
            Event::SetPose(fix) => self.set_pose(fix),
        }
        self.publish(matches!(event, Event::Reflectors(_) | Event::Scan(_)));
        &self.outputs
    }

    fn set_pose(&mut self, fix: &PoseFix) {
        if !fix.is_sound() {
            return;
        }
        let pose = Pose { theta: wrap(fix.pose.theta), ..fix.pose };
        let state = Ekf::new(pose, fix.position_deviation, fix.heading_deviation);
        self.timeline.begin(fix.time, state);
        self.slam.begin(fix.time, &state, &self.parameters.slam);
        self.consistency = Consistency::new(self.parameters.consistency);
        self.lost = None;
        self.blindness =
            self.blindness.map(|blindness| Blindness { coasting: Coasting::new(Motion::none(fix.time)), ..blindness });
        self.distance = DistanceSince { fix: 0.0, ..DistanceSince::NEVER };
        self.maps.dynamic.clear();
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
            detect_reflectors(scan, detection, &mut workspace.reflectors);
            workspace.sightings.clear();
            see_reflectors(&self.parameters, &workspace.reflectors, &mut workspace.sightings);
            if maps.slam {
                self.fuse_reflectors_by_slam();
            } else {
                self.fuse();
            }
        }
        if maps.slam {
            self.fuse_scan_by_slam(scan);
        } else if maps.features || maps.dynamic {
            self.workspace.see_features(&self.parameters, scan);
            self.fuse();
            self.update_dynamic_map();
        }
    }

    /// Fuses the sightings of the workspace, each at its own time, and brings the dynamic map up to date.
    fn fuse(&mut self) {
        let Some(timeline) = self.timeline.begun_mut().filter(|_| self.lost.is_none()) else {
            return;
        };
        let (mut expected, mut accepted, mut used, mut square_sum) = (0, 0, 0, 0.0);
        for sighting in &mut self.workspace.sightings {
            let mut association = Association::NONE;
            let mut located = [0.0; 2];
            let outcome = timeline.correct(sighting.time, |state| {
                located = sighting.observation.locate(&state.pose, &self.parameters.laser).into();
                association = self.maps.associate(&self.parameters, state, sighting.kind, &sighting.observation);
                association.correction(&sighting.observation)
            });
            if outcome.is_err() {
                association.verdict = Verdict::OutOfTime;
            }
            let is_accepted = outcome == Ok(true);
            let is_fixed = association.nearest.is_none_or(|landmark| landmark.source == LandmarkSource::Fixed);
            let is_reflector = sighting.kind == LandmarkKind::Reflector;
            // Two landmarks that fit equally say nothing against the pose, nor does a feature that no map has.
            let is_evidence = outcome.is_ok()
                && is_fixed
                && association.verdict != Verdict::Ambiguous
                && (is_reflector || association.nearest.is_some());
            if is_evidence {
                expected += 1;
                accepted += usize::from(is_accepted);
            }
            if let Some(landmark) = association.nearest.filter(|_| is_accepted) {
                used += 1;
                square_sum += landmark.innovation.normalised_square;
                if is_reflector {
                    self.distance.reflector = 0.0;
                } else {
                    self.distance.feature = 0.0;
                }
            }
            sighting.verdict = association.verdict;
            sighting.matched = association
                .nearest
                .filter(|landmark| is_accepted && landmark.source == LandmarkSource::Dynamic)
                .map(|landmark| landmark.id);
            let position = sighting.observation.position();
            let _ = self.outputs.uses.push(LandmarkUse {
                time: sighting.time,
                kind: sighting.kind,
                landmark: association.nearest.map(|landmark| (landmark.source, landmark.id)),
                verdict: association.verdict,
                position: [position.x as f32, position.y as f32],
                located,
                residual: association.nearest.map_or([0.0; 2], |landmark| landmark.innovation.residual.into()),
                residual_deviation: association.nearest.map_or([0.0; 2], |landmark| {
                    let covariance = &landmark.innovation.covariance;
                    [libm::sqrt(covariance.m11), libm::sqrt(covariance.m22)]
                }),
                test_ratio: association
                    .nearest
                    .map_or(0.0, |landmark| landmark.innovation.normalised_square / self.parameters.association.gate),
            });
        }
        self.consistency.add(expected, accepted, used, square_sum);
        if self.consistency.is_rejecting() {
            self.lost = Some(Reason::LandmarksRejected);
        } else if self.consistency.is_surprised() {
            self.lost = Some(Reason::InnovationsTooLarge);
        }
    }

    /// Fuses the reflectors of the workspace, all at the time of the one in the middle.
    fn fuse_reflectors_by_slam(&mut self) {
        let sightings = &self.workspace.sightings;
        let (Some(first), Some(last)) = (sightings.first(), sightings.last()) else { return };
        let (start, end) = (first.time, last.time);
        let time = start.offset(0.5 * end.since(start));
        let Some(timeline) = self.timeline.begun() else { return };
        self.workspace.path.set(start, &self.parameters.laser, timeline.relative_path(start, end));
        if self.begin_slam(time, end) {
            self.fuse_by_slam(start);
            self.end_slam();
        }
    }

    /// Fuses the natural features of a scan, and the scan itself, at the time of its middle.
    fn fuse_scan_by_slam(&mut self, scan: &Scan) {
        self.workspace.see_features(&self.parameters, scan);
        if !self.begin_slam(scan.beam_time(scan.ranges.len() / 2), scan.end()) {
            return;
        }
        if !self.slam.wants_scan(&self.parameters.slam) {
            return;
        }
        let place = self.workspace.path.place(self.slam.time().since(scan.start));
        self.slam.align(&self.workspace.points, &place, &self.parameters);
        self.fuse_by_slam(scan.start);
        self.slam.finish(&self.parameters.slam);
        self.slam.keep(&self.workspace.points, &place, &self.parameters);
        self.end_slam();
    }

    /// Brings the filter to `time`, or where it is if that is later, but not beyond `latest`. False if it cannot be there.
    fn begin_slam(&mut self, time: Time, latest: Time) -> bool {
        let Some(timeline) = self.timeline.begun().filter(|_| self.lost.is_none()) else { return false };
        if self.slam.time() > latest {
            return false;
        }
        self.slam.advance(time, timeline, self.parameters.vehicle.steering_lever());
        true
    }

    fn end_slam(&mut self) {
        // The filter's time is one that the timeline remembers.
        let _ = self.timeline.set_state(self.slam.time(), self.slam.state());
    }

    /// Fuses the sightings of the workspace at the filter's time; its path begins at `start`.
    fn fuse_by_slam(&mut self, start: Time) {
        let (mut expected, mut accepted, mut used, mut square_sum) = (0, 0, 0, 0.0);
        // A vehicle without a map of reflectors finds them on its way.
        let reflectors_are_given = !self.maps.reflectors.landmarks().is_empty();
        let now = self.slam.time().since(start);
        let path = &self.workspace.path;
        for sighting in &mut self.workspace.sightings {
            let mut seen = cartesian(&sighting.observation);
            seen.position = path.from_start(now, &path.to_start(sighting.time.since(start), &seen.position));
            let seen = Seen { kind: sighting.kind, cartesian: seen, orientation: sighting.orientation };
            let fate = self.slam.see(&seen, &self.maps, &self.parameters);
            let is_reflector = sighting.kind == LandmarkKind::Reflector;
            let is_accepted = fate.verdict == Verdict::Accepted;
            let is_fixed = fate.landmark.is_none_or(|(source, ..)| source == LandmarkSource::Fixed);
            let is_expected = is_reflector && reflectors_are_given;
            if is_fixed && fate.verdict != Verdict::Ambiguous && (is_expected || fate.landmark.is_some()) {
                expected += 1;
                accepted += usize::from(is_accepted);
            }
            if let Some((_, _, innovation)) = fate.landmark.filter(|_| is_accepted) {
                used += 1;
                square_sum += innovation.normalised_square;
                if is_reflector {
                    self.distance.reflector = 0.0;
                } else {
                    self.distance.feature = 0.0;
                }
            }
            sighting.verdict = fate.verdict;
            let position = sighting.observation.position();
            let _ = self.outputs.uses.push(LandmarkUse {
                time: sighting.time,
                kind: sighting.kind,
                landmark: fate.landmark.map(|(source, id, _)| (source, id)),
                verdict: fate.verdict,
                position: [position.x as f32, position.y as f32],
                located: fate.located.into(),
                residual: fate.landmark.map_or([0.0; 2], |(_, _, innovation)| innovation.residual.into()),
                residual_deviation: fate.landmark.map_or([0.0; 2], |(_, _, innovation)| {
                    [libm::sqrt(innovation.covariance.m11), libm::sqrt(innovation.covariance.m22)]
                }),
                test_ratio: fate
                    .landmark
                    .map_or(0.0, |(_, _, innovation)| innovation.normalised_square / self.parameters.association.gate),
            });
        }
        // What fits no landmark is new, once the whole scan has corrected the pose.
        for sighting in &self.workspace.sightings {
            let may_be_new = sighting.kind != LandmarkKind::Reflector || !reflectors_are_given;
            if may_be_new && matches!(sighting.verdict, Verdict::Unknown | Verdict::Gated) {
                let mut seen = cartesian(&sighting.observation);
                seen.position = path.from_start(now, &path.to_start(sighting.time.since(start), &seen.position));
                let seen = Seen { kind: sighting.kind, cartesian: seen, orientation: sighting.orientation };
                self.slam.discover(&seen, &self.parameters);
            }
        }
        self.consistency.add(expected, accepted, used, square_sum);
        if self.consistency.is_rejecting() {
            self.lost = Some(Reason::LandmarksRejected);
        } else if self.consistency.is_surprised() {
            self.lost = Some(Reason::InnovationsTooLarge);
        }
    }

    /// Algorithm 1 (K 5.4.1) for the natural features of one scan, at the poses that the whole scan has led to.
    fn update_dynamic_map(&mut self) {
        let Some(timeline) = self.timeline.begun_mut().filter(|_| self.parameters.maps.dynamic) else {
            return;
        };
        for sighting in &self.workspace.sightings {
            let Ok(state) = timeline.state_at(sighting.time) else {
                continue;
            };
            let position = sighting.observation.locate(&state.pose, &self.parameters.laser);
            match (sighting.matched, sighting.verdict) {
                (Some(id), _) => self.maps.dynamic.update(id, position),
                (None, Verdict::Unknown | Verdict::Gated) => self.maps.dynamic.insert(sighting.kind, position),
                _ => {}
            }
        }
        self.maps.dynamic.finish();
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
        let (mode, reason) = match (self.lost, self.blindness, by_reflectors, by_features) {
            (Some(reason), ..) => (Mode::Lost, reason),
            (None, Some(blindness), ..) => (Mode::WithoutOdometry, blindness.reason),
            (None, None, true, true) => (Mode::Mixed, Reason::None),
            (None, None, true, false) => (Mode::Reflectors, Reason::None),
            (None, None, false, true) => (Mode::Features, Reason::None),
            (None, None, false, false) => (Mode::DeadReckoning, Reason::NoLandmarks),
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
            acceptance: self.consistency.acceptance(),
            normalised_square: self.consistency.mean_normalised_square(),
        };
    }
}

/// By how far landmarks have moved the pose in W since the last output, m, beside what the odometry has.
fn correction(last: &PoseOutput, pose: &Pose, smooth: &Pose) -> f64 {
    let is_moved = last.smooth != *smooth;
    let expected = if is_moved { last.pose.compose(&last.smooth.between(smooth)) } else { last.pose };
    libm::hypot(pose.x - expected.x, pose.y - expected.y)
}

impl<const BEAMS: usize> Workspace<BEAMS> {
    /// Finds the natural features of a scan. They are found in the scan as it would look from the first beam's place,
    /// and observed from where the sensor was at their own beam. Their covariance is not turned between the two.
    fn see_features(&mut self, parameters: &Parameters, scan: &Scan) {
        let features = &parameters.features;
        self.points.set(scan, features.nearest, features.farthest);
        if features.motion_correction {
            self.path.correct(scan, &mut self.points);
        }
        self.detector.detect(&self.points, &mut self.keypoints);
        insertion_sort_by(&mut self.keypoints, |a, b| a.beam.cmp(&b.beam));
        self.sightings.clear();
        let added = features.added_deviation * features.added_deviation;
        for keypoint in &self.keypoints {
            let beam = usize::from(keypoint.beam);
            let position = Point::new(f64::from(keypoint.position.x), f64::from(keypoint.position.y));
            let position = if features.motion_correction {
                self.path.from_start(beam as f64 * scan.beam_interval, &position)
            } else {
                position
            };
            let [xx, xy, yy] = keypoint.covariance.map(f64::from);
            let _ = self.sightings.push(Sighting {
                time: scan.beam_time(beam),
                kind: match keypoint.kind {
                    KeypointKind::Corner => LandmarkKind::Corner,
                    KeypointKind::EndPoint => LandmarkKind::EndPoint,
                },
                observation: Observation::Cartesian(Cartesian {
                    position,
                    covariance: Matrix2::new(xx + added, xy, xy, yy + added),
                }),
                orientation: keypoint.orientation,
                matched: None,
                verdict: Verdict::Unknown,
            });
        }
    }
}

/// Observations of reflectors as the filter takes them.
fn see_reflectors(
    parameters: &Parameters,
    observations: &[ReflectorObservation],
    sightings: &mut Vec<Sighting, OBSERVATIONS>,
) {
    let reflectors = &parameters.reflectors;
    for observation in observations {
        if !(observation.range.is_finite() && observation.bearing.is_finite()) {
            continue;
        }
        let observation_model = Observation::RangeBearing(RangeBearing {
            range: f64::from(observation.range),
            bearing: difference(f64::from(observation.bearing), 0.0),
            range_variance: reflectors.range_deviation * reflectors.range_deviation,
            bearing_variance: reflectors.bearing_deviation * reflectors.bearing_deviation,
        });
        // A revolution with more reflectors than there is room for keeps the first ones.
        let _ = sightings.push(Sighting {
            time: observation.time,
            kind: LandmarkKind::Reflector,
            observation: observation_model,
            orientation: 0.0,
            matched: None,
            verdict: Verdict::Unknown,
        });
    }
}
