//! Whether the controller was right, and said so when it was not.

use agv_core::geometry::{Pose, difference};
use agv_core::integrity::ProtectionLevel;
use agv_core::measurement::Time;
use agv_core::state::{Mode, PoseOutput};
use serde::{Deserialize, Serialize};

use super::fault::{Fault, window};

/// What a vehicle can live with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlertLimits {
    /// Error of the position, m.
    pub position: f64,
    /// Error of the heading, deg.
    pub heading_deg: f64,
    /// How long a larger error may be unsaid, s.
    pub time_to_alert: f64,
}

impl Default for AlertLimits {
    fn default() -> Self {
        Self { position: 0.15, heading_deg: 2.0, time_to_alert: 1.0 }
    }
}

/// An output older than this, s, says nothing of the present.
const STALE: f64 = 0.1;

/// A vehicle that is further away after a hundredth of a second, m, was carried.
const CARRIED: f64 = 0.1;

/// What the controller says at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Claim {
    /// It has no pose, none for now, or one that is not to be driven by.
    Degraded,
    /// It knows where the vehicle is.
    Right,
}

/// Time and way in one state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Episode {
    seconds: f64,
    metres: f64,
}

/// Listens to a controller that drives, and knows the truth.
#[derive(Clone, Debug)]
pub struct Judge {
    limits: AlertLimits,
    last: Option<(f64, Pose)>,
    /// The time in which the error is larger than what is reported, while it lasts.
    violation: Option<Episode>,
    /// The same for errors larger than the alert limits.
    harm: Option<Episode>,
    violations: Vec<Episode>,
    /// Longest of them, s.
    longest_harm: f64,
    first_degraded: Option<f64>,
    /// Since when the pose has been right and said to be, s.
    right_since: Option<f64>,
    worst: (f64, f64),
    seconds: f64,
    degraded_seconds: f64,
    from: f64,
}

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// It never said that anything is wrong, and nothing was.
    Unimpressed,
    /// It said that something is wrong before the error was larger than what it reports.
    Said,
    /// It said so, or was right again, after the error was larger for a while.
    Late,
    /// The error was above the alert limit for longer than may be, and it did not say so.
    Misleading,
}

/// The verdict on a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// What became of it.
    pub class: Class,
    /// How long the error was larger than the protection level before that was said or over, at most, s.
    pub late_s: f64,
    /// How far the vehicle went in that time, m.
    pub late_m: f64,
    /// Times in which the error was larger than the protection level although the pose was said to be right.
    pub violations: u32,
    /// From the beginning of the fault to the first word of it, s.
    pub said_after_s: Option<f64>,
    /// Whether the pose was right, and was said to be, at the end.
    pub is_recovered: bool,
    /// From the end of the fault to that, s. Zero if it was never lost.
    pub recovered_after_s: Option<f64>,
    /// Largest error of a pose that was said to be right, m and deg.
    pub worst_position_m: f64,
    /// The heading's.
    pub worst_heading_deg: f64,
    /// How long it was judged, s.
    pub seconds: f64,
    /// How long it said that something is wrong, s.
    pub degraded_s: f64,
}

impl Judge {
    /// A judge of a run in which something goes wrong at `from`, s since the vehicle drives off.
    #[must_use]
    pub fn new(limits: AlertLimits, from: f64) -> Self {
        Self {
            limits,
            last: None,
            violation: None,
            harm: None,
            violations: Vec::new(),
            longest_harm: 0.0,
            first_degraded: None,
            right_since: None,
            worst: (0.0, 0.0),
            seconds: 0.0,
            degraded_seconds: 0.0,
            from,
        }
    }

