//! Where a vehicle is that has been switched on: reflectors seen while it stands or moves become a pose.
//!
//! It stands beside the [`super::Localizer`] and takes the same events. The pose that it finds is given to the localiser as
//! [`Event::SetPose`], and so is in the record: a replay needs neither the search nor its index.

use heapless::Vec;

use super::start_confirmation::{Belief, Look, StartConfirmation, StartRule};
use super::start_odometry::{Moved, Sight, StartOdometry};
use super::{Event, Parameters, PoseFix};
use crate::geometry::Pose;
use crate::measurement::{LaserId, ReflectorObservation, Scan};
use crate::relocalization::{
    IndexedReflectors, ReflectorAnswer, ReflectorFix, ReflectorNoise, ReflectorRelocalizer, ReflectorSnapshot,
    RelocalizationParameters, RelocalizationProgress,
};
use crate::sensing::detect_reflectors;

/// What is known of the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartState {
    /// No revolution has been seen since the last answer.
    Waiting,
    /// The search is to go on.
    Searching,
    /// The vehicle may be here, but more must be seen before that is believed.
    Unconfirmed(PoseFix),
    /// The vehicle is here.
    Found(PoseFix),
    /// Two poses of R fit almost equally.
    Ambiguous(Pose, Pose),
    /// Too few reflectors have been seen.
    TooFew,
    /// No place of the map looks like what was seen.
    Unknown,
}

/// Most reflectors of one revolution.
const OBSERVATIONS: usize = 64;

/// Distance over which what was seen is carried on, m: then the odometry has carried it too far.
pub(super) const REMEMBERED: f32 = 10.0;

/// A found pose is not surer than this, m and rad: reflectors are passed by a moving vehicle.
const LEAST_DEVIATION: (f64, f64) = (0.014, 0.003);

/// Finds the pose of a vehicle that does not know it.
#[derive(Clone, Debug)]
pub struct StartFinder<const SEEN: usize = 64> {
    parameters: Parameters,
    odometry: StartOdometry,
    /// Reflectors in R as it was at the end of the last motion.
    snapshot: ReflectorSnapshot<SEEN>,
    relocalizer: ReflectorRelocalizer<SEEN>,
    /// Where the odometry had R when the search began, and how many revolutions had been seen; none if no search is under way.
    begun: Option<(Pose, u32)>,
    confirmation: StartConfirmation,
    /// How many revolutions were seen since nothing was known.
    revolutions: u32,
    found: Vec<ReflectorObservation, OBSERVATIONS>,
}

