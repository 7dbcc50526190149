//! `agv evaluate trust`.

use std::path::PathBuf;

use agv_host_sim::output_file;
use agv_lab::campaign::Shard;
use agv_lab::trust::figures::{Figures, figures};
use agv_lab::trust::kinds::{self, Catalogue, Kind, NOTHING};
use agv_lab::trust::page::{diagrams, page};
use agv_lab::trust::row::{self, Row};
use agv_lab::trust::sweep::{self, run};
use agv_lab::trust::threats::threats;
use agv_lab::trust::trial::Trial;
use agv_lab::trust::worst::{Worst, WorstValues};
use anyhow::{Context as _, ensure};

use super::tested_arguments::TestedArguments;
use crate::command::output::{check_files, note};
use crate::command::progress;

/// Whether the vehicle may be trusted: kinds of faults at every size, in halls that are drawn, judged at the bus.
///
/// Each kind is driven at each of its sizes; the worst size of each kind is driven again on other seeds, and that is what is
/// told. The chapter "Trust" of the book has the definitions.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Trust {
    /// Only kinds with this in their names, and none beside them.
    #[arg(long)]
    only: Option<String>,
    /// Runs of each size of each kind.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    sweep_runs: u64,
    /// Runs of the worst size of each kind.
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Runs without a fault.
    #[arg(long, default_value_t = 4800, value_parser = clap::value_parser!(u64).range(1..))]
    sound_runs: u64,
    /// Runs with two faults each, of kinds and sizes that are drawn.
    #[arg(long, default_value_t = 3000)]
    pairs: u64,
    /// A spot check instead: so many runs of kinds, sizes and halls that are drawn by --seed.
    #[arg(long, value_name = "RUNS", conflicts_with_all = ["shard", "swept", "merge"])]
    sample: Option<u64>,
    /// Seed of --sample.
    #[arg(long, default_value_t = 1, requires = "sample")]
    seed: u64,
    /// First seed of the sweep; those of the worst sizes are 50000 later, those of the pairs 75000. Seeds below 1000 are for development.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Make only the runs of part I of N, counted from 0, and write their rows to --output: those of the sweep, or with --swept
    /// those of the worst sizes, without a fault and of pairs.
    #[arg(long, value_name = "I/N", requires = "output", conflicts_with = "set")]
    shard: Option<Shard>,
    /// Where the rows of a part go, a line of JSON each.
    #[arg(long, requires = "shard")]
    output: Option<PathBuf>,
    /// The rows of all parts of the sweep, so that it is not driven again; with --merge, to tell what each size has shown.
    #[arg(long, num_args = 1.., value_name = "ROWS", conflicts_with = "set")]
    swept: Vec<PathBuf>,
    /// Tell the figures of the rows of all parts, and drive nothing.
    #[arg(long, num_args = 1.., value_name = "ROWS", conflicts_with_all = ["shard", "set"])]
    merge: Vec<PathBuf>,
    /// Write a page with the Stanford diagrams.
    #[arg(long, value_name = "FILE.html", conflicts_with = "shard")]
    report: Option<PathBuf>,
    /// Write the Stanford diagrams, `stanford_nominal.svg` and `stanford_faults.svg`, into a folder.
    #[arg(long, value_name = "FOLDER", conflicts_with = "shard")]
    diagrams: Option<PathBuf>,
    /// Write the table of all kinds, and of every size if the sweep is known, as a page of Markdown.
    #[arg(long, value_name = "FILE.md", conflicts_with = "shard")]
    threats: Option<PathBuf>,
    /// One JSON object instead of the table.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    tested: TestedArguments,
}

const HELP: &str = "\
Examples:
  agv evaluate trust --sweep-runs 1 --runs 2 --sound-runs 10
  agv evaluate trust --only 'laser shifted' --runs 20
  agv evaluate trust --sample 100 --seed 7
  agv evaluate trust --only nothing --sound-runs 30 --set odometry.slip=0.003
  agv evaluate trust --vehicle differential --gyro --sweep-runs 1 --runs 2 --sound-runs 10
  agv evaluate trust --vehicle omni4 --slip 0.001 --set odometry.slip=0.002 --only nothing --sound-runs 15
  agv evaluate trust --contours --sample 100 --seed 7
  agv evaluate trust --halls sketches --only nothing --sound-runs 70
  agv evaluate trust --world easy --only nothing --sound-runs 30
  agv evaluate trust --first-seed 100000 --json
  agv evaluate trust --first-seed 100000 --shard 0/2 --output sweep0.jsonl
  agv evaluate trust --first-seed 100000 --swept sweep0.jsonl sweep1.jsonl --shard 0/2 --output worst0.jsonl
  agv evaluate trust --merge worst0.jsonl worst1.jsonl --json --diagrams docs/src/trust
  agv evaluate trust --merge worst0.jsonl worst1.jsonl --swept sweep0.jsonl sweep1.jsonl --threats threats.md

