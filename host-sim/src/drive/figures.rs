//! The figures of one replayed drive.

use agv_core::localizer::{LandmarkUse, Mode, Reason};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::measurement::Time;
use serde::Serialize;

use super::fitness::{Fitness, Spell};
use super::names::mode_name_of_drive;
use super::track::{Standard, Track, TrackError};
use crate::accuracy::{HEADING_REQUIREMENT, POSITION_REQUIREMENT, Spread};
use crate::recording::Recording;
use crate::replay::{ContourCounts, Replay};

/// The figures of one replayed drive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Recorded time, s.
    pub duration_s: f64,
    /// Length of the way, by odometry, m.
    pub way_m: f64,
    /// Number of events.
    pub events: usize,
    /// Number of poses since one was first given.
    pub poses: usize,
    /// Recorded time by processor time.
    pub realtime_factor: f64,
    /// What the pose was good for.
    pub fitness: Fitness,
    /// Time in each mode that occurred.
    pub modes: Vec<ModeTime>,
    /// When mode or reason changed.
    pub mode_changes: Vec<ModeChange>,
    /// What became of the observations, one entry a kind that was seen.
    pub observations: Vec<ObservationCounts>,
    /// Scans that were laid onto contours.
    pub contours: ContourCounts,
    /// Innovations of what corrected the pose, one entry a kind that did.
    pub innovations: Vec<Innovations>,
    /// How far the poses are off; None if nobody knows.
    pub accuracy: Option<Accuracy>,
}

/// Time in one mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModeTime {
    /// The mode.
    pub mode: Mode,
    /// How long, s.
    pub duration_s: f64,
}

/// A change of mode or reason.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ModeChange {
    /// When, s of the recording's clock.
    pub time_s: f64,
    /// When, s since the first event.
    pub since_start_s: f64,
    /// The mode from then on.
    pub mode: Mode,
    /// The reason from then on.
    pub reason: Reason,
}

/// What became of the observations of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ObservationCounts {
    /// What was seen.
    pub kind: LandmarkKind,
    /// Corrected the pose.
    pub accepted: usize,
    /// Too far from the nearest landmark.
    pub gated: usize,
    /// Between two landmarks.
    pub ambiguous: usize,
    /// No landmark near.
    pub unknown: usize,
    /// Too old or too new.
    pub out_of_time: usize,
}

/// Innovations of one kind of landmark.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Innovations {
    /// What was seen.
    pub kind: LandmarkKind,
    /// Root mean square of the first component: of the range of reflectors, and of the first axis of S for features, mm.
    pub rms_first_mm: f64,
    /// The same of the second axis of S, mm; None for reflectors.
    pub rms_second_mm: Option<f64>,
    /// The same of the bearing, deg; None for features.
    pub rms_bearing_deg: Option<f64>,
    /// Mean normalised square; 2 is expected, a little less because of the gate.
    pub mean_normalised_square: f64,
}

/// How far the poses are off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Accuracy {
    /// What the poses are compared with.
    pub against: Standard,
    /// Number of compared poses.
    pub compared: usize,
    /// Distance from the position, mm.
    pub position_mm: Spread,
    /// The same at the end, mm.
    pub position_end_mm: f64,
    /// Difference of the heading, deg; None if the references know none.
    pub heading_deg: Option<Spread>,
    /// The same at the end, deg.
    pub heading_end_deg: Option<f64>,
    /// Mean normalised error squared; 3 is expected. None for references.
    pub nees: Option<f64>,
    /// Share of the poses within 2 cm and 0.1 deg; None if the references know no heading.
    pub ok_share: Option<f64>,
}

/// All modes, in the order in which they are shown.
pub const MODES: [Mode; 8] = [
    Mode::NotLocalised,
    Mode::Reflectors,
    Mode::Features,
    Mode::Mixed,
    Mode::DeadReckoning,
    Mode::Degraded,
    Mode::WithoutOdometry,
    Mode::Lost,
];

/// All kinds, in the order in which they are shown.
pub const KINDS: [LandmarkKind; 3] = [LandmarkKind::Reflector, LandmarkKind::Corner, LandmarkKind::EndPoint];

impl Figures {
    /// Name of a mode in this drive: where scans were laid onto contours and no landmark among the features led, the features are contours.
    #[must_use]
    pub fn mode_name(&self, mode: Mode) -> &'static str {
        let is_feature = |counts: &&ObservationCounts| counts.kind != LandmarkKind::Reflector && counts.accepted > 0;
        let is_by_contours = self.contours.matched > 0 && !self.observations.iter().any(|counts| is_feature(&counts));
        mode_name_of_drive(mode, is_by_contours)
    }

    /// The figures of a replayed recording and its track.
    #[must_use]
    pub fn new(recording: &Recording, replay: &Replay, track: &Track) -> Self {
        let times = || recording.events.iter().filter_map(|event| event.time());
        let duration_s = match (times().min(), times().max()) {
            (Some(first), Some(last)) => last.since(first),
            _ => 0.0,
        };
        let spells = spells(recording, replay);
        let (modes, mode_changes) = modes(&spells);
        let fitness = Fitness::new(
            &recording.parameters,
            &spells.iter().map(|(_, spell)| *spell).collect::<Vec<_>>(),
            &replay.poses,
            track,
        );
        let of_kind = |kind| move |used: &&LandmarkUse| used.kind == kind;
        let gate = recording.parameters.association.gate;
        Self {
            duration_s,
            way_m: track.way,
            events: recording.events.len(),
            poses: replay.poses.iter().filter(|pose| pose.mode != Mode::NotLocalised).count(),
            realtime_factor: duration_s / replay.elapsed.as_secs_f64(),
            fitness,
            modes,
            mode_changes,
            observations: KINDS
                .into_iter()
                .filter_map(|kind| count(kind, replay.uses.iter().filter(of_kind(kind))))
                .collect(),
            contours: replay.contours,
            innovations: KINDS
                .into_iter()
                .filter_map(|kind| innovations(kind, gate, replay.uses.iter().filter(of_kind(kind))))
                .collect(),
            accuracy: track.standard.and_then(|standard| accuracy(standard, &track.errors)),
        }
    }
}

