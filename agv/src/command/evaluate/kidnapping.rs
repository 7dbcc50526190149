//! `agv evaluate kidnapping`.

use agv_core::relocalization::RelocalizationParameters;
use agv_lab::evaluate::kidnapping::{Case, feature_map, run};

use super::arguments::Starts;
use crate::command::progress;

const HELP: &str = "\
An answer is right within 0.1 m and 1 degree. A revolution misses reflectors independently of the one before.
Of the cases with 1000 reflectors, and among features, a tenth of the starts is tried. Thresholds were chosen with seeds from 1001 on.
From a blind start fewer than four reflectors can be seen at all; it counts as not right.

Examples:
  agv evaluate kidnapping --json
  agv evaluate kidnapping --starts 1000 --seed 7 --only symmetric";

/// How often a vehicle that is switched on among reflectors finds itself, in simulation.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Kidnapping {
    #[command(flatten)]
    starts: Starts,
}

/// Starts of each case if nothing is said.
const STARTS: u64 = 10_000;

/// Name of the case of [`feature_map`].
const FEATURES: &str = "block storage, features";

impl Kidnapping {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let Starts { starts: all_starts, seed, only, json } = self.starts;
        let all_starts = all_starts.unwrap_or(STARTS);
        let cases: Vec<_> = Case::ALL
            .iter()
            .filter(|case| case.name.contains(&only))
            .map(|case| (case, if case.name.starts_with("1000") { all_starts.div_ceil(10) } else { all_starts }))
            .collect();
        let features = FEATURES.contains(&only).then(|| all_starts.div_ceil(10));
        anyhow::ensure!(!cases.is_empty() || features.is_some(), "no case's name contains '{only}'");
        let all = cases.iter().map(|(_, starts)| starts).sum::<u64>() + features.unwrap_or(0);
        let bar = progress::bar("starting vehicles", all);
        let parameters = RelocalizationParameters::default();
        let mut outcomes: Vec<_> =
            cases.into_iter().map(|(case, starts)| run(case, seed, starts, &parameters, || bar.inc(1))).collect();
        if let Some(starts) = features {
            outcomes.push(feature_map::run(seed, starts, &feature_map::parameters(), || bar.inc(1))?);
        }
        bar.finish_and_clear();
        if json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "case                   starts  right within 1, 2, 3 revolutions  wrong  ambiguous  blind  seen  effort, most"
        );
        for outcome in outcomes {
            let [one, two, three] = outcome.right.map(|share| 100.0 * share);
            println!(
                "{:<22} {:>6} {one:>11.2} {two:>9.2} {three:>9.2} %  {:>5} {:>8.2} % {:>6}  {:>4.1} {:>10.0} {:>9}",
                outcome.case,
                outcome.starts,
                outcome.wrong,
                100.0 * outcome.ambiguous,
                outcome.blind,
                outcome.seen,
                outcome.effort.0,
                outcome.effort.1
            );
        }
        Ok(())
    }
}
