//! Whether a controller was right, and knew how wrong it might be: what its bus says, every 10 ms, against the truth at the
//! time that it states.
//!
//! | word | meaning |
//! |---|---|
//! | fresh | at most 0.1 s old |
//! | claim | fresh, and the mode is neither `not_localised` nor `lost` |
//! | misleading (MI) | a claim whose error is above its protection level |
//! | hazardous (HMI) | a claim whose error is above an alert limit that its protection level is within |
//! | event | hazardous outputs less than 1 s apart |
//! | integrity failure | an event with more than 0.3 s, or more than 0.5 m driven, in hazardous outputs |
//! | hidden | hazardous while no sensor of the vehicle can tell the fault: counts apart, in events of its own |
//! | available | a claim with a protection level within the alert limit, from the first claim on |
//! | loss | the end of availability, but where no reflectors are; losses within 10 s are one |
//!
//! Of position and heading, one above its bound counts as above; to be within, both must be.

use agv_core::geometry::{Pose, difference};
use agv_core::integrity::{Alarm, AlertLimit, AlertLimits, ProtectionLevel};
use agv_core::measurement::Time;
use agv_core::state::{Mode, Reason};
use agv_wire::can::controller::PublishedPose;

use super::outcome::{Found, Outcome};
use super::stanford;

/// Time between two outputs that are judged, s.
pub const STEP: f64 = 0.01;

/// An output older than this, s, says nothing of the present.
const STALE: f64 = 0.1;
/// Hazardous outputs less than this apart, s, are one event.
const SAME_EVENT: f64 = 1.0;
/// Time and distance in hazardous outputs that an event may have, s and m.
const TOLERATED: (f64, f64) = (0.3, 0.5);
/// Losses of availability less than this apart, s, are one.
const SAME_LOSS: f64 = 10.0;
/// How long the end of a run must be right for the vehicle to count as recovered, s.
const RIGHT_AT_THE_END: f64 = 5.0;

/// An error is told as no more than this many times the protection level.
pub const MOST_OVER: f64 = 1e9;

/// What the bus says at one moment, and what is true.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Now.
    pub now: Time,
    /// The last pose that was heard, and the time that it states.
    pub heard: Option<(&'a PublishedPose, Time)>,
    /// Where the vehicle was at that time.
    pub truth: Option<Pose>,
    /// Distance driven since the moment before, m.
    pub driven: f64,
    /// Whether the vehicle is near a station at which it docks, with what docking asks for in sight.
    pub docks: bool,
    /// Whether 90 deg were turned, and four reflectors were in sight in each of the last 16 revolutions.
    pub is_nominal: bool,
    /// Whether the vehicle is where there are no reflectors: losing availability there is no loss of continuity.
    pub is_bare: bool,
    /// Whether a fault has begun.
    pub has_begun: bool,
    /// Whether the fault is one that no sensor of the vehicle can tell yet: what is hazardous counts apart.
    pub is_hidden: bool,
}

/// Hazardous outputs that belong together.
#[derive(Clone, Copy, Debug)]
struct Event {
    last: f64,
    seconds: f64,
    metres: f64,
}

/// Listens to the bus of a vehicle, and knows the truth.
#[derive(Clone, Debug)]
pub struct Judge {
    limits: AlertLimits,
    time: f64,
    events: [Option<Event>; 2],
    /// The same with what is hidden.
    events_of_all: [Option<Event>; 2],
    last_loss: Option<f64>,
    was_available: bool,
    right_since: Option<f64>,
    /// Time and distance since the fault began, s and m.
    begun: (f64, f64),
    /// The check that said last that something is wrong.
    said: Option<&'static str>,
    outcome: Outcome,
    /// What becomes of the events with what is hidden.
    of_all: Outcome,
}

impl Judge {
    /// A judge who has heard nothing.
    #[must_use]
    pub fn new(limits: AlertLimits) -> Self {
        Self {
            limits,
            time: 0.0,
            events: [None; 2],
            events_of_all: [None; 2],
            last_loss: None,
            was_available: false,
            right_since: None,
            begun: (0.0, 0.0),
            said: None,
            outcome: Outcome::default(),
            of_all: Outcome::default(),
        }
    }

