//! `agv evaluate contour-starts`.

use agv_lab::evaluate::contour_worlds::{SiteKind, run};

use crate::command::progress;

/// How often a vehicle that is switched on in a kept map of contours finds itself, in simulated worlds.
#[derive(clap::Args)]
pub struct ContourStarts {
    /// Starts in worlds of each kind.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..))]
    starts: u64,
    /// Seed of the first world; thresholds were chosen with seeds below 1000.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only worlds whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl ContourStarts {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let kinds: Vec<_> = SiteKind::ALL.into_iter().filter(|kind| kind.name().contains(&self.only)).collect();
        anyhow::ensure!(!kinds.is_empty(), "no world's name contains '{}'", self.only);
        let bar = progress::bar("starting vehicles", 2 * self.starts * kinds.len() as u64);
        let mut outcomes = Vec::new();
        for kind in kinds {
            for moved_share in [0.0, 0.3] {
                outcomes.push(run(kind, moved_share, self.seed, self.starts, || bar.inc(1)));
            }
        }
        bar.finish_and_clear();
        println!("{}", serde_json::to_string_pretty(&outcomes)?);
        Ok(())
    }
}
