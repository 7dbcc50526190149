//! One event in, outputs out.

use heapless::Vec;

use super::contours::ContourCorrection;
use super::evidence::DistanceSince;
use super::slam::Slam;
use super::start_watch::StartWatch;
use super::supervisor::{Support, remark_on_motion, supervise};
use super::travel::Outage;
use super::{
    Capacities, ContourCapacities, ContourSearch, Event, Localize, Misuse, Mode, Outputs, Parameters, PoseOutput,
    PredictionState, Reason, StateError, StatedCapacities,
};
use crate::filter::Timeline;
use crate::geometry::{Point, Pose};
use crate::integrity::separation::SolutionSeparation;
use crate::integrity::{Estimate, Integrity, ProtectionLevel, is_sure};
use crate::maps::{DynamicLandmark, Landmark, LandmarkKind, LendError, MapError, MapView, Verdict};
use crate::measurement::{LaserId, Reflectors, Scan, Time};
use crate::odometry::{GyroErrors, Motion, OdometryBias, OdometryError, UnknownAcceleration, VehicleOdometer};
use crate::sensing::detect_reflectors;
use crate::sources::{
    AddLandmarks, Aid, AidOutcome, ContoursBehind, FindContours, FindFeatures, GyroSource, LandmarkMaps, LaserOdometry,
    LendLandmarks, Source, Statuses, Workspace, correct_by_aid, see_reflectors,
};
use crate::state::LevelGrowth;

/// Entries of the filter's past: about 0.4 s at 100 samples and 230 corrections a second.
const PAST: usize = 128;

/// Localises one vehicle. All of its memory is in this value.
///
/// `C` says how much it has room for.
#[derive(Clone, Debug)]
pub struct Localizer<C: Capacities = ContourCapacities<'static>> {
    pub(super) parameters: Parameters,
    pub(super) odometer: VehicleOdometer,
    pub(super) maps: C::Maps,
    pub(super) timeline: Timeline<PAST>,
    pub(super) slam: Slam<C::Slots>,
    pub(super) integrity: Integrity,
    /// Before the first pose.
    pub(super) start_watch: StartWatch,
    pub(super) separation: SolutionSeparation,
    /// Of a vehicle with a gyro.
    pub(super) gyro: Option<GyroSource>,
    pub(super) lost: Option<Reason>,
    pub(super) outage: Option<Outage>,
    /// Samples of the odometry in a row that were not later than the one before.
    pub(super) repeated: u8,
    pub(super) distance: DistanceSince,
    pub(super) features: C::Features,
    pub(super) contours: C::Contours,
    pub(super) behind: ContoursBehind,
    pub(super) contour_correction: ContourCorrection,
    pub(super) laser_odometry: LaserOdometry,
    pub(super) workspace: Workspace,
    pub(super) growth: LevelGrowth,
    pub(super) outputs: Outputs,
}

/// An aid with so many numbers says all of the pose: the vehicle rests on it as on features.
const WHOLE_POSE: usize = 3;

impl<C: Capacities> Localizer<C>
where
    C::Maps: AddLandmarks,
{
    /// Adds landmarks to the fixed maps, each to the one of its kind.
    ///
    /// # Errors
    /// [`MapError`] if a landmark does not fit; those before it are in the map.
    pub fn add_landmarks(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        self.maps.add(landmarks)
    }

    /// Replaces all landmarks of the fixed maps, also while the vehicle drives: what is seen next is compared with the new
    /// ones. What was found while driving remains, as it may be on none of them.
    ///
    /// # Errors
    /// [`MapError`] if the landmarks do not fit; the maps are as before then.
    pub fn replace_landmarks(&mut self, landmarks: &[Landmark]) -> Result<(), MapError> {
        self.maps.replace(landmarks)?;
        self.slam.forget_given();
        Ok(())
    }
}

