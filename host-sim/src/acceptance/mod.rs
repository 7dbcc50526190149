//! The acceptance test of a vehicle: one replayed drive, and halts that somebody has measured, line by line.

mod marks;

use std::path::Path;

use agv_core::localizer::Mode;
use agv_core::maps::{Landmark, LandmarkKind};
use serde::Serialize;

use crate::drive::{Figures, GOOD, Track, kind_name, percent};
use crate::replay::Comparisons;
use crate::text_file::{self, TextFileError};
use crate::wording::count_of;

pub use marks::{FEWEST_MARKS, MARKS, MarkHalt, halts_of, read_marks};

/// How a line ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It is as it must be.
    Pass,
    /// It is not.
    Fail,
    /// There was nothing to compare, or too little.
    NotMeasured,
}

/// One line of the test.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Line {
    /// What is looked at.
    pub what: String,
    /// How it ended.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What must be.
    pub must_be: &'static str,
}

/// Observations of a kind below which nothing is said of them.
const FEWEST_OBSERVATIONS: usize = 100;
/// Mean normalised squares of an honest filter; 2 is expected.
const HONEST: std::ops::RangeInclusive<f64> = 1.0..=3.0;
/// Share of the accepted among accepted and gated.
const ACCEPTED: f64 = 0.9;
/// Halts that are measured at least.
const FEWEST_HALTS: usize = 10;
/// Farthest that a halt is from the mean of all, mm and deg.
const HALT: [f64; 2] = [20.0, 0.1];

/// Modes that no drive of an accepted vehicle has.
const BAD: [Mode; 3] = [Mode::Lost, Mode::Degraded, Mode::WithoutOdometry];

/// Where a vehicle has halted, by a ruler: along its way and across, mm, and its heading, deg.
pub type Halt = [f64; 3];

/// First line of a file of halts.
pub const HALTS: &str = "along_mm,across_mm,heading_deg";

/// Reads halts, one a line.
///
/// # Errors
/// See [`TextFileError`].
pub fn read_halts(path: &Path) -> Result<Vec<Halt>, TextFileError> {
    let text = text_file::read(path, "a table of halts")?;
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    if lines.next().is_none_or(|(_, first)| first.trim() != HALTS) {
        return Err(TextFileError::of_line(path, 1, format!("the first line must be {HALTS}")));
    }
    lines
        .map(|(number, line)| {
            halt(line).ok_or_else(|| TextFileError::of_line(path, number, "three numbers are wanted"))
        })
        .collect()
}

fn halt(line: &str) -> Option<Halt> {
    let numbers: Option<Vec<f64>> =
        line.split(',').map(|field| field.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
    numbers?.try_into().ok()
}

/// What somebody has measured of where the vehicle halts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Halts<'a> {
    /// At one mark.
    pub at_one: &'a [Halt],
    /// At surveyed marks.
    pub at_marks: &'a [MarkHalt],
}

/// All lines of the test of a vehicle with a `map`: of kinds that are not in it nothing is asked. `said` is what the log holds of what
/// the vehicle has said.
#[must_use]
pub fn test(figures: &Figures, track: &Track, map: &[Landmark], said: &Comparisons, halts: &Halts) -> Vec<Line> {
    let mut lines = vec![same_bits(said), never_lost(figures), fit(figures)];
    lines.extend(honest(figures, map));
    lines.extend(fitting(figures, map));
    lines.push(repeatable(halts.at_one));
    lines.push(marks::absolute(track, halts.at_marks));
    lines
}

/// By its own protection level.
fn fit(figures: &Figures) -> Line {
    let fitness = &figures.fitness;
    let (verdict, found) = if figures.poses == 0 {
        (Verdict::NotMeasured, "the vehicle was never localised".to_owned())
    } else {
        (verdict(fitness.travel_share >= GOOD), fitness.sentence())
    };
    let must_be = "the level allows travelling for at least 99 % of the time";
    Line { what: format!("fit to travel: {}", percent(fitness.travel_share)), verdict, found, must_be }
}

fn verdict(is_good: bool) -> Verdict {
    if is_good { Verdict::Pass } else { Verdict::Fail }
}

fn is_mapped(map: &[Landmark], kind: LandmarkKind) -> bool {
    map.iter().any(|landmark| landmark.kind == kind)
}

/// A log in which nothing was published was written by a replay: its outputs say nothing of a vehicle.
fn same_bits(said: &Comparisons) -> Line {
    let (verdict, found) = match (said.outputs, said.published) {
        (Some(outputs), Some(published)) if outputs.compared > 0 && published.compared > 0 => {
            let differences = [outputs, published].into_iter().filter_map(|comparison| comparison.first_difference);
            differences.min().map_or_else(
                || {
                    let (outputs, published) = (outputs.compared, published.compared);
                    (Verdict::Pass, format!("{outputs} outputs and {published} published poses are equal, bit for bit"))
                },
                |event| (Verdict::Fail, format!("the outputs differ, first at event {event}")),
            )
        }
        _ => (Verdict::NotMeasured, "the log holds no outputs of a vehicle".to_owned()),
    };
    Line { what: "the same bits".to_owned(), verdict, found, must_be: "no difference" }
}

fn never_lost(figures: &Figures) -> Line {
    let bad = figures.modes.iter().filter(|time| BAD.contains(&time.mode));
    let bad: Vec<String> =
        bad.map(|time| format!("{} for {:.1} s", figures.mode_name(time.mode), time.duration_s)).collect();
    let (verdict, found) = if figures.poses == 0 {
        (Verdict::NotMeasured, "the vehicle was never localised".to_owned())
    } else if bad.is_empty() {
        (Verdict::Pass, format!("{} poses, {:.0} m", figures.poses, figures.way_m))
    } else {
        (Verdict::Fail, bad.join(", "))
    };
    Line { what: "never lost".to_owned(), verdict, found, must_be: "never lost, degraded or without odometry" }
}

