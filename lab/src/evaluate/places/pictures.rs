//! The report.

use serde::Serialize;

use super::{LEAST_CONFIDENCE, Mode, Outcome, Protocol};
use agv_host_sim::report::{FigureError, Page, Series, Table, line_chart};

/// A page with a table and the curves of precision over recall, a picture for each protocol and mode.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn page(outcomes: &[Outcome]) -> Result<Page, FigureError> {
    let mut page = Page::new("Recognition of places");
    page.paragraph(
        "An answer is right within 0.5 m and 10 degrees. Protocol thesis: neighbours in time are allowed, and every scan \
         is a question that counts. Protocol honest: scans within 50 scans or 10 s are not allowed; questions count that \
         truly have an allowed scan within 0.5 m and 30 degrees; wrong answers to all questions count against precision.",
    );
    page.paragraph(&format!(
        "The threshold of a curve is the number of keypoints that support an answer, and for the improved chain its \
         confidence: the share of agreement among the returns that could contradict, times the root of the share of all \
         returns that agree. The table states both figures at the least number of keypoints, and for the improved chain at a \
         confidence of {LEAST_CONFIDENCE}."
    ));
    let heading =
        ["method", "protocol", "mode", "candidates", "keypoints", "precision", "recall", "R95", "R99", "F1", "ceiling"];
    page.section("Figures").table(&Table {
        heading: heading.map(str::to_owned).to_vec(),
        rows: outcomes
            .iter()
            .map(|outcome| {
                let mut row = vec![name(&outcome.method), name(&outcome.protocol), name(&outcome.mode)];
                row.extend([outcome.candidates.to_string(), outcome.n_min.to_string()]);
                let shares =
                    [outcome.precision, outcome.recall, outcome.r95, outcome.r99, outcome.max_f1, outcome.ceiling];
                row.extend(shares.map(|share| format!("{share:.3}")));
                row
            })
            .collect(),
    });
    for protocol in [Protocol::Thesis, Protocol::Honest] {
        for mode in [Mode::Offline, Mode::Online] {
            let lines: Vec<_> = outcomes
                .iter()
                .filter(|outcome| outcome.protocol == protocol && outcome.mode == mode)
                .map(|outcome| {
                    let points = outcome.curve.iter().map(|point| (point.recall, point.precision));
                    (name(&outcome.method), points.collect::<Vec<_>>())
                })
                .collect();
            let series: Vec<_> = lines.iter().map(|(name, points)| Series { name, points }).collect();
            let caption = format!("Protocol {}, {}", name(&protocol), name(&mode));
            page.section(&caption);
            page.figure(&line_chart(["recall", "precision"], &series, None)?, &caption);
        }
    }
    Ok(page)
}

/// The name that the value has in JSON.
fn name(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}