impl<'m, C: Capacities> Localizer<C>
where
    C::Maps: LendLandmarks<'m>,
{
    /// Takes landmarks, reflectors and then features ([`crate::maps::put_reflectors_first`]), as the fixed maps instead of those
    /// before, also while the vehicle drives. They stay where they are.
    ///
    /// # Errors
    /// [`LendError`] if the landmarks do not fit or are in another order; the maps are as before then.
    pub fn lend_landmarks(&mut self, landmarks: &'m [Landmark]) -> Result<(), LendError> {
        self.maps.lend(landmarks)?;
        self.slam.forget_given();
        Ok(())
    }
}

impl<C: Capacities> Localizer<C> {
    /// How much it has room for.
    pub const CAPACITIES: StatedCapacities = StatedCapacities {
        landmarks: C::Maps::FIXED as u32,
        beams: C::Features::BEAMS as u32,
        history: PAST as u32,
        contours: C::Contours::POINTS as u32,
    };

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
            level: ProtectionLevel::UNBOUNDED,
            acceptance: 1.0,
            normalised_square: 2.0,
            resets: 0,
            last_reset: 0.0,
            overflows: 0,
        };
        Self {
            odometer: VehicleOdometer::new(&parameters.vehicle, &parameters.odometer()),
            maps: C::Maps::new(parameters.dynamic_map),
            timeline: Timeline::new(
                parameters.limits.longest_extrapolation,
                UnknownAcceleration::of(&parameters.vehicle, &parameters.odometry_noise),
            ),
            slam: Slam::new(),
            integrity: Integrity::new(parameters.consistency),
            start_watch: StartWatch::new(&parameters),
            separation: Self::separation(&parameters),
            gyro: parameters.uses_gyro().then(|| GyroSource::new(&parameters.gyro)),
            lost: None,
            outage: None,
            repeated: 0,
            distance: DistanceSince::NEVER,
            features: C::Features::new(parameters.features.detector),
            contours: C::Contours::new(),
            behind: ContoursBehind::new(),
            contour_correction: ContourCorrection::None,
            laser_odometry: LaserOdometry::new(),
            workspace: Workspace::default(),
            growth: LevelGrowth::NONE,
            outputs: Outputs { pose, uses: Vec::new(), sources: Statuses::default(), misuse: None, has_cut: false },
            parameters,
        }
    }

    fn separation(parameters: &Parameters) -> SolutionSeparation {
        let gyro = parameters.uses_gyro().then_some(&parameters.gyro);
        SolutionSeparation::of(parameters.assumed, &parameters.vehicle, gyro)
    }

    /// What the localiser believes of its vehicle and its sensors.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The landmarks that were found while driving.
    #[must_use]
    pub fn dynamic_landmarks(&self) -> &[DynamicLandmark] {
        self.maps.found()
    }

    /// The map of the reflectors.
    #[must_use]
    pub fn reflectors(&self) -> MapView<'_> {
        self.maps.reflectors()
    }

    /// The map of the natural features.
    #[must_use]
    pub fn features(&self) -> MapView<'_> {
        self.maps.features()
    }

    /// The landmarks in the state of the filter, those too that were given: kind and position in W, m.
    pub fn state_landmarks(&self) -> impl Iterator<Item = (LandmarkKind, Point)> + '_ {
        self.slam.landmarks()
    }

    /// What has been learnt of the odometry's lasting errors, and is taken from its motions; none without SLAM.
    #[must_use]
    pub fn odometry_bias(&self) -> OdometryBias {
        if self.parameters.maps.slam { self.slam.bias() } else { OdometryBias::default() }
    }

    /// What has been learnt of the errors of the gyro that tells the turns; none if none does.
    #[must_use]
    pub fn gyro_errors(&self) -> Option<GyroErrors> {
        Some(*self.gyro.as_ref()?.state().errors())
    }

    /// What carries the pose on until the next event.
    #[must_use]
    pub fn prediction_state(&self) -> PredictionState {
        PredictionState { bias: self.odometry_bias(), gyro: self.gyro_errors(), growth: self.growth }
    }

    /// What the last event gave.
    #[must_use]
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// Takes one event. Events of one sensor come in order of time. Those of the laser may be as late as the filter
    /// remembers, about 0.4 s, and ahead of the odometry by [`super::Limits::longest_extrapolation`]; an odometry that is
    /// further behind is silent.
    pub fn handle(&mut self, event: &Event) -> &Outputs {
        self.begin_event();
        if self.timeline.begun().is_none() {
            self.watch_start(event);
        }
        if let Some((from, until)) = event.seen().filter(|(_, until)| *until > self.timeline.now()) {
            self.bridge(from, until);
        }
        let sees = matches!(event, Event::Reflectors(_) | Event::Scan(_));
        let before = if sees { self.estimate() } else { None };
        let known = if sees && self.gyro.is_some() { self.known_pose() } else { None };
        let revolution_of = if sees && self.tells_reflectors(event) { event.laser() } else { None };
        // Samples of the odometry come ten times as often as all else: what they do not need is never inlined here.
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
            Event::Wheels(sample) => {
                let found = self.odometer.wheels_with_slip(sample);
                self.compare_wheels(&found);
                self.move_by(sample.time, found.map(|(motion, _)| motion));
            }
            Event::Gyro(sample) => self.turn_rate(sample),
            Event::Reflectors(seen) => self.reflectors_of(seen),
            Event::Scan(scan) => self.scan(scan),
            Event::SetPose(fix) => self.set_pose(fix),
        }
        if let Some(known) = known {
            let is_corrected = self.outputs.uses.iter().any(|seen| seen.verdict == Verdict::Accepted);
            self.teach_gyro(&known, is_corrected);
        }
        if let Some(before) = before {
            self.check(&before, revolution_of, event);
            self.correct_coasting();
            self.follow_surfaces(event);
            self.separate(event.laser());
        }
        self.publish(sees);
        &self.outputs
    }

    /// Takes a motion of a vehicle that is none of [`crate::odometry::Vehicle`], or why there is none; `time` is that of the
    /// report which has told it. An [`crate::odometry::Odometer`] makes it of what the vehicle reports.
    pub fn travel(&mut self, time: Time, motion: Result<Motion, OdometryError>) -> &Outputs {
        self.begin_event();
        self.move_by(time, motion);
        self.publish(false);
        &self.outputs
    }

    /// Takes an observation with a model of its own. With landmarks in the state there is no place for it yet: it is told to
    /// be out of time then.
    pub fn aid<const SIZE: usize>(&mut self, aid: &impl Aid<SIZE>) -> AidOutcome {
        let time = aid.time();
        let known = if self.gyro.is_some() { self.known_pose() } else { None };
        self.begin_event();
        let is_taken = self.parameters.sources.aids && !self.parameters.maps.slam && self.lost.is_none();
        let Some(timeline) = self.timeline.begun_mut().filter(|_| is_taken) else { return AidOutcome::OUT_OF_TIME };
        let Ok(mut state) = timeline.state_at(time) else { return AidOutcome::OUT_OF_TIME };
        let outcome = correct_by_aid(&mut state, aid);
        if outcome.verdict == Verdict::Accepted {
            // The state of that time was there just now.
            let _ = timeline.set_state(time, state);
            if SIZE >= WHOLE_POSE {
                self.distance.feature = 0.0;
            }
        }
        let status = &mut self.outputs.sources.aids;
        status.begin(time);
        status.add(time, outcome.verdict, outcome.verdict == Verdict::Accepted, outcome.test_ratio);
        if let Some(known) = known {
            self.teach_gyro(&known, outcome.verdict == Verdict::Accepted);
        }
        self.separate(None);
        self.publish(true);
        outcome
    }

    #[inline(never)]
    fn watch_start(&mut self, event: &Event) {
        self.start_watch.take(event, &self.parameters, &mut self.integrity);
    }

    fn begin_event(&mut self) {
        self.outputs.uses.clear();
        self.outputs.has_cut = false;
        self.outputs.misuse = None;
        self.contour_correction = ContourCorrection::None;
    }

    /// The pose for now, and that by odometry alone.
    pub(super) fn estimate(&mut self) -> Option<Estimate> {
        let timeline = self.timeline.begun_mut()?;
        let state = timeline.state();
        let odometry_pose = *timeline.odometry_pose();
        let (is_sure, distance) = (is_sure(&state), self.distance.any());
        Some(Estimate { pose: state.pose, odometry_pose, covariance: state.covariance(), is_sure, distance })
    }

    /// Lets the checks compare what an event has shown with what the odometry says; `before` is the estimate before it was
    /// used, and `revolution_of` is the laser whose reflectors of a revolution the event tells, if it does: one that tells
    /// none contradicts none.
    #[inline(never)]
    fn check(&mut self, before: &Estimate, revolution_of: Option<LaserId>, event: &Event) {
        let Some(after) = self.estimate() else { return };
        let uses = &self.outputs.uses;
        // A motion that nobody has measured contradicts nothing.
        if let Some(laser) = revolution_of.filter(|_| self.outage.is_none()) {
            let to_odometry = before.odometry_pose.compose(&before.pose.inverse());
            let slips = self.integrity.see_reflectors(laser, self.timeline.now(), &to_odometry, uses);
            // What SLAM has not seen before is in no map.
            if self.has_reflectors() && !self.parameters.maps.slam {
                self.integrity.compare_with_map(laser, uses);
            }
            if slips && self.lost.is_none() {
                self.lost = Some(Reason::MotionDisagrees);
            }
        }
        // What contours have moved is no correction by landmarks.
        if matches!(self.contour_correction, ContourCorrection::None) {
            let is_right = self.lost.is_none() && self.outage.is_none();
            self.integrity.correct(before, &after, uses, is_right);
            if is_right && !self.parameters.maps.slam {
                self.integrity.judge_traction(before, &after, uses, self.timeline.now());
            }
        }
        if let Event::Scan(scan) = event {
            self.compare_surfaces(scan);
        }
    }

    /// Lets the checks compare a scan with the reflectors of its revolution, which were taken just before, and with the scan before it.
    fn compare_surfaces(&mut self, scan: &Scan) {
        let is_known = self.lost.is_none() && self.outage.is_none();
        let is_asked = is_known && self.parameters.uses_reflectors() && self.has_reflectors();
        let Some(timeline) = self.timeline.begun().filter(|_| is_asked) else { return };
        let Some(mount) = self.parameters.lasers.mount(scan.laser) else { return };
        let since = timeline.displacement(scan.start, timeline.now());
        let first = timeline.odometry_pose().compose(&since.inverse()).compose(mount);
        let path = &mut self.workspace.path;
        path.set(scan.start, mount, timeline.relative_path(scan.start, scan.end()));
        if self.integrity.see_scan(scan, |after| first.compose(&path.place(after))) {
            self.lost = Some(Reason::MotionDisagrees);
        }
    }

    /// Whether an event tells which reflectors one revolution has seen, be it none. Not every scan does: the laser may have
    /// told its reflectors before.
    fn tells_reflectors(&self, event: &Event) -> bool {
        match event {
            Event::Reflectors(_) => self.parameters.uses_reflectors(),
            Event::Scan(scan) => self.parameters.detection_in(scan).is_some(),
            _ => false,
        }
    }

    /// Takes reflectors that a laser has found.
    #[inline(never)]
    fn reflectors_of(&mut self, seen: &Reflectors) {
        if !self.parameters.uses_reflectors() {
            return;
        }
        let Some(mount) = self.parameters.lasers.mount(seen.laser).copied() else {
            self.outputs.misuse = Some(Misuse::UnknownLaser);
            return;
        };
        let time = seen.observations.first().map_or(self.timeline.now(), |first| first.time);
        self.outputs.sources.reflectors.begin(time);
        self.workspace.sightings.clear();
        self.outputs.has_cut |=
            see_reflectors(&self.parameters.reflectors, &mount, seen, &mut self.workspace.sightings);
        if self.parameters.maps.slam {
            self.fuse_lone_reflectors_by_slam(&mount);
        } else {
            self.fuse(self.timeline.now());
        }
    }

    #[inline(never)]
    fn scan(&mut self, scan: &Scan) {
        let Some(mount) = self.parameters.lasers.mount(scan.laser).copied() else {
            self.outputs.misuse = Some(Misuse::UnknownLaser);
            return;
        };
        let Some(timeline) = self.timeline.begun() else {
            return;
        };
        let maps = self.parameters.maps;
        let is_whole = maps.features || maps.dynamic || maps.slam || self.uses_contours();
        let workspace = &mut self.workspace;
        if is_whole {
            workspace.path.set(scan.start, &mount, timeline.relative_path(scan.start, scan.end()));
        }
        if let Some(detection) = self.parameters.detection_in(scan) {
            self.outputs.has_cut |= detect_reflectors(scan, detection, &mut workspace.reflectors) > 0;
            workspace.sightings.clear();
            let seen = Reflectors { laser: scan.laser, observations: &workspace.reflectors };
            self.outputs.sources.reflectors.begin(scan.start);
            see_reflectors(&self.parameters.reflectors, &mount, &seen, &mut workspace.sightings);
            if maps.slam {
                self.fuse_reflectors_by_slam(scan.start);
            } else {
                self.fuse(scan.start);
            }
        }
        for source in [Source::Corners, Source::EndPoints] {
            if self.parameters.sources.of(source) {
                self.outputs.sources.of_mut(source).begin(scan.start);
            }
        }
        if is_whole {
            self.outputs.has_cut |= self.features.take(&self.workspace.path, &self.parameters.features, scan);
        }
        if maps.slam {
            return self.fuse_scan_by_slam(&mount, scan);
        }
        if self.uses_contours() {
            self.fuse_contours(&mount, scan);
        }
        if maps.features || maps.dynamic {
            self.find_features(&mount, scan);
            self.fuse(scan.start);
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
        let support = Support {
            by_reflectors: distance.reflector <= limits.dead_reckoning_from,
            by_features: distance.feature <= limits.dead_reckoning_from,
        };
        let outage = self.outage.map(|outage| outage.reason);
        let is_elsewhere = self.separation.contradicts_surfaces();
        let motion = remark_on_motion(&self.integrity, self.gyro.is_some(), is_elsewhere, timeline.now());
        let (mode, reason) = supervise(self.lost, outage, motion, support, &self.integrity, timeline.now());
        self.outputs.pose = PoseOutput {
            time: timeline.now(),
            pose: state.pose,
            covariance: state.covariance_entries(),
            mode,
            reason,
            dead_reckoning_distance: distance.any(),
            correction,
            smooth,
            level: self.separation.level(),
            acceptance: self.integrity.innovations.acceptance(),
            normalised_square: self.integrity.innovations.mean_normalised_square(),
            ..self.outputs.pose
        };
        if self.outputs.pose.has_jumped() {
            self.outputs.pose.count_reset(correction);
        }
        self.outputs.pose.overflows = self.outputs.pose.overflows.wrapping_add(u8::from(self.outputs.has_cut));
    }
}

impl<C: Capacities> Localize for Localizer<C> {
    type Contours = C::Contours;

    fn handle(&mut self, event: &Event) -> &Outputs {
        self.handle(event)
    }

    fn outputs(&self) -> &Outputs {
        self.outputs()
    }

    fn prediction_state(&self) -> PredictionState {
        self.prediction_state()
    }

    fn reflectors(&self) -> MapView<'_> {
        self.reflectors()
    }

    fn features(&self) -> MapView<'_> {
        self.features()
    }

    fn for_search(&mut self) -> (MapView<'_>, ContourSearch<'_, C::Contours>) {
        self.for_search()
    }

    fn save_state(&self, room: &mut [u8]) -> Result<usize, StateError> {
        self.save_state(room)
    }
}

/// By how far landmarks have moved the pose in W since the last output, m, beside what the odometry has.
fn correction(last: &PoseOutput, pose: &Pose, smooth: &Pose) -> f64 {
    let is_moved = last.smooth != *smooth;
    let expected = if is_moved { last.pose.compose(&last.smooth.between(smooth)) } else { last.pose };
    libm::hypot(pose.x - expected.x, pose.y - expected.y)
}
