//! `agv evaluate gyro`.

use agv_lab::equipment::{VehicleKind, scale_error};
use agv_lab::evaluate::gyro::{self, GyroOptions, HeadingRow, SlipRow, SoundRow};

use super::super::progress;
use super::arguments::Drives;

const HELP: &str = "\
Examples:
  agv evaluate gyro
  agv evaluate gyro --runs 3 --only slips
  agv evaluate gyro --runs 400 --only sound
  agv evaluate gyro --vehicle differential --runs 40 --json
  agv evaluate gyro --runs 40 --only headings --scale-error 0

Keys of --json: headings [vehicle, before, way, has_gyro, drives, median_deg, mark_95_deg, worst_deg, worst_seed, beyond_level,
false_alarms], slips [vehicle, way, shown_by, drives, told, longest_m, worst_seed, beyond_level],
sound [vehicle, has_gyro, drives, km, false_alarms, seeds].";

/// What is measured.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Heading that is lost without landmarks.
    Headings,
    /// Wheels that slip.
    Slips,
    /// False alarms of vehicles in order.
    Sound,
}

/// How much heading a simulated vehicle loses on 12 m without landmarks, with a gyro and without, and how soon it tells a wheel
/// that slips.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Gyro {
    #[command(flatten)]
    drives: Drives,
    /// One of the tables only.
    #[arg(long)]
    only: Option<Part>,
    /// This vehicle alone. [default: tricycle, differential, bi-steerable and omni4]
    #[arg(long)]
    vehicle: Option<VehicleKind>,
    /// True error of the gyro's scale where headings are measured, share; the seed chooses its sign, and what is stated of it stays
    /// [default: 0.002].
    #[arg(long, value_name = "SHARE", value_parser = scale_error)]
    scale_error: Option<f64>,
}

/// Drives of each kind if nothing is said.
const RUNS: u32 = 5;

/// The word of a value in JSON.
fn word(value: impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

impl Gyro {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let options = GyroOptions {
            drives: self.drives.runs.unwrap_or(RUNS),
            seed: self.drives.seed,
            headings: self.only.is_none_or(|only| only == Part::Headings),
            slips: self.only.is_none_or(|only| only == Part::Slips),
            sound: self.only.is_none_or(|only| only == Part::Sound),
            only: self.vehicle,
            scale_error: self.scale_error,
        };
        let bar = progress::bar("driving", options.count());
        let outcome = gyro::run(&options, || bar.inc(1))?;
        bar.finish_and_clear();
        if self.drives.json {
            println!("{}", serde_json::to_string_pretty(&outcome)?);
            return Ok(());
        }
        if options.headings {
            print_headings(&outcome.headings);
            println!();
        }
        if options.slips {
            print_slips(&outcome.slips);
            println!();
        }
        if options.sound {
            print_sound(&outcome.sound);
        }
        Ok(())
    }
}

fn print_headings(rows: &[HeadingRow]) {
    println!("heading that is lost on 12 m without landmarks, deg");
    println!(
        "{:<13} {:<8} {:<9} {:<5} {:>7} {:>8} {:>8} {:>8} {:>10} {:>12} {:>12}",
        "vehicle",
        "before",
        "way",
        "gyro",
        "drives",
        "median",
        "95 %",
        "worst",
        "its seed",
        "beyond level",
        "false alarms"
    );
    for row in rows {
        println!(
            "{:<13} {:<8} {:<9} {:<5} {:>7} {:>8.3} {:>8.3} {:>8.3} {:>10} {:>12} {:>12}",
            word(row.vehicle),
            word(row.before),
            word(row.way),
            if row.has_gyro { "yes" } else { "no" },
            row.drives,
            row.median_deg,
            row.mark_95_deg,
            row.worst_deg,
            row.worst_seed,
            row.beyond_level,
            row.false_alarms
        );
    }
}

fn print_slips(rows: &[SlipRow]) {
    println!("slip of the first driven wheel by a fifth");
    println!(
        "{:<13} {:<9} {:<11} {:>7} {:>6} {:>12} {:>10} {:>12}",
        "vehicle", "way", "shown by", "drives", "told", "after, m", "its seed", "beyond level"
    );
    for row in rows {
        println!(
            "{:<13} {:<9} {:<11} {:>7} {:>6} {:>12.3} {:>10} {:>12}",
            word(row.vehicle),
            word(row.way),
            word(row.shown_by),
            row.drives,
            row.told,
            row.longest_m,
            row.worst_seed,
            row.beyond_level
        );
    }
}

fn print_sound(rows: &[SoundRow]) {
    println!("vehicles in order, among reflectors");
    println!("{:<13} {:<5} {:>7} {:>8} {:>12} seeds", "vehicle", "gyro", "drives", "km", "false alarms");
    for row in rows {
        let seeds: Vec<String> = row.seeds.iter().map(u64::to_string).collect();
        println!(
            "{:<13} {:<5} {:>7} {:>8.1} {:>12} {}",
            word(row.vehicle),
            if row.has_gyro { "yes" } else { "no" },
            row.drives,
            row.km,
            row.false_alarms,
            seeds.join(" ")
        );
    }
}
