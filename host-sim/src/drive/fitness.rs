//! What the pose of a drive was good for, by what the vehicle itself knew: its protection level.

use agv_core::integrity::Alarm;
use agv_core::localizer::{Mode, Parameters, PoseOutput};
use agv_core::state::ProtectionLevel;
use serde::Serialize;

use super::track::{Standard, Track};
use crate::accuracy::Spread;

/// A pose and how long it was the last one, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spell<'a> {
    pub pose: &'a PoseOutput,
    pub duration: f64,
}

/// What the pose of a drive was good for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Fitness {
    /// Share of the recorded time in which the level allowed the vehicle to travel.
    pub travel_share: f64,
    /// The same to dock.
    pub docking_share: f64,
    /// Share of the recorded time with a pose: neither lost nor not localised.
    pub pose_share: f64,
    /// How often it was lost.
    pub lost: usize,
    /// For how long, s.
    pub lost_s: f64,
    /// Protection level of the position over the time with a pose, mm; null where there is no bound. None if there never was a pose.
    pub level_position_mm: Option<Spread>,
    /// The same of the heading, deg.
    pub level_heading_deg: Option<Spread>,
    /// Corrections by landmarks that moved the position by more than 1 cm at once.
    pub corrections: usize,
    /// The largest correction, mm.
    pub largest_correction_mm: f64,
    /// Poses whose error was beyond their level, and poses that were compared; None if nobody knows the truth.
    pub beyond_level: Option<[usize; 2]>,
}

/// How a drive is to be seen at a glance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// Fit to travel for nearly all of the time, never lost, no error beyond its level.
    Good,
    /// Fit for most of it.
    Partly,
    /// Neither.
    Poor,
}

/// Shares of time to travel from which a drive is good, and partly so.
pub const GOOD: f64 = 0.99;
const PARTLY: f64 = 0.9;

/// Levels at least so large are no bound.
const UNBOUNDED: f64 = 0.5 * ProtectionLevel::UNBOUNDED.position;

impl Fitness {
    /// Of the poses of a drive, each with its time.
    pub(super) fn new(parameters: &Parameters, spells: &[Spell], outputs: &[PoseOutput], track: &Track) -> Self {
        let all: f64 = spells.iter().map(|spell| spell.duration).sum();
        let alarm = |spell: &Spell| parameters.alert_limits.alarm(spell.pose.mode, &spell.pose.level);
        let share = |most: Alarm| {
            let durations = spells.iter().filter(|spell| alarm(spell) <= most).map(|spell| spell.duration);
            // The sum of none is -0.
            let fit = 0.0 + durations.sum::<f64>();
            if all > 0.0 { fit / all } else { 0.0 }
        };
        let is_lost = |pose: &PoseOutput| pose.mode == Mode::Lost;
        let begins = spells.windows(2).filter(|pair| is_lost(pair[1].pose) && !is_lost(pair[0].pose)).count();
        let is_lost_first = spells.first().is_some_and(|spell| is_lost(spell.pose));
        let with_pose = || spells.iter().filter(|spell| alarm(spell) != Alarm::NoPose);
        let level = |of: fn(&ProtectionLevel) -> f64, factor: f64| {
            let bound = |level: f64| if level < UNBOUNDED { factor * level } else { f64::INFINITY };
            over_time(with_pose().map(|spell| (bound(of(&spell.pose.level)), spell.duration)).collect())
        };
        let corrections = || outputs.iter().map(|output| output.correction).filter(|by| by.is_finite());
        Self {
            travel_share: share(Alarm::Docking),
            docking_share: share(Alarm::None),
            pose_share: share(Alarm::Travel),
            lost: begins + usize::from(is_lost_first),
            lost_s: spells.iter().filter(|spell| is_lost(spell.pose)).map(|spell| spell.duration).sum::<f64>() + 0.0,
            level_position_mm: level(|level| level.position, 1e3),
            level_heading_deg: level(|level| level.heading, 1.0_f64.to_degrees()),
            corrections: corrections().filter(|by| *by > PoseOutput::NOTABLE_CORRECTION).count(),
            largest_correction_mm: 1e3 * corrections().fold(0.0, f64::max),
            beyond_level: beyond_level(track),
        }
    }

    /// The grade of the drive.
    #[must_use]
    pub fn grade(&self) -> Grade {
        let is_honest = self.beyond_level.is_none_or(|[beyond, _]| beyond == 0);
        if self.travel_share >= GOOD && self.lost == 0 && is_honest {
            Grade::Good
        } else if self.travel_share >= PARTLY && is_honest {
            Grade::Partly
        } else {
            Grade::Poor
        }
    }

    /// In one sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let percent = |share: f64| percent(share);
        let lost = match self.lost {
            0 => "never lost".to_owned(),
            1 => format!("lost once, for {:.1} s", self.lost_s),
            times => format!("lost {times} times, for {:.1} s", self.lost_s),
        };
        let (travel, docking) = (percent(self.travel_share), percent(self.docking_share));
        format!("fit to travel for {travel} of the time, to dock for {docking}; {lost}")
    }
}

/// A share in per cent that is 100 or 0 only if it is so.
#[must_use]
pub fn percent(share: f64) -> String {
    let shown = 100.0 * share;
    let bounded = if share < 1.0 { shown.min(99.9) } else { shown };
    let bounded = if share > 0.0 { bounded.max(0.1) } else { bounded };
    if share.is_finite() { format!("{bounded:.1} %") } else { "-".to_owned() }
}

/// Median, 95 % mark and largest of values that last so long each.
fn over_time(mut values: Vec<(f64, f64)>) -> Option<Spread> {
    values.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let all: f64 = values.iter().map(|(_, duration)| duration).sum();
    let largest = values.last()?.0;
    let mark = |share: f64| {
        let mut behind = 0.0;
        let reaches = |(value, duration): &(f64, f64)| {
            behind += duration;
            (behind >= share * all).then_some(*value)
        };
        values.iter().find_map(reaches).unwrap_or(largest)
    };
    Some(Spread { median: mark(0.5), p95: mark(0.95), max: largest })
}

/// Errors of a truth that are beyond the level of their pose; those against references are at another place of the vehicle.
fn beyond_level(track: &Track) -> Option<[usize; 2]> {
    if track.standard != Some(Standard::Truth) {
        return None;
    }
    let mut points = track.points.iter();
    let mut counts = [0, 0];
    for error in &track.errors {
        let Some(point) = points.find(|point| point.output.time == error.time) else { break };
        if matches!(point.output.mode, Mode::NotLocalised | Mode::Lost) {
            continue;
        }
        let level = &point.output.level;
        let is_beyond =
            error.position > level.position || error.heading.is_some_and(|heading| heading.abs() > level.heading);
        counts[0] += usize::from(is_beyond);
        counts[1] += 1;
    }
    Some(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_over_time() {
        let spread = over_time(vec![(5.0, 1.0), (1.0, 90.0), (3.0, 9.0)]).unwrap();
        assert_eq!((spread.median, spread.p95, spread.max), (1.0, 3.0, 5.0));
        assert_eq!(over_time(Vec::new()), None);
        let unbounded = over_time(vec![(f64::INFINITY, 1.0), (1.0, 99.0)]).unwrap();
        assert_eq!((unbounded.p95, unbounded.max), (1.0, f64::INFINITY));
    }

    #[test]
    fn a_share_is_all_or_nothing_only_if_it_is() {
        assert_eq!([1.0, 0.99999, 0.5, 1e-6, 0.0].map(percent), ["100.0 %", "99.9 %", "50.0 %", "0.1 %", "0.0 %"]);
    }
}