    /// Hears what is published at `now`, `time` s after the vehicle has driven off. `truth` tells where it is.
    pub fn hear(&mut self, now: Time, time: f64, output: Option<&PoseOutput>, truth: &dyn Fn(Time) -> Option<Pose>) {
        let Some(here) = truth(now) else { return };
        let (step, way) =
            self.last.map_or((0.0, 0.0), |(last, pose)| (time - last, pose.between(&here).position().norm()));
        // A vehicle that is carried does not drive.
        let way = if way > CARRIED { 0.0 } else { way };
        self.last = Some((time, here));
        self.seconds += step;
        let judged = output.and_then(|output| {
            let error = error(output, &truth(output.time)?);
            Some((self.claim(now, output), error, output.level))
        });
        let (claim, (position, heading), level) =
            judged.unwrap_or((Claim::Degraded, (0.0, 0.0), ProtectionLevel { position: 0.0, heading: 0.0 }));
        let is_right = claim == Claim::Right;
        if !is_right {
            self.degraded_seconds += step;
            if time >= self.from && self.first_degraded.is_none() {
                self.first_degraded = Some(time);
            }
        } else {
            self.worst = (self.worst.0.max(position), self.worst.1.max(heading));
        }
        let is_outside = is_right && (position > level.position || heading > level.heading);
        let is_harmful = is_outside && !self.is_tolerable(position, heading);
        if let Some(ended) = follow(&mut self.violation, is_outside, step, way) {
            self.violations.push(ended);
        }
        if let Some(ended) = follow(&mut self.harm, is_harmful, step, way) {
            self.note_harm(&ended);
        }
        let is_well = is_right && !is_outside && self.is_tolerable(position, heading);
        self.right_since = if is_well { self.right_since.or(Some(time)) } else { None };
    }

    fn is_tolerable(&self, position: f64, heading: f64) -> bool {
        position <= self.limits.position && heading <= self.limits.heading_deg.to_radians()
    }

    fn claim(&self, now: Time, output: &PoseOutput) -> Claim {
        let level = output.level;
        // In dead reckoning nothing watches over the odometry.
        let is_localised = matches!(output.mode, Mode::Reflectors | Mode::Features | Mode::Mixed);
        let is_fresh = now.since(output.time) <= STALE;
        if is_localised && is_fresh && self.is_tolerable(level.position, level.heading) {
            Claim::Right
        } else {
            Claim::Degraded
        }
    }

    fn note_harm(&mut self, harm: &Episode) {
        self.longest_harm = self.longest_harm.max(harm.seconds);
    }

    /// The verdict at the end of the run.
    #[must_use]
    pub fn verdict(mut self, faults: &[&Fault]) -> Verdict {
        self.violations.extend(self.violation.take());
        if let Some(harm) = self.harm.take() {
            self.note_harm(&harm);
        }
        let (_, until) = window(faults);
        let late_s = self.violations.iter().map(|episode| episode.seconds).fold(0.0, f64::max);
        let late_m = self.violations.iter().map(|episode| episode.metres).fold(0.0, f64::max);
        let is_misleading = self.longest_harm > self.limits.time_to_alert;
        let class = if is_misleading {
            Class::Misleading
        } else if !self.violations.is_empty() {
            Class::Late
        } else if self.first_degraded.is_some() {
            Class::Said
        } else {
            Class::Unimpressed
        };
        Verdict {
            class,
            late_s,
            late_m,
            violations: self.violations.len() as u32,
            said_after_s: self.first_degraded.map(|time| time - self.from),
            is_recovered: self.right_since.is_some(),
            recovered_after_s: self.right_since.map(|since| (since - until.unwrap_or(self.from)).max(0.0)),
            worst_position_m: self.worst.0,
            worst_heading_deg: self.worst.1.to_degrees(),
            seconds: self.seconds,
            degraded_s: self.degraded_seconds,
        }
    }
}

/// Goes on with an episode, or begins or ends one; gives one that has ended.
fn follow(episode: &mut Option<Episode>, is_on: bool, seconds: f64, metres: f64) -> Option<Episode> {
    if !is_on {
        return episode.take();
    }
    let episode = episode.get_or_insert_default();
    episode.seconds += seconds;
    episode.metres += metres;
    None
}

/// Errors of position, m, and heading, rad.
fn error(output: &PoseOutput, truth: &Pose) -> (f64, f64) {
    let shift = output.pose.position() - truth.position();
    (shift.norm(), difference(output.pose.theta, truth.theta).abs())
}
