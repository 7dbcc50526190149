//! `agv evaluate contour-starts`.

use agv_lab::evaluate::contour_worlds::{SiteKind, run};

use super::arguments::Starts;
use crate::command::progress;

const HELP: &str = "\
An answer is right within 0.1 m and 1 degree. Thresholds were chosen with seeds below 1000. Two fit where a pose that was named has nine tenths of the true one's overlap.

Examples:
  agv evaluate contour-starts --starts 200
  agv evaluate contour-starts --starts 1000 --seed 100000 --only corridor --json";

/// How often a vehicle that is switched on in a kept map of contours finds itself, in simulated worlds.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct ContourStarts {
    #[command(flatten)]
    starts: Starts,
}

/// Starts in worlds of each kind if nothing is said.
const STARTS: u64 = 1000;

impl ContourStarts {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let Starts { starts, seed, only, json } = self.starts;
        let starts = starts.unwrap_or(STARTS);
        let kinds: Vec<_> = SiteKind::ALL.into_iter().filter(|kind| kind.name().contains(&only)).collect();
        anyhow::ensure!(!kinds.is_empty(), "no world's name contains '{only}'");
        let bar = progress::bar("starting vehicles", 2 * starts * kinds.len() as u64);
        let mut outcomes = Vec::new();
        for kind in kinds {
            for moved_share in [0.0, 0.3] {
                outcomes.push(run(kind, moved_share, seed, starts, || bar.inc(1)));
            }
        }
        bar.finish_and_clear();
        if json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "world      moved  starts  right  wrong  ambiguous  two fit  unknown  right of the rest  s, 95 %  effort, most"
        );
        for outcome in outcomes {
            println!(
                "{:<10} {:>4.0} % {:>7} {:>6} {:>6} {:>10} {:>8} {:>8} {:>16.2} % {:>8.2} {:>13.0}",
                outcome.world,
                100.0 * outcome.moved_share,
                outcome.starts,
                outcome.right,
                outcome.wrong,
                outcome.ambiguous,
                outcome.two_fit,
                outcome.unknown,
                100.0 * outcome.right_share,
                outcome.seconds.p95,
                outcome.effort.max,
            );
        }
        Ok(())
    }
}