    /// Hears the next moment.
    pub fn hear(&mut self, moment: &Moment) {
        let time = self.time;
        self.time += STEP;
        let outcome = &mut self.outcome;
        outcome.outputs += 1;
        outcome.driven_um += (1e6 * moment.driven).round() as u64;
        let claim = moment.heard.filter(|(pose, stated)| {
            moment.now.since(*stated) <= STALE && !matches!(pose.mode, Mode::NotLocalised | Mode::Lost)
        });
        let judged = claim.zip(moment.truth).map(|((pose, _), truth)| (Errors::of(&pose.pose, &truth), pose.level));
        let is_available = judged.is_some_and(|(_, level)| self.limits.travel.holds(&level));
        self.count_availability(moment, judged.map(|(_, level)| level), is_available, time);
        self.count_alarm(moment);
        let share = judged.map(|(errors, level)| self.count_claim(moment, &errors, &level));
        let is_right = is_available && share.is_some_and(|share| share <= 1.0);
        self.right_since = if is_right { self.right_since.or(Some(time)) } else { None };
        let hazards = [self.limits.travel, self.limits.docking]
            .map(|limit| judged.is_some_and(|(errors, level)| errors.exceed(&limit) && limit.holds(&level)));
        for (event, is_hazardous) in self.events.iter_mut().zip(hazards) {
            follow(event, is_hazardous && !moment.is_hidden, time, moment.driven, &mut self.outcome);
        }
        for (event, is_hazardous) in self.events_of_all.iter_mut().zip(hazards) {
            follow(event, is_hazardous, time, moment.driven, &mut self.of_all);
        }
    }

    /// Counts whether there is a claim, by the level that stands beside it, that a vehicle can use.
    fn count_availability(&mut self, moment: &Moment, level: Option<ProtectionLevel>, is_available: bool, time: f64) {
        let outcome = &mut self.outcome;
        if level.is_some() && outcome.first_claim.is_none() {
            outcome.first_claim = Some(outcome.outputs - 1);
        }
        if outcome.first_claim.is_some() {
            outcome.judged += 1;
            outcome.available += u64::from(is_available);
            let is_within = level.is_some_and(|level| self.limits.docking.holds(&level));
            outcome.within_docking += u64::from(is_within);
            outcome.docking += u64::from(moment.docks);
            outcome.docking_available += u64::from(moment.docks && is_within);
        }
        if self.was_available && !is_available && !moment.is_bare {
            outcome.losses += u32::from(self.last_loss.is_none_or(|last| time - last > SAME_LOSS));
            self.last_loss = Some(time);
        }
        self.was_available = is_available;
    }

    /// Counts what a check says, and how soon it is said once a fault has begun.
    fn count_alarm(&mut self, moment: &Moment) {
        let outcome = &mut self.outcome;
        let said = moment.heard.and_then(|(pose, _)| said_by(pose));
        if let Some(check) = said.filter(|check| outcome.first_claim.is_some() && self.said != Some(check)) {
            *outcome.alarms.entry(check.to_owned()).or_default() += 1;
        }
        self.said = said;
        if moment.has_begun && outcome.found.is_none() {
            let is_wide = |pose: &PublishedPose| matches!(pose.alarm, Alarm::Travel | Alarm::NoPose) && !moment.is_bare;
            let by = said.or(moment.heard.filter(|(pose, _)| is_wide(pose)).map(|_| "protection level"));
            outcome.found = by.map(|by| {
                let [after_ms, after_mm] = [self.begun.0, self.begun.1].map(|value| (1e3 * value).round() as u64);
                Found { after_ms, after_mm, by: by.to_owned() }
            });
            self.begun = (self.begun.0 + STEP, self.begun.1 + moment.driven);
        }
    }

