//! `agv evaluate warehouse`.

use std::path::PathBuf;

use agv_lab::equipment::Equipment;
use agv_lab::evaluate::warehouse::{Experiment, Method, PATHS, experiment};
use agv_lab::evaluate::warehouse_disturbance::Disturbance;
use agv_lab::evaluate::warehouse_page::page;
use anyhow::Context as _;
use clap::ValueEnum as _;

use crate::command::output::check_files;
use crate::command::progress;

/// How precisely a vehicle ends its way in the standard block storage: paths P1 to P4, each with each kind of map.
#[derive(clap::Args)]
pub struct Warehouse {
    /// Runs of each experiment, each with a seed of its own.
    #[arg(long, default_value_t = 30)]
    runs: u64,
    /// First seed. Noise and thresholds were chosen on the seeds from 1001 on.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Only experiments whose name contains this, such as "P1" or "static".
    #[arg(long, default_value = "")]
    only: String,
    /// Only experiments with this map, as the JSON names it, such as "slam".
    #[arg(long)]
    map: Option<String>,
    /// What makes the drive harder, one or more of them, or all.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "none")]
    disturb: Vec<Disturbance>,
    /// Every disturbance, and the standard drive.
    #[arg(long, conflicts_with = "disturb")]
    disturb_all: bool,
    #[command(flatten)]
    equipment: Equipment,
    /// One JSON array instead of a table.
    #[arg(long)]
    json: bool,
    /// Write a page that compares all of them.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl Warehouse {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        check_files(&self.report)?;
        anyhow::ensure!(self.runs > 0, "--runs must be at least 1");
        let seeds = self.first_seed..self.first_seed.saturating_add(self.runs);
        let disturbances = if self.disturb_all { Disturbance::ALL.to_vec() } else { self.disturb };
        let map_name = |method: &Method| serde_json::to_value(method.map).ok()?.as_str().map(str::to_owned);
        let wanted: Vec<_> = Method::ALL
            .iter()
            .filter(|method| self.map.is_none() || map_name(method) == self.map)
            .flat_map(|method| PATHS.map(|path| (path, method)))
            .filter(|(path, method)| format!("{} {}", path.0, method.name).contains(&self.only))
            .flat_map(|(path, method)| disturbances.iter().map(move |disturbance| (path, method, *disturbance)))
            .collect();
        anyhow::ensure!(!wanted.is_empty(), "no experiment has such a name and such a map");
        let progress = progress::bar("runs", wanted.len() as u64 * self.runs);
        let experiments: Vec<Experiment> = wanted
            .into_iter()
            .map(|(path, method, disturbance)| {
                experiment(path, method, (disturbance, self.equipment), seeds.clone(), || progress.inc(1))
            })
            .collect::<Result<_, _>>()?;
        progress.finish_and_clear();
        if let Some(report) = &self.report {
            page(&experiments).write(report).with_context(|| report.display().to_string())?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&experiments)?);
        } else {
            print_table(&experiments);
        }
        Ok(())
    }
}

fn print_table(experiments: &[Experiment]) {
    println!(
        "{:<28} {:<15} {:>4} {:>5}   {:<22} {:<22} {:>6} {:>7}",
        "", "disturbance", "runs", "ok", "mm median, 95 %, max", "deg median, 95 %, max", "NEES", "speed"
    );
    for experiment in experiments {
        let (position, heading) = (experiment.position_mm, experiment.heading_deg);
        println!(
            "{:<28} {:<15} {:>4} {:>4.0}% {:>7.1} {:>6.1} {:>6.1}   {:>7.3} {:>6.3} {:>6.3} {:>8.1} {:>6.0}x",
            experiment.name,
            experiment.disturbance.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned()),
            experiment.runs,
            100.0 * experiment.ok_share,
            position.median,
            position.p95,
            position.max,
            heading.median,
            heading.p95,
            heading.max,
            experiment.nees,
            experiment.realtime_factor,
        );
    }
}