impl<const SEEN: usize> StartFinder<SEEN> {
    /// A finder that has seen nothing, and believes what it finds by that rule.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: Parameters, search: RelocalizationParameters, rule: StartRule) -> Self {
        Self {
            odometry: StartOdometry::new(&parameters),
            snapshot: ReflectorSnapshot::new(),
            relocalizer: ReflectorRelocalizer::new(search),
            begun: None,
            confirmation: StartConfirmation::new(rule),
            revolutions: 0,
            found: Vec::new(),
            parameters,
        }
    }

    /// Takes one event. A revolution begins a search unless one is under way.
    pub fn handle(&mut self, event: &Event, reflectors: &IndexedReflectors) {
        match self.odometry.take(event) {
            Moved::By(motion) => {
                let covariance = &motion.covariance;
                let shift = 0.5 * (covariance.m11 + covariance.m22);
                self.snapshot.travel(&motion.displacement, shift as f32, covariance.m33 as f32);
                self.snapshot.forget_behind(REMEMBERED);
            }
            Moved::Anew => self.begin_anew(),
            Moved::Nothing => {}
        }
        match event {
            Event::Reflectors(seen) => self.revolution(seen.laser, seen.observations, reflectors),
            Event::Scan(scan) => {
                if let Some(detection) = self.parameters.reflectors.detection
                    && !scan.intensities.is_empty()
                {
                    let mut found = core::mem::take(&mut self.found);
                    detect_reflectors(scan, &detection, &mut found);
                    self.revolution(scan.laser, &found, reflectors);
                    self.found = found;
                }
                self.look_through(scan, reflectors);
            }
            _ => {}
        }
    }

    /// Forgets what was seen and how the vehicle moved; a search that is under way is given up.
    pub fn forget(&mut self) {
        self.odometry.forget();
        self.begin_anew();
    }

    fn begin_anew(&mut self) {
        self.snapshot.clear();
        self.begun = None;
        self.confirmation.begin_anew();
        self.revolutions = 0;
    }

    fn revolution(&mut self, laser: LaserId, observations: &[ReflectorObservation], reflectors: &IndexedReflectors) {
        match self.odometry.see(observations.first().map(|first| first.time)) {
            Sight::Usable => {}
            Sight::Anew => self.begin_anew(),
            Sight::Useless => return,
        }
        self.see(laser, observations);
        self.revolutions = self.revolutions.saturating_add(1);
        if self.begun.is_none() {
            self.relocalizer.begin(&self.snapshot, reflectors);
            self.begun = Some((*self.odometry.pose(), self.revolutions));
        }
    }

    /// Looks through the places of reflectors that should be there.
    fn look_through(&mut self, scan: &Scan, reflectors: &IndexedReflectors) {
        let (Some(pose), Some(mount)) =
            (self.confirmation.pose(self.odometry.pose()), self.parameters.lasers.mount(scan.laser))
        else {
            return;
        };
        let middle = scan.start.offset(0.5 * scan.end().since(scan.start));
        let sensor = pose.compose(&self.odometry.recent().pose_at(middle)).compose(mount);
        self.confirmation.look_through(scan, &sensor, reflectors.map());
    }

    /// Goes on with the search that is under way, if one is, until about `effort` is spent: see
    /// [`ReflectorRelocalizer::advance`].
    pub fn search(&mut self, reflectors: &IndexedReflectors, effort: u32) -> StartState {
        let Some((odometry, revolutions)) = self.begun else { return StartState::Waiting };
        let answer = match self.relocalizer.advance(reflectors, effort) {
            RelocalizationProgress::Searching => return StartState::Searching,
            RelocalizationProgress::Done(answer) => answer,
        };
        self.begun = None;
        if let ReflectorAnswer::Found(fix) = answer {
            let look = Look { pose: fix.pose, odometry, revolutions };
            let belief = self.confirmation.take(&look, self.odometry.pose(), &self.snapshot, reflectors);
            let fix = self.fix(&fix, &odometry.between(self.odometry.pose()));
            return match belief {
                Belief::Confirmed => StartState::Found(fix),
                Belief::Open => StartState::Unconfirmed(fix),
                Belief::Contradicted => StartState::Unknown,
            };
        }
        self.confirmation.forget();
        let since = odometry.between(self.odometry.pose());
        match answer {
            ReflectorAnswer::Ambiguous(one, other) => {
                StartState::Ambiguous(one.pose.compose(&since), other.pose.compose(&since))
            }
            ReflectorAnswer::TooFew => StartState::TooFew,
            ReflectorAnswer::Found(_) | ReflectorAnswer::Unknown => StartState::Unknown,
        }
    }

    /// Notes reflectors where they are in R at the end of the last motion.
    fn see(&mut self, laser: LaserId, observations: &[ReflectorObservation]) {
        let believed = &self.parameters.reflectors;
        let noise = ReflectorNoise {
            range: believed.range_deviation as f32,
            bearing: believed.bearing_deviation as f32,
            ..ReflectorNoise::default()
        };
        let (Some(known_from), Some(mount)) = (self.odometry.known_from(), self.parameters.lasers.mount(laser)) else {
            return;
        };
        for observation in observations.iter().filter(|observation| observation.time >= known_from) {
            let position = self.odometry.place(observation, mount);
            self.snapshot.see(&position, f64::from(observation.range), &noise);
        }
    }

    fn fix(&self, fix: &ReflectorFix, since: &Pose) -> PoseFix {
        let covariance = &fix.covariance;
        let position = libm::sqrt(covariance.m11.max(covariance.m22));
        PoseFix {
            time: self.odometry.recent().end(),
            pose: fix.pose.compose(since),
            position_deviation: position.max(LEAST_DEVIATION.0),
            heading_deviation: libm::sqrt(covariance.m33).max(LEAST_DEVIATION.1),
        }
    }
}
