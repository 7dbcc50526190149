//! The table of a campaign: a line a fault.

use std::fmt::Write as _;

use super::results::Row;
use super::verdict::Class;

/// Lines with the same columns for the same results, so that a change of behaviour is a difference between two texts.
/// Pairs of faults share one line.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<38} {:>4} {:>4} {:>4} {:>4} {:>4}  {:>6} {:>6} {:>6}  {:>9} {:>7}  {:>7} {:>7}\n",
        "fault",
        "runs",
        "no",
        "said",
        "late",
        "mis",
        "said s",
        "late s",
        "late m",
        "recovered",
        "after s",
        "worst m",
        "deg"
    );
    let mut names: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| row.other_fault.is_empty()) {
        if !names.contains(&row.fault.as_str()) {
            names.push(&row.fault);
        }
    }
    for name in names {
        let of: Vec<&Row> = rows.iter().filter(|row| row.fault == name && row.other_fault.is_empty()).collect();
        line(&mut text, name, &of);
    }
    let pairs: Vec<&Row> = rows.iter().filter(|row| !row.other_fault.is_empty()).collect();
    if !pairs.is_empty() {
        line(&mut text, "every two of them", &pairs);
    }
    let all: Vec<&Row> = rows.iter().collect();
    line(&mut text, "all", &all);
    text
}

fn line(text: &mut String, name: &str, rows: &[&Row]) {
    let count = |class: Class| rows.iter().filter(|row| row.class() == Some(class)).count();
    let most = |value: fn(&Row) -> f64| {
        rows.iter().map(|row| value(row)).filter(|value| value.is_finite()).fold(0.0, f64::max)
    };
    let can_recover = rows.iter().filter(|row| row.can_recover).count();
    let recovered = rows.iter().filter(|row| row.can_recover && row.is_recovered).count();
    let recovery = if can_recover == 0 { "-".to_owned() } else { format!("{recovered}/{can_recover}") };
    let _ = writeln!(
        text,
        "{name:<38} {:>4} {:>4} {:>4} {:>4} {:>4}  {:>6.2} {:>6.2} {:>6.2}  {recovery:>9} {:>7.1}  {:>7.3} {:>7.2}",
        rows.len(),
        count(Class::Unimpressed),
        count(Class::Said),
        count(Class::Late),
        count(Class::Misleading),
        most(|row| row.said_after_s),
        most(|row| row.late_s),
        most(|row| row.late_m),
        most(|row| if row.can_recover { row.recovered_after_s } else { 0.0 }),
        most(|row| row.worst_position_m),
        most(|row| row.worst_heading_deg),
    );
}
