//! The kinds of faults as a page of a book: each at its worst size, and every size of each.

use std::fmt::Write as _;

use super::figures::Figures;
use super::of_kind::{OfKind, Swept};

/// The page, in Markdown.
#[must_use]
pub fn threats(figures: &Figures) -> String {
    let mut page = String::from("# Threats\n\n");
    page.push_str(INTRODUCTION);
    page.push_str(WORST_SIZES);
    figures.per_fault.iter().for_each(|of| page.push_str(&line(of)));
    let swept: Vec<&OfKind> = figures.per_fault.iter().filter(|of| !of.sizes.is_empty()).collect();
    if !swept.is_empty() {
        page.push_str(EVERY_SIZE);
        for of in swept {
            let cells: Vec<String> = of.sizes.iter().map(cell).collect();
            let _ = writeln!(page, "| {} | {} | {} |", of.kind, of.unit, cells.join(" · "));
        }
    }
    page
}

const INTRODUCTION: &str =
    "Every kind of fault of `trust.toml`, by `agv evaluate trust`; the words are those of [Trust](../trust.md).\n\n";

const WORST_SIZES: &str = "## The worst size of each kind\n\n\
     Failures and hazardous outputs are by either alert limit, those of the worst event; what is hazardous while no sensor can tell (class C) stands \
     apart; *with what is hidden* is how many runs fail if it does not. *Claimed* is the share of the time in claims with a protection level within the alert limit of travelling. *Found* is in how many runs, \
     what did so most often, and after how long a time and way at the latest.\n\n\
     | kind | class | worst size | failures of runs, 95 % bound | with what is hidden | hazardous | not to be told | worst seed | error over level, at most | claimed | found |\n\
     |---|---|---|---|---|---|---|---|---|---|---|\n";

const EVERY_SIZE: &str = "\n## Every size\n\n\
     The sweep by which the worst sizes were found. Of each size: the largest error over its protection level (— where nothing is claimed), and in \
     brackets the share of the time in claims with a protection level within the alert limit of travelling; in bold if a run fails.\n\n\
     | kind | in | size: error over level (claimed) |\n|---|---|---|\n";

fn line(of: &OfKind) -> String {
    let found = if of.found == 0 {
        String::new()
    } else {
        format!("{}, {}, {:.1} s, {:.1} m", of.found, of.found_by, of.found_s, of.found_m)
    };
    let bound = of.bound.map_or_else(String::new, |bound| format!(", {:.1} %", 100.0 * bound));
    format!(
        "| {} | {:?} | {} {} | {} of {}{bound} | {} | {:.2} s, {:.2} m | {:.2} s | {} | {} | {:.1} % | {found} |\n",
        of.kind,
        of.class,
        of.worst_size,
        of.unit,
        of.failures,
        of.runs,
        of.failures_of_all,
        of.worst_hmi_s,
        of.worst_hmi_m,
        of.hidden_s,
        of.worst_seed,
        share(of.error_over_pl_max),
        100.0 * of.share_claimed,
    )
}

fn cell(of: &Swept) -> String {
    let text = format!("{}: {} ({:.0} %)", of.size, share(of.error_over_pl_max), 100.0 * of.share_claimed);
    if of.failures > 0 { format!("**{text}**") } else { text }
}

fn share(of_level: Option<f64>) -> String {
    of_level.map_or_else(|| "—".to_owned(), |share| format!("{share:.2}"))
}
