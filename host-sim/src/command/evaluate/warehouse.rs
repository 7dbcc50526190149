//! `agv evaluate warehouse`.

use agv_host_sim::evaluate::warehouse::{Experiment, Map, PATHS, experiment};
use indicatif::{ProgressBar, ProgressStyle};

/// How precisely a vehicle ends its way in the standard block storage: paths P1 to P4, each with each kind of map.
#[derive(clap::Args)]
pub struct Warehouse {
    /// Seeds an experiment.
    #[arg(long, default_value_t = 30)]
    runs: usize,
    /// One JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

impl Warehouse {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::ensure!(self.runs > 0, "--runs must be at least 1");
        let progress = ProgressBar::new((PATHS.len() * Map::ALL.len() * self.runs) as u64).with_style(
            ProgressStyle::with_template("{bar:30} {pos}/{len} runs, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        let mut experiments = Vec::new();
        for map in Map::ALL {
            for path in PATHS {
                experiments.push(experiment(path, map, self.runs, || progress.inc(1))?);
            }
        }
        progress.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&experiments)?);
        } else {
            print_table(&experiments);
        }
        Ok(())
    }
}

fn print_table(experiments: &[Experiment]) {
    println!("name  map         path m  runs    ok  position mm median/95 %/max    heading deg median/95 %/max   NEES");
    for experiment in experiments {
        let map = serde_json::to_value(experiment.map).unwrap_or_default();
        println!(
            "{:<5} {:<11} {:>6.1} {:>5} {:>4.0}% {:>10.1} {:>8.1} {:>8.1}   {:>10.3} {:>8.3} {:>8.3} {:>7.1}  x{:.0}",
            experiment.name,
            map.as_str().unwrap_or_default(),
            experiment.path_m,
            experiment.runs,
            100.0 * experiment.ok_share,
            experiment.position_mm.median,
            experiment.position_mm.p95,
            experiment.position_mm.max,
            experiment.heading_deg.median,
            experiment.heading_deg.p95,
            experiment.heading_deg.max,
            experiment.nees,
            experiment.realtime_factor,
        );
    }
}