Keys of --json: runs, panics, mi_share, hmi_events, worst_hmi_s, worst_hmi_m, integrity_failures, nominal_hours, nominal_km,
nominal_mi, nominal_hmi, refused_halls, availability_travel, availability_docking, availability_docking_of_all,
continuity_per_100km, false_alarms {check: count}, recovered_share, recovered_share_of_all, pl_nominal_mm, pl_nominal_deg,
error_over_pl_max, first_claim_s [95 %, worst], worst {hmi_s, hmi_m, availability_travel, availability_docking, losses,
pl_nominal_mm, pl_nominal_deg, error_over_pl, first_claim_s: value and seed}, bounds {failures_of_singles, distinct_scenes, nominal_mi,
nominal_hmi, losses_per_100km, false_alarms_per_100km: exact, 95 %}, seeds [first, last], class_c [kind], per_fault [kind,
worst_size, unit, runs, failures, failures_of_all, bound, worst_seed, worst_hmi_s, worst_hmi_m, hidden_s, error_over_pl_max, share_claimed,
class, found, found_s, found_m, found_by, sizes [size, runs, failures, worst_hmi_s, error_over_pl_max, share_claimed]], pairs
and pairs_apart {runs, failures, bound, hmi_events, worst_hmi_s, worst_hmi_m, failed [kinds, seed, hmi_s, hidden_by]},
stanford_nominal and stanford_faults {cell_mm, cells [level, error, claims]}, settings [those of --set], vehicle, gyro,
contours, world, halls, slip [if --slip], gyro_scale_error [if --gyro-scale-error].";

/// The Stanford diagrams: without faults, and with them.
const DIAGRAMS: [&str; 2] = ["stanford_nominal.svg", "stanford_faults.svg"];

impl Trust {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let diagrams = self.diagrams.iter().flat_map(|folder| DIAGRAMS.map(|name| folder.join(name)));
        let files = [&self.report, &self.threats, &self.output].into_iter().flatten().cloned();
        check_files(&diagrams.chain(files).collect::<Vec<_>>())?;
        let mut catalogue = kinds::read(&self.tested.kinds)?;
        self.leave_out(&mut catalogue)?;
        let all = &catalogue.kinds;
        let is_wanted = |kind: &&Kind| self.only.as_ref().is_none_or(|only| kind.name.contains(only));
        let (sound, faults): (Vec<Kind>, Vec<Kind>) =
            all.iter().filter(is_wanted).cloned().partition(|kind| kind.name == NOTHING);
        ensure!(!sound.is_empty() || !faults.is_empty(), "no kind has {:?} in its name", self.only.unwrap_or_default());
        if !self.merge.is_empty() {
            return self.tell(&row::read(&self.merge, all)?, &row::read(&self.swept, all)?, &catalogue);
        }
        self.tested.parameters()?;
        if let Some(runs) = self.sample {
            let rows = self.make("spot check", &sweep::sample(&faults, runs, self.seed), Shard::ALL)?;
            return self.tell(&rows, &[], &catalogue);
        }
        let shard = self.shard.unwrap_or(Shard::ALL);
        let swept = if self.swept.is_empty() {
            let trials = sweep::sweep(&faults, self.sweep_runs, self.first_seed);
            let swept = self.make("every size", &trials, shard)?;
            if let Some(output) = &self.output {
                return Ok(row::write(output, &swept)?);
            }
            swept
        } else {
            row::read(&self.swept, all)?
        };
        let mut trials = sweep::worst(&faults, &swept, self.runs, self.first_seed);
        trials.extend(sweep::sweep(&sound, self.sound_runs, self.first_seed + sweep::OTHER_SEEDS));
        trials.extend(sweep::pairs(&faults, self.pairs, self.first_seed));
        let rows = self.make("worst sizes", &trials, shard)?;
        match &self.output {
            Some(output) => Ok(row::write(output, &rows)?),
            None => self.tell(&rows, &swept, &catalogue),
        }
    }

    /// Leaves out the kinds of faults that the vehicle cannot have, and names them.
    fn leave_out(&self, catalogue: &mut Catalogue) -> anyhow::Result<()> {
        let vehicle = self.tested.equipment.believed();
        let mut impossible = Vec::new();
        catalogue.kinds.retain(|kind| {
            let is_possible = kind.is_possible(&vehicle);
            impossible.extend((!is_possible).then(|| kind.name.clone()));
            is_possible
        });
        if !impossible.is_empty() {
            note(&format!("agv: left out, as the vehicle cannot have them: {}", impossible.join(", ")));
        }
        ensure!(!catalogue.kinds.is_empty(), "the vehicle can have none of the kinds of faults");
        Ok(())
    }

    /// Makes the runs of a part.
    fn make(&self, what: &'static str, trials: &[Trial], shard: Shard) -> anyhow::Result<Vec<Row>> {
        let bar = progress::bar(what, (0..trials.len()).filter(|run| shard.has(*run)).count() as u64);
        let rows =
            self.tested.with(|tested| run(trials, shard, tested, || bar.inc(1))).context("a run cannot be made")?;
        bar.finish_and_clear();
        Ok(rows)
    }

    fn tell(&self, rows: &[Row], swept: &[Row], catalogue: &Catalogue) -> anyhow::Result<()> {
        ensure!(!rows.is_empty(), "there is no run");
        let figures = figures(rows, swept, catalogue);
        if let Some(report) = &self.report {
            page(&figures)?.write(report).with_context(|| report.display().to_string())?;
        }
        if let Some(path) = &self.threats {
            output_file::write(path, threats(&figures)).with_context(|| path.display().to_string())?;
        }
        if let Some(folder) = &self.diagrams {
            for (name, diagram) in DIAGRAMS.iter().zip(diagrams(&figures)?) {
                let path = folder.join(name);
                output_file::write(&path, diagram.one_line()).with_context(|| path.display().to_string())?;
            }
        }
        if self.json {
            let mut told = serde_json::to_value(&figures)?;
            let TestedArguments { equipment, contours, settings, halls, world, .. } = &self.tested;
            told["settings"] = settings.texts().into();
            told["vehicle"] = serde_json::to_value(equipment.vehicle)?;
            told["gyro"] = equipment.gyro.into();
            told["contours"] = (*contours).into();
            told["halls"] = serde_json::to_value(halls)?;
            told["world"] = serde_json::to_value(world)?;
            for (name, value) in [("slip", equipment.slip), ("gyro_scale_error", equipment.gyro_scale_error)] {
                if let Some(value) = value {
                    told[name] = value.into();
                }
            }
            println!("{}", serde_json::to_string_pretty(&told)?);
        } else {
            print(&figures);
            self.tested.print_settings();
        }
        Ok(())
    }
}