    /// Counts a claim, and returns its error over its level.
    fn count_claim(&mut self, moment: &Moment, errors: &Errors, level: &ProtectionLevel) -> f64 {
        let outcome = &mut self.outcome;
        outcome.claims += 1;
        if moment.is_nominal {
            outcome.add_nominal(level);
        }
        stanford::count(&mut outcome.stanford, level.position, errors.position);
        let share = errors.over(level);
        outcome.most_over_level = outcome.most_over_level.max(share.min(MOST_OVER));
        outcome.misleading += u64::from(share > 1.0);
        let is_hazardous = |limit: AlertLimit| errors.exceed(&limit) && limit.holds(level);
        let is_hidden = moment.is_hidden && [self.limits.travel, self.limits.docking].into_iter().any(is_hazardous);
        outcome.hidden_hazardous += u64::from(is_hidden);
        share
    }

    /// What became of the run.
    #[must_use]
    pub fn outcome(mut self) -> Outcome {
        for event in self.events.into_iter().flatten() {
            close(&event, &mut self.outcome);
        }
        for event in self.events_of_all.into_iter().flatten() {
            close(&event, &mut self.of_all);
        }
        self.outcome.failures_of_all = self.of_all.failures;
        self.outcome.ends_right =
            self.right_since.is_some_and(|since| self.time - since >= RIGHT_AT_THE_END - 0.5 * STEP);
        self.outcome
    }
}

/// The check by which a pose on the bus says that something is wrong.
fn said_by(pose: &PublishedPose) -> Option<&'static str> {
    match pose.reason {
        Reason::None | Reason::NoPose | Reason::NoLandmarks | Reason::Uncertain => None,
        Reason::LandmarksRejected => Some("landmarks rejected"),
        Reason::InnovationsTooLarge => Some("innovations"),
        Reason::OdometryImplausible => Some("odometry implausible"),
        Reason::DriveEncoder | Reason::SteeringEncoder => Some("encoder"),
        Reason::MotionDisagrees => Some("motion"),
        Reason::LaserMoved => Some("mounting"),
        Reason::OdometryDisagrees => Some("odometry"),
        Reason::OdometrySilent => Some("odometry silent"),
        Reason::WheelsSlip => Some("turns"),
        Reason::GyroFault => Some("gyro"),
    }
}

/// How wrong a pose is.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// m.
    pub position: f64,
    /// rad.
    pub heading: f64,
}

impl Errors {
    /// Of a pose beside the true one.
    #[must_use]
    pub fn of(pose: &Pose, truth: &Pose) -> Self {
        Self {
            position: (pose.position() - truth.position()).norm(),
            heading: difference(pose.theta, truth.theta).abs(),
        }
    }

    /// Whether one of them is beyond its limit.
    #[must_use]
    pub fn exceed(&self, limit: &AlertLimit) -> bool {
        // What is not a number is not within.
        !(self.position <= limit.position && self.heading <= limit.heading)
    }

    /// The larger share of its bound; infinite where one is not a number.
    #[must_use]
    pub fn over(&self, level: &ProtectionLevel) -> f64 {
        let share = |error: f64, bound: f64| if error <= 0.0 { 0.0 } else { error / bound };
        let (position, heading) = (share(self.position, level.position), share(self.heading, level.heading));
        if position.is_nan() || heading.is_nan() { f64::INFINITY } else { position.max(heading) }
    }
}

fn follow(event: &mut Option<Event>, is_hazardous: bool, time: f64, driven: f64, outcome: &mut Outcome) {
    if let Some(ended) = event.take_if(|event| time - event.last >= SAME_EVENT) {
        close(&ended, outcome);
    }
    if is_hazardous {
        let event = event.get_or_insert(Event { last: time, seconds: 0.0, metres: 0.0 });
        event.last = time;
        event.seconds += STEP;
        event.metres += driven;
    }
}

fn close(event: &Event, outcome: &mut Outcome) {
    outcome.hazards += 1;
    outcome.worst_hazard_s = outcome.worst_hazard_s.max(event.seconds);
    outcome.worst_hazard_m = outcome.worst_hazard_m.max(event.metres);
    // Times are sums of hundredths.
    let is_failure = event.seconds > TOLERATED.0 + 0.5 * STEP || event.metres > TOLERATED.1;
    outcome.failures += u32::from(is_failure);
}
