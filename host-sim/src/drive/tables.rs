//! Figures and parameters of a drive as tables.

use agv_core::localizer::Parameters;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::{LEAVES, Settings};

use super::figures::{Accuracy, Figures};
use super::fitness::Grade;
use super::names::{kind_name, reason_name};
use super::track::Standard;
use crate::accuracy::Spread;
use crate::replay::ContourCounts;

/// Changes of mode that are listed at the most.
const LISTED_CHANGES: usize = 20;

/// A number with that many decimals, or a dash if there is none.
fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "-".to_owned() }
}

fn row(name: &str, value: String) -> [String; 2] {
    [name.to_owned(), value]
}

fn spread(spread: &Spread, decimals: usize, unit: &str) -> String {
    let [median, p95, max] = [spread.median, spread.p95, spread.max].map(|value| number(value, decimals));
    format!("median {median} {unit}, 95 % {p95}, max {max}")
}

/// The figures of a drive: name and value.
#[must_use]
pub fn figure_rows(figures: &Figures) -> Vec<[String; 2]> {
    let mut rows = fitness_rows(figures);
    rows.extend([
        row("duration", format!("{} s", number(figures.duration_s, 2))),
        row("way", format!("{} m", number(figures.way_m, 2))),
        row("events", figures.events.to_string()),
        row("poses", figures.poses.to_string()),
        row("speed", format!("{} times real time", number(figures.realtime_factor, 0))),
    ]);
    let modes = figures.modes.iter().map(|mode| format!("{} {:.2} s", figures.mode_name(mode.mode), mode.duration_s));
    rows.push(row("time in mode", modes.collect::<Vec<_>>().join(", ")));
    for change in figures.mode_changes.iter().take(LISTED_CHANGES) {
        let reason = reason_name(change.reason);
        let reason = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
        rows.push(row("mode", format!("{:.2} s: {}{reason}", change.since_start_s, figures.mode_name(change.mode))));
    }
    let left = figures.mode_changes.len().saturating_sub(LISTED_CHANGES);
    if left > 0 {
        rows.push(row("mode", format!("{left} more changes")));
    }
    for counts in &figures.observations {
        let parts = [
            (counts.accepted, "accepted"),
            (counts.gated, "outside the gate"),
            (counts.ambiguous, "ambiguous"),
            (counts.unknown, "unknown"),
            (counts.out_of_time, "out of time"),
        ];
        let parts = parts.into_iter().filter(|(count, name)| *count > 0 || *name == "accepted");
        let text = parts.map(|(count, name)| format!("{count} {name}")).collect::<Vec<_>>().join(", ");
        rows.push(row(kind_name(counts.kind), text));
    }
    if figures.contours.scans > 0 {
        let ContourCounts { scans, matched } = figures.contours;
        rows.push(row("contours", format!("{matched} of {scans} scans matched and corrected the pose")));
    }
    for innovation in &figures.innovations {
        let first = format!("rms {} mm", number(innovation.rms_first_mm, 1));
        let second = match (innovation.rms_second_mm, innovation.rms_bearing_deg) {
            (Some(second), _) => format!(" and {} mm", number(second, 1)),
            (None, Some(bearing)) => format!(" and {} deg", number(bearing, 3)),
            (None, None) => String::new(),
        };
        let square = number(innovation.mean_normalised_square, 2);
        rows.push(row(
            &format!("innovations, {}", kind_name(innovation.kind)),
            format!("{first}{second}, mean normalised square {square}; 2 is expected"),
        ));
    }
    if let Some(accuracy) = &figures.accuracy {
        rows.extend(accuracy_rows(accuracy));
    }
    rows
}

/// The verdict in one line.
#[must_use]
pub fn verdict(figures: &Figures) -> String {
    let grade = match figures.fitness.grade() {
        Grade::Good => "good",
        Grade::Partly => "partly fit",
        Grade::Poor => "poor",
    };
    format!("{grade}: {}", figures.fitness.sentence())
}

/// The verdict: what the pose was good for, and how sure it was.
#[must_use]
pub fn fitness_rows(figures: &Figures) -> Vec<[String; 2]> {
    let fitness = &figures.fitness;
    let mut rows = vec![row("verdict", verdict(figures))];
    let level = |name, spread: Option<Spread>, decimals, unit| {
        spread.map(|spread| {
            let bound = |value: f64| if value.is_finite() { number(value, decimals) } else { "no bound".to_owned() };
            let [median, p95, max] = [spread.median, spread.p95, spread.max].map(bound);
            row(name, format!("median {median} {unit}, 95 % of the time {p95}, worst {max}"))
        })
    };
    rows.extend(level("level, position", fitness.level_position_mm, 1, "mm"));
    rows.extend(level("level, heading", fitness.level_heading_deg, 3, "deg"));
    let largest = number(fitness.largest_correction_mm, 1);
    rows.push(row(
        "corrections",
        format!("{} of more than 10 mm at once, the largest {largest} mm", fitness.corrections),
    ));
    rows.push(match fitness.beyond_level {
        Some([beyond, all]) => row("errors beyond the level", format!("{beyond} of {all} poses")),
        None => row("true errors", "nobody has measured them; the level bounds them".to_owned()),
    });
    rows
}

fn accuracy_rows(accuracy: &Accuracy) -> Vec<[String; 2]> {
    let standard = match accuracy.against {
        Standard::Truth => "the true poses",
        Standard::References => "the references, at the laser",
    };
    let position = spread(&accuracy.position_mm, 1, "mm");
    let end = number(accuracy.position_end_mm, 1);
    let mut rows = vec![
        row("compared with", format!("{standard}, {} poses", accuracy.compared)),
        row("position error", format!("{position}, at the end {end}")),
    ];
    if let Some(heading) = &accuracy.heading_deg {
        let end = number(accuracy.heading_end_deg.unwrap_or(f64::NAN), 3);
        rows.push(row("heading error", format!("{}, at the end {end}", spread(heading, 3, "deg"))));
    }
    if let Some(nees) = accuracy.nees {
        rows.push(row("mean NEES", format!("{}; 3 is expected", number(nees, 2))));
    }
    if let Some(share) = accuracy.ok_share {
        rows.push(row("within 2 cm and 0.1 deg", format!("{} % of the poses", number(100.0 * share, 1))));
    }
    rows
}

/// Rooms of settings that are none of the localiser.
const OTHER_ROOMS: [&str; 6] = ["can.", "network.", "nav350.", "log.", "service.", "maps.identity"];

/// All parameters as the settings call them, with their units.
#[must_use]
pub fn parameter_rows(parameters: &Parameters) -> Vec<[String; 2]> {
    let settings = Settings::of(*parameters);
    let is_other = |leaf: &&Leaf| OTHER_ROOMS.iter().any(|room| leaf.name.starts_with(room));
    let rows = LEAVES.iter().filter(|leaf| !is_other(leaf)).filter_map(|leaf| {
        let value = leaf.get(&settings)?;
        let text = match value {
            Value::Number(number) => number.to_string(),
            Value::Whole(whole) => {
                let word = usize::try_from(whole).ok().and_then(|index| leaf.choices.get(index));
                word.map_or_else(|| whole.to_string(), |word| (*word).to_owned())
            }
            Value::Switch(is_on) => if is_on { "on" } else { "off" }.to_owned(),
            Value::Address(octets) => octets.map(|octet| octet.to_string()).join("."),
        };
        Some(row(leaf.name, format!("{text} {}", leaf.unit).trim_end().to_owned()))
    });
    rows.collect()
}
