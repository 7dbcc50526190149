//! `agv evaluate trial`.

use std::fmt::Write as _;
use std::path::PathBuf;

use agv_host_sim::output_file;
use agv_lab::trust::judge::STEP;
use agv_lab::trust::kinds::{self, Catalogue, Kind, NOTHING};
use agv_lab::trust::row::Row;
use agv_lab::trust::sweep;
use agv_lab::trust::trace::{TRACE_HEADER, TraceLine};
use agv_lab::trust::trial::{Tested, Trial};
use anyhow::{Context as _, anyhow, bail, ensure};

use super::tested_arguments::TestedArguments;
use crate::command::output::check_files;
use crate::command::progress;

/// Single runs of `agv evaluate trust` again: of one fault or two, each of one size, with the seeds that its table names.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct TrialArguments {
    /// A fault and its size; of a kind without sizes the name alone. Twice for a pair, in the order of the table; not at all for a run without
    /// a fault.
    #[arg(long, value_name = "KIND=SIZE")]
    fault: Vec<String>,
    /// First seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// First scene instead: what a seed draws for its kinds, `scene` in the rows.
    #[arg(long, conflicts_with = "seed")]
    scene: Option<u64>,
    /// Runs, of this seed and those after it.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// What the bus says each 10 ms of one run, beside the truth.
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    /// The rows as an array of JSON objects instead of the table.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    tested: TestedArguments,
}

const HELP: &str = "\
Examples:
  agv evaluate trial --fault 'carried on=3' --seed 930247
  agv evaluate trial --fault 'laser shifted forward=0.15' --seed 1 --runs 25
  agv evaluate trial --fault 'power cut=1' --fault 'laser turned=2' --seed 3 --trace trace.csv
  agv evaluate trial --seed 7 --runs 10 --json
  agv evaluate trial --world easy --fault 'carried on=9' --scene 50216

Keys of --json: kind, size, with [kind, size], seed, scene, is_accepted, can_recover, outcome {outputs, first_claim, judged, available,
docking, docking_available, within_docking, losses, claims, misleading, hidden_hazardous (these in outputs, one each 10 ms), hazards,
worst_hazard_s, worst_hazard_m, failures, failures_of_all, most_over_level, driven_um, nominal_mm, nominal_cdeg, stanford, alarms {check: count}, found
{after_ms, after_mm, by}, ends_right}; outcome is null after a panic.";

impl TrialArguments {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(self.trace.is_none() || self.runs == 1, "--trace is of one run: it takes no --runs");
        check_files(&self.trace)?;
        let catalogue = kinds::read(&self.tested.kinds)?;
        let mut faults = self.faults(&catalogue)?.into_iter();
        let (kind, size) = faults.next().unwrap_or((nothing(&catalogue)?, 1.0));
        let with = faults.next();
        ensure!(faults.next().is_none(), "no more than two faults come together");
        let parameters = self.tested.parameters()?;
        for kind in [Some(kind), with.map(|(kind, _)| kind)].into_iter().flatten() {
            ensure!(kind.is_possible(&parameters.vehicle), "the vehicle cannot have {:?}", kind.name);
        }
        let first = self.scene.unwrap_or(self.seed);
        let last = first.checked_add(self.runs - 1).ok_or_else(|| anyhow!("there are no seeds after the last one"))?;
        let trial = |seed| match self.scene {
            Some(_) => Trial::in_scene((kind, size), with, seed),
            None => Trial::new((kind, size), with, seed),
        };
        let trials: Vec<Trial> = (first..=last).map(trial).collect();
        let rows = self.tested.with(|tested| self.make(&trials, tested))?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&rows)?);
        } else {
            print(&rows);
            self.tested.print_settings();
        }
        Ok(())
    }

    /// The faults of one run.
    fn faults<'a>(&self, catalogue: &'a Catalogue) -> anyhow::Result<Vec<(&'a Kind, f64)>> {
        let fault = |text: &String| {
            let (name, size) = text.rsplit_once('=').map_or((text.as_str(), None), |(name, size)| (name, Some(size)));
            let kind = catalogue.kinds.iter().find(|kind| kind.name == name);
            let kind = kind.ok_or_else(|| anyhow!("no kind of fault is called {name:?}"))?;
            let size = match size {
                Some(size) => size.parse().ok().filter(|size: &f64| size.is_finite()),
                None if kind.sizes.is_empty() => Some(1.0),
                None => {
                    bail!("the kind {name:?} has a size, as --fault '{name}={}'", kind.sizes.last().unwrap_or(&1.0))
                }
            };
            let size = size.ok_or_else(|| anyhow!("the size of {text:?} is no number"))?;
            kind.at(size, 0.0).map_err(|problem| anyhow!("{text:?}: {problem}"))?;
            Ok((kind, size))
        };
        self.fault.iter().map(fault).collect()
    }

    fn make(&self, trials: &[Trial], tested: &Tested) -> anyhow::Result<Vec<Row>> {
        let context = "a run cannot be made";
        let (Some(path), [trial]) = (&self.trace, trials) else {
            let bar = progress::bar("runs", trials.len() as u64);
            let rows = sweep::run(trials, agv_lab::campaign::Shard::ALL, tested, || bar.inc(1)).context(context)?;
            bar.finish_and_clear();
            return Ok(rows);
        };
        let (mut text, mut moments) = (format!("{TRACE_HEADER}\n"), 0_u32);
        let row = sweep::row(trial, tested, |moment| {
            let _ = writeln!(text, "{}", TraceLine { time: STEP * f64::from(moments), moment });
            moments += 1;
        })
        .context(context)?;
        output_file::write(path, text).with_context(|| path.display().to_string())?;
        Ok(vec![row])
    }
}

/// The kind without a fault.
fn nothing(catalogue: &Catalogue) -> anyhow::Result<&Kind> {
    let kind = catalogue.kinds.iter().find(|kind| kind.name == NOTHING);
    kind.ok_or_else(|| anyhow!("the file has no kind {NOTHING:?}: --fault is needed"))
}

fn print(rows: &[Row]) {
    println!(
        "{:>10} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>10} {:>6}  found by, after s; false alarms without a fault",
        "seed", "failures", "hmi s", "hmi m", "hidden s", "mi s", "error/pl", "available", "losses"
    );
    for row in rows {
        let Some(outcome) = &row.outcome else {
            println!("{:>10} panic", row.seed);
            continue;
        };
        let found = outcome.found.as_ref().map(|found| format!("{}, {:.2}", found.by, 1e-3 * found.after_ms as f64));
        let alarms =
            outcome.alarms.iter().filter(|_| row.kind == NOTHING).map(|(check, count)| format!("{check} {count}"));
        println!(
            "{:>10} {:>8} {:>8.2} {:>8.2} {:>8.2} {:>8.2} {:>8.2} {:>8.2} % {:>6}  {}",
            row.seed,
            outcome.failures,
            outcome.worst_hazard_s,
            outcome.worst_hazard_m,
            STEP * outcome.hidden_hazardous as f64,
            STEP * outcome.misleading as f64,
            outcome.most_over_level,
            100.0 * outcome.available as f64 / outcome.judged.max(1) as f64,
            outcome.losses,
            found.into_iter().chain(alarms).collect::<Vec<_>>().join("; ")
        );
    }
}