/// Each pose with when it was given and how long it was the last one.
fn spells<'a>(recording: &Recording, replay: &'a Replay) -> Vec<(Time, Spell<'a>)> {
    let mut spells: Vec<(Time, Spell)> = Vec::new();
    for (event, pose) in recording.events.iter().zip(&replay.poses) {
        // Before the first pose, only the events know the time.
        let now = match pose.mode {
            Mode::NotLocalised => event.time(),
            _ => Some(pose.time),
        };
        let Some(now) = now else {
            continue;
        };
        // Events of different sensors may overtake each other.
        let now = spells.last().map_or(now, |(before, _)| now.max(*before));
        if let Some((before, last)) = spells.last_mut() {
            last.duration = now.since(*before);
        }
        spells.push((now, Spell { pose, duration: 0.0 }));
    }
    spells
}

fn modes(spells: &[(Time, Spell)]) -> (Vec<ModeTime>, Vec<ModeChange>) {
    let mut durations = MODES.map(|mode| ModeTime { mode, duration_s: 0.0 });
    let mut changes: Vec<ModeChange> = Vec::new();
    for (now, Spell { pose, duration }) in spells {
        durations.iter_mut().filter(|entry| entry.mode == pose.mode).for_each(|entry| entry.duration_s += duration);
        if changes.last().is_none_or(|change| (change.mode, change.reason) != (pose.mode, pose.reason)) {
            let since_start_s = spells.first().map_or(0.0, |(first, _)| now.since(*first));
            changes.push(ModeChange { time_s: now.seconds(), since_start_s, mode: pose.mode, reason: pose.reason });
        }
    }
    let occurred = durations.into_iter().filter(|entry| changes.iter().any(|change| change.mode == entry.mode));
    (occurred.collect(), changes)
}

fn count<'a>(kind: LandmarkKind, uses: impl Iterator<Item = &'a LandmarkUse>) -> Option<ObservationCounts> {
    let mut counts = ObservationCounts { kind, accepted: 0, gated: 0, ambiguous: 0, unknown: 0, out_of_time: 0 };
    for used in uses {
        match used.verdict {
            Verdict::Accepted => counts.accepted += 1,
            Verdict::Gated => counts.gated += 1,
            Verdict::Ambiguous => counts.ambiguous += 1,
            Verdict::Unknown => counts.unknown += 1,
            Verdict::OutOfTime => counts.out_of_time += 1,
        }
    }
    let ObservationCounts { accepted, gated, ambiguous, unknown, out_of_time, .. } = counts;
    (accepted + gated + ambiguous + unknown + out_of_time > 0).then_some(counts)
}

fn innovations<'a>(kind: LandmarkKind, gate: f64, uses: impl Iterator<Item = &'a LandmarkUse>) -> Option<Innovations> {
    let accepted: Vec<&LandmarkUse> = uses.filter(|used| used.verdict == Verdict::Accepted).collect();
    if accepted.is_empty() {
        return None;
    }
    let mean = |value: &dyn Fn(&LandmarkUse) -> f64| {
        accepted.iter().map(|used| value(used)).sum::<f64>() / accepted.len() as f64
    };
    let first = mean(&|used| used.residual[0] * used.residual[0]).sqrt();
    let second = mean(&|used| used.residual[1] * used.residual[1]).sqrt();
    let is_reflector = kind == LandmarkKind::Reflector;
    Some(Innovations {
        kind,
        rms_first_mm: 1e3 * first,
        rms_second_mm: (!is_reflector).then_some(1e3 * second),
        rms_bearing_deg: is_reflector.then_some(second.to_degrees()),
        mean_normalised_square: mean(&|used| used.test_ratio * gate),
    })
}

fn accuracy(against: Standard, errors: &[TrackError]) -> Option<Accuracy> {
    let end = errors.last()?;
    let headings: Option<Vec<f64>> = errors.iter().map(|error| error.heading.map(f64::abs)).collect();
    let squares: Option<Vec<f64>> = errors.iter().map(|error| error.normalised_square).collect();
    let share = |is_ok: &dyn Fn(&TrackError, f64) -> bool, headings: &[f64]| {
        let ok = errors.iter().zip(headings).filter(|(error, heading)| is_ok(error, **heading)).count();
        ok as f64 / errors.len() as f64
    };
    let is_ok =
        |error: &TrackError, heading: f64| error.position <= POSITION_REQUIREMENT && heading <= HEADING_REQUIREMENT;
    Some(Accuracy {
        against,
        compared: errors.len(),
        position_mm: Spread::of(errors.iter().map(|error| 1e3 * error.position)),
        position_end_mm: 1e3 * end.position,
        heading_deg: headings.as_ref().map(|all| Spread::of(all.iter().map(|heading| heading.to_degrees()))),
        heading_end_deg: end.heading.map(|heading| heading.abs().to_degrees()),
        nees: squares.map(|all| all.iter().sum::<f64>() / all.len() as f64),
        ok_share: headings.map(|all| share(&is_ok, &all)),
    })
}
