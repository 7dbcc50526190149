//! Figures and parameters of a drive as tables.

use agv_core::localizer::Parameters;
use serde_json::Value;

use super::figures::{Accuracy, Figures};
use super::names::{kind_name, mode_name, reason_name};
use super::track::Standard;
use crate::accuracy::Spread;

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
    let mut rows = vec![
        row("duration", format!("{} s", number(figures.duration_s, 2))),
        row("way", format!("{} m", number(figures.way_m, 2))),
        row("events", figures.events.to_string()),
        row("poses", figures.poses.to_string()),
        row("speed", format!("{} times real time", number(figures.realtime_factor, 0))),
    ];
    let modes = figures.modes.iter().map(|mode| format!("{} {:.2} s", mode_name(mode.mode), mode.duration_s));
    rows.push(row("time in mode", modes.collect::<Vec<_>>().join(", ")));
    for change in figures.mode_changes.iter().take(LISTED_CHANGES) {
        let reason = reason_name(change.reason);
        let reason = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
        rows.push(row("mode", format!("{:.2} s: {}{reason}", change.time_s, mode_name(change.mode))));
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
            format!("{first}{second}, mean normalised square {square}"),
        ));
    }
    if let Some(accuracy) = &figures.accuracy {
        rows.extend(accuracy_rows(accuracy));
    }
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

/// All parameters: the path to each and its value, in SI units and radians.
#[must_use]
pub fn parameter_rows(parameters: &Parameters) -> Vec<[String; 2]> {
    let mut rows = Vec::new();
    // Parameters are plain numbers and names, which JSON can hold.
    let value = serde_json::to_value(parameters).unwrap_or_default();
    flatten("", &value, &mut rows);
    rows
}

fn flatten(path: &str, value: &Value, rows: &mut Vec<[String; 2]>) {
    match value {
        Value::Object(entries) => {
            for (name, value) in entries {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                flatten(&path, value, rows);
            }
        }
        Value::String(text) => rows.push([path.to_owned(), text.clone()]),
        other => rows.push([path.to_owned(), other.to_string()]),
    }
}