fn print(figures: &Figures) {
    println!(
        "{:<36} {:>10} {:<6} {:>5} {:>8} {:>6} {:>6} {:>7} {:>7} {:>8} {:>7} class, found by",
        "kind", "worst size", "", "runs", "failures", "of all", "seed", "hmi s", "hmi m", "error/pl", "claimed"
    );
    for of in &figures.per_fault {
        println!(
            "{:<36} {:>10} {:<6} {:>5} {:>8} {:>6} {:>6} {:>7.2} {:>7.2} {:>8.2} {:>6.1}% {:?} {}",
            of.kind,
            of.worst_size,
            of.unit,
            of.runs,
            of.failures,
            of.failures_of_all,
            of.worst_seed,
            of.worst_hmi_s,
            of.worst_hmi_m,
            of.error_over_pl_max.unwrap_or(f64::INFINITY),
            100.0 * of.share_claimed,
            of.class,
            of.found_by
        );
    }
    let share = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{:.2} %", 100.0 * value));
    println!(
        "\n{} runs, seeds {} to {}: {} integrity failures, {} hazardous events, the longest {:.1} s and {:.1} m",
        figures.runs,
        figures.seeds[0],
        figures.seeds[1],
        figures.integrity_failures,
        figures.hmi_events,
        figures.worst_hmi_s,
        figures.worst_hmi_m
    );
    for (name, pairs) in [("pairs", &figures.pairs), ("pairs apart", &figures.pairs_apart)] {
        println!("{name}: {} of {} fail", pairs.failures, pairs.runs);
        for pair in &pairs.failed {
            let [(one, size), (other, other_size)] = &pair.kinds;
            println!("  {one} {size} with {other} {other_size}, seed {}, {:.2} s", pair.seed, pair.hmi_s);
        }
    }
    for (check, count) in &figures.false_alarms {
        println!("without faults, {check}: {count} false alarms in {:.1} km", figures.nominal_km);
    }
    println!(
        "without faults, {:.1} h and {:.1} km: {} misleading outputs, available {} (travel) and {} (docking)",
        figures.nominal_hours,
        figures.nominal_km,
        figures.nominal_mi,
        share(figures.availability_travel),
        share(figures.availability_docking)
    );
    print_worst(&figures.worst);
}

/// What the worst of the drives without faults has shown, and its seed.
fn print_worst(worst: &WorstValues) {
    let lines = [
        ("available to travel, %", worst.availability_travel, 100.0),
        ("available to dock, %", worst.availability_docking, 100.0),
        ("losses of availability", worst.losses, 1.0),
        ("protection level, mm", worst.pl_nominal_mm, 1.0),
        ("protection level, deg", worst.pl_nominal_deg, 1.0),
        ("error over protection level", worst.error_over_pl, 1.0),
        ("time to the first claim, s", worst.first_claim_s, 1.0),
    ];
    for (name, worst, scale) in lines {
        if let Some(Worst { value, seed }) = worst {
            println!("the worst drive without faults, {name}: {:.2}, seed {seed}", scale * value);
        }
    }
}