fn honest(figures: &Figures, map: &[Landmark]) -> Vec<Line> {
    let accepted =
        |kind| figures.observations.iter().find(|counts| counts.kind == kind).map_or(0, |counts| counts.accepted);
    let mapped = figures.innovations.iter().filter(|innovations| is_mapped(map, innovations.kind));
    let lines = mapped.map(|innovations| {
        let (count, square) = (accepted(innovations.kind), innovations.mean_normalised_square);
        let is_enough = count >= FEWEST_OBSERVATIONS && square.is_finite();
        Line {
            what: format!("the filter is honest: {}", kind_name(innovations.kind)),
            verdict: if is_enough { verdict(HONEST.contains(&square)) } else { Verdict::NotMeasured },
            found: format!("{square:.2} of {count}"),
            must_be: "1 to 3; 2 is expected",
        }
    });
    or_nothing(lines.collect(), "the filter is honest", "1 to 3; 2 is expected")
}

fn fitting(figures: &Figures, map: &[Landmark]) -> Vec<Line> {
    let lines = figures.observations.iter().filter(|counts| is_mapped(map, counts.kind)).map(|counts| {
        let all = counts.accepted + counts.gated;
        let share = counts.accepted as f64 / all.max(1) as f64;
        Line {
            what: format!("landmarks are where the map says: {}", kind_name(counts.kind)),
            verdict: if all >= FEWEST_OBSERVATIONS { verdict(share >= ACCEPTED) } else { Verdict::NotMeasured },
            found: format!("{} accepted, {} gated", counts.accepted, counts.gated),
            must_be: "at least 9 of 10 accepted",
        }
    });
    or_nothing(lines.collect(), "landmarks are where the map says", "at least 9 of 10 accepted")
}

/// A line that says that there was nothing, where there was nothing.
fn or_nothing(lines: Vec<Line>, what: &str, must_be: &'static str) -> Vec<Line> {
    if !lines.is_empty() {
        return lines;
    }
    let found = "nothing was observed".to_owned();
    vec![Line { what: what.to_owned(), verdict: Verdict::NotMeasured, found, must_be }]
}

fn repeatable(halts: &[Halt]) -> Line {
    let mean = |index: usize| halts.iter().map(|halt| halt[index]).sum::<f64>() / halts.len().max(1) as f64;
    let [along, across, heading] = [0, 1, 2].map(mean);
    let farthest = halts.iter().map(|halt| (halt[0] - along).hypot(halt[1] - across)).fold(0.0, f64::max);
    let turned = halts.iter().map(|halt| (halt[2] - heading).abs()).fold(0.0, f64::max);
    let (verdict, found) = if halts.len() < FEWEST_HALTS {
        (Verdict::NotMeasured, format!("{} measured, {FEWEST_HALTS} are wanted", count_of(halts.len(), "halt")))
    } else {
        let is_good = farthest <= HALT[0] && turned <= HALT[1];
        (verdict(is_good), format!("{} halts within {farthest:.1} mm and {turned:.3} deg of their mean", halts.len()))
    };
    Line { what: "repeatable".to_owned(), verdict, found, must_be: "ten halts within 20 mm and 0.1 deg" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::Comparison;

    /// A drive of which nothing is known.
    fn nothing() -> Figures {
        Figures {
            duration_s: 0.0,
            way_m: 0.0,
            events: 0,
            poses: 0,
            realtime_factor: 0.0,
            fitness: crate::drive::Fitness::default(),
            modes: Vec::new(),
            mode_changes: Vec::new(),
            observations: Vec::new(),
            contours: Default::default(),
            innovations: Vec::new(),
            accuracy: None,
        }
    }

    #[test]
    fn what_was_not_compared_never_passes() {
        let nothing_compared = Some(Comparison { compared: 0, first_difference: None });
        for outputs in [None, nothing_compared] {
            let said = Comparisons { outputs, published: outputs };
            for halts in [&[][..], &[[0.0; 3]; 9]] {
                let track = Track { points: Vec::new(), way: 0.0, standard: None, errors: Vec::new() };
                let halts = Halts { at_one: halts, at_marks: &[] };
                let lines = test(&nothing(), &track, &[], &said, &halts);
                assert_eq!(lines.len(), 7);
                assert!(lines.iter().all(|line| line.verdict == Verdict::NotMeasured), "{lines:?}");
            }
        }
    }

    #[test]
    fn the_bits_are_those_of_a_vehicle() {
        let equal = Some(Comparison { compared: 5, first_difference: None });
        let other = Some(Comparison { compared: 5, first_difference: Some(3) });
        let verdict = |outputs, published| same_bits(&Comparisons { outputs, published }).verdict;
        assert_eq!(verdict(equal, equal), Verdict::Pass);
        assert_eq!(verdict(equal, None), Verdict::NotMeasured);
        assert_eq!(verdict(equal, other), Verdict::Fail);
        assert_eq!(verdict(other, equal), Verdict::Fail);
    }

    #[test]
    fn halts_are_compared_with_their_mean() {
        let mut halts = [[5.0, -3.0, 0.2]; 10];
        assert_eq!(repeatable(&halts).verdict, Verdict::Pass);
        // The mean moves by a tenth of what one halt does.
        halts[0][0] += 21.0;
        assert_eq!(repeatable(&halts).verdict, Verdict::Pass);
        halts[0][0] += 2.0;
        assert_eq!(repeatable(&halts).verdict, Verdict::Fail);
        let mut turned = [[0.0; 3]; 10];
        turned[3][2] = 0.12;
        assert_eq!(repeatable(&turned).verdict, Verdict::Fail);
    }
}
