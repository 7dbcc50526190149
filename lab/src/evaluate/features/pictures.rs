//! The report.

use super::Outcome;
use agv_host_sim::report::{FigureError, Page, Series, Table, line_chart};

/// A page with the tables and curves of K 3.3.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(title: &str, outcomes: &[Outcome]) -> Result<Page, FigureError> {
    let mut page = Page::new(title);
    add_detectors(&mut page, outcomes);
    add_repeatability(&mut page, outcomes)?;
    add_stability(&mut page, outcomes);
    add_descriptors(&mut page, outcomes)?;
    Ok(page)
}

fn add_detectors(page: &mut Page, outcomes: &[Outcome]) {
    let row = |outcome: &Outcome| {
        vec![
            name(outcome).to_owned(),
            format!("{:.1}", outcome.keypoints_per_scan),
            format!("{:.3}", outcome.repeatability),
            format!("{:.3}", outcome.repeatability_counting_empty),
            outcome.pairs.to_string(),
            format!("{:.1}", outcome.us_per_scan),
        ]
    };
    page.section("Detectors").table(&Table {
        heading: ["detector", "keypoints a scan", "repeatability", "counting empty", "pairs", "us a scan"]
            .map(str::to_owned)
            .to_vec(),
        rows: outcomes.iter().map(row).collect(),
    });
}

fn add_repeatability(page: &mut Page, outcomes: &[Outcome]) -> Result<(), FigureError> {
    page.section("Repeatability").paragraph(
        "Keypoints that two scans have in common within 0.2 m, over the smaller number of both (K 3.3). \
         Every fourth scan is a reference.",
    );
    let tests = [
        ("viewpoint", "overlap of the free regions"),
        ("noise", "standard deviation, m"),
        ("oversampling", "returns added between neighbours"),
        ("subsampling", "returns removed between neighbours"),
    ];
    for (test, label) in tests {
        let line = |outcome: &Outcome| {
            let levels = outcome.levels.iter().filter(|level| level.test == test);
            (name(outcome), levels.map(|level| (level.level, level.counting_empty)).collect::<Vec<_>>())
        };
        let lines: Vec<_> = outcomes.iter().map(line).collect();
        let series: Vec<_> = lines.iter().map(|(name, points)| Series { name, points }).collect();
        page.figure(&line_chart([label, "repeatability, counting empty"], &series, None)?, test);
    }
    Ok(())
}

fn add_stability(page: &mut Page, outcomes: &[Outcome]) {
    page.section("Landmark stability").paragraph(
        "Table 3.1: landmarks of all keypoints of the drive, and their scatter. \
         The printed figures need the association at 0.10 m.",
    );
    let rows = outcomes.iter().flat_map(|outcome| outcome.stability.iter().map(move |row| (outcome, row)));
    page.table(&Table {
        heading: ["detector", "association, m", "landmarks", "seen once, %", "mean, m", "max, m"]
            .map(str::to_owned)
            .to_vec(),
        rows: rows
            .map(|(outcome, row)| {
                vec![
                    name(outcome).to_owned(),
                    format!("{:.2}", row.association_m),
                    row.landmarks.to_string(),
                    format!("{:.1}", 100.0 * row.single_share),
                    format!("{:.3}", row.lambda_mean_m),
                    format!("{:.3}", row.lambda_max_m),
                ]
            })
            .collect(),
    });
}

fn add_descriptors(page: &mut Page, outcomes: &[Outcome]) -> Result<(), FigureError> {
    page.section("Descriptors").paragraph(
        "Recall over one minus precision, by the threshold of the distance; pairs of keypoints of two scans that lie \
         within 0.2 m of each other in the world, matched one to one, are the same.",
    );
    for outcome in outcomes {
        for descriptor in &outcome.descriptors {
            let lines: Vec<_> = descriptor
                .tests
                .iter()
                .map(|test| {
                    let points = test.curve.iter().map(|point| (1.0 - point.precision, point.recall));
                    (test.test, points.collect::<Vec<_>>())
                })
                .collect();
            let series: Vec<_> = lines.iter().map(|(name, points)| Series { name, points }).collect();
            let what = format!("{} within {} m", descriptor.descriptor, descriptor.radius_m);
            let caption = format!("{what} of {} keypoints", name(outcome));
            page.figure(&line_chart(["1 - precision", "recall"], &series, None)?, &caption);
        }
    }
    Ok(())
}

fn name(outcome: &Outcome) -> &'static str {
    match outcome.detector {
        super::DetectorKind::Falko => "FALKO",
        super::DetectorKind::Oc => "orthogonal corners",
    }
}
