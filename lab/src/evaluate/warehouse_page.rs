//! The ways of localising in the block storage, compared on one page.

use super::warehouse::Experiment;
use agv_host_sim::report::{Page, Table};

/// A page with the worst of the paths for each way of localising and each disturbance, and all experiments below.
#[must_use]
pub fn page(experiments: &[Experiment]) -> Page {
    let mut page = Page::new("The standard block storage");
    page.section("Candidates").paragraph(
        "How far the logical point is from where it should be at the end of the way: worst of the paths, 95 % mark of the runs. \
         'ok' is within 2 cm and 0.1 deg, in the path with the fewest. NEES is 3 if the stated covariance is right.",
    );
    let heading = ["candidate", "disturbance", "runs a path", "ok, %", "position, mm", "heading, deg", "NEES"];
    let mut kinds: Vec<(&str, String)> = Vec::new();
    for experiment in experiments {
        let kind = kind(experiment);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let rows = kinds.iter().map(|wanted| {
        let same: Vec<&Experiment> = experiments.iter().filter(|experiment| kind(experiment) == *wanted).collect();
        let most = |value: fn(&Experiment) -> f64| same.iter().map(|one| value(one)).fold(f64::NEG_INFINITY, f64::max);
        let least = |value: fn(&Experiment) -> f64| same.iter().map(|one| value(one)).fold(f64::INFINITY, f64::min);
        vec![
            wanted.0.to_owned(),
            wanted.1.clone(),
            same.iter().map(|one| one.runs).max().unwrap_or(0).to_string(),
            format!("{:.0}", 100.0 * least(|one| one.ok_share)),
            format!("{:.1}", most(|one| one.position_mm.p95)),
            format!("{:.3}", most(|one| one.heading_deg.p95)),
            format!("{:.1} to {:.1}", least(|one| one.nees), most(|one| one.nees)),
        ]
    });
    page.table(&Table { heading: heading.map(str::to_owned).to_vec(), rows: rows.collect() });
    page.section("Each path").paragraph("Median, 95 % mark and largest.");
    let heading = ["experiment", "disturbance", "runs", "way, m", "ok, %", "position, mm", "heading, deg", "NEES"];
    let rows = experiments.iter().map(|one| {
        let (position, turn) = (one.position_mm, one.heading_deg);
        vec![
            one.name.clone(),
            kind(one).1,
            one.runs.to_string(),
            format!("{:.1}", one.path_m),
            format!("{:.0}", 100.0 * one.ok_share),
            format!("{:.1}, {:.1}, {:.1}", position.median, position.p95, position.max),
            format!("{:.3}, {:.3}, {:.3}", turn.median, turn.p95, turn.max),
            format!("{:.1}", one.nees),
        ]
    });
    page.table(&Table { heading: heading.map(str::to_owned).to_vec(), rows: rows.collect() });
    page
}

/// Way of localising, without the path, and disturbance, in words.
fn kind(experiment: &Experiment) -> (&str, String) {
    let method = experiment.name.split_once(' ').map_or(experiment.name.as_str(), |(_, method)| method);
    (method, experiment.disturbance.name().replace('_', " "))
}
