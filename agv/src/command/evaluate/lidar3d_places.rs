//! `agv evaluate lidar3d-places`.

use agv_host_sim::data;
use agv_lab::evaluate::lidar3d_places::{self, Outcome};
use anyhow::Context;

use crate::command::progress;

/// How well multi-beam scans recognise places: by signatures of the thesis, normalised and enriched, by images, and by images and
/// alignment of the ten most alike.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  agv evaluate lidar3d-places --set moosmann\n  agv evaluate lidar3d-places --set moosmann --json"
)]
pub struct Lidar3dPlaces {
    /// Recording to measure on.
    #[arg(long)]
    set: Set,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Set {
    Moosmann,
}

impl Lidar3dPlaces {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let Set::Moosmann = self.set;
        let folder = data::folder().context("there is no folder of real data (AGV_DATA)")?;
        let bar = progress::bar("signatures", 0);
        let outcomes = lidar3d_places::moosmann(&folder.join("lidar3d/moosmann/MuehlburgerTor"), |scans| {
            bar.set_length(scans as u64);
            bar.inc(1);
        })?;
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "method                          protocol columns  R at P 1  max F1  learned P / R  ms    us    turn  bytes"
        );
        for outcome in outcomes {
            println!(
                "{:<31} {:<8} {:<7} {:>9.3} {:>7.3} {:>13} {:>5.2} {:>5.3} {:>6.3} {:>6}",
                outcome.method,
                outcome.protocol,
                if outcome.half_columns { "half" } else { "all" },
                outcome.recall_at_full_precision,
                outcome.max_f1,
                learned(&outcome),
                outcome.signature_ms,
                outcome.compare_us,
                outcome.orientation_within_2_deg,
                outcome.bytes
            );
        }
        Ok(())
    }
}

fn learned(outcome: &Outcome) -> String {
    let shares = outcome.learned_precision.zip(outcome.learned_recall);
    shares.map_or("-".to_owned(), |(precision, recall)| format!("{precision:.3} / {recall:.3}"))
}
