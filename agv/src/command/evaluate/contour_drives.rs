//! `agv evaluate contour-drives`.

use agv_lab::evaluate::contour_worlds::{SiteKind, drive_in_worlds};

use crate::command::progress;

const HELP: &str = "\
A pose is determined if the surfaces that did not move tell it to 3 mm and 0.03 deg by the information matrix of their true distances; it
is good within 10 mm and 0.1 deg; it is said not to be where twice a standard deviation is beyond that.

Examples:
  agv evaluate contour-drives --drives 4 --seconds 20
  agv evaluate contour-drives --drives 50 --seed 100000 --only dock --json

Keys of --json: an array of world, moved_share, drives, determined_share, determined and others: each poses, good_share, said_share,
mi_share (further off than the protection level), position_mm, heading_deg (median, p95, max), worst_seed.";

/// How well a vehicle drives by a kept map of contours alone, in simulated worlds that have changed since.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct ContourDrives {
    /// Drives in worlds of each kind.
    #[arg(long, default_value_t = 25, value_parser = clap::value_parser!(u64).range(1..))]
    drives: u64,
    /// Length of a drive, s.
    #[arg(long, default_value_t = 60.0, value_parser = seconds)]
    seconds: f64,
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

/// A length of a drive of which some poses count.
fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("'{text}' is no number"))?;
    if (2.0..=3600.0).contains(&seconds) { Ok(seconds) } else { Err("a drive lasts 2 to 3600 seconds".into()) }
}

impl ContourDrives {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let kinds: Vec<_> = SiteKind::ALL.into_iter().filter(|kind| kind.name().contains(&self.only)).collect();
        anyhow::ensure!(!kinds.is_empty(), "no world's name contains '{}'", self.only);
        let bar = progress::bar("driving", 2 * self.drives * kinds.len() as u64);
        let mut found = Vec::new();
        for kind in kinds {
            for moved_share in [0.0, 0.3] {
                let seeds = (self.seed, self.drives);
                found.push(drive_in_worlds(kind, moved_share, self.seconds, seeds, || bar.inc(1))?);
            }
        }
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&found)?);
            return Ok(());
        }
        println!(
            "world      moved  poses    determined  good     said     mm: median, 95 %, most (seed)  deg: 95 %, most  beyond the level"
        );
        for of in &found {
            let determined = &of.determined;
            println!(
                "{:<10} {:>3.0} % {:>8} {:>9.2} % {:>6.2} % {:>6.2} % {:>8.1} {:>6.1} {:>6.1} ({}) {:>8.3} {:>6.3} {:>10.3} %",
                of.world,
                100.0 * of.moved_share,
                determined.poses + of.others.poses,
                100.0 * of.determined_share,
                100.0 * determined.good_share,
                100.0 * determined.said_share,
                determined.position_mm.median,
                determined.position_mm.p95,
                determined.position_mm.max,
                determined.worst_seed,
                determined.heading_deg.p95,
                determined.heading_deg.max,
                100.0 * determined.mi_share,
            );
        }
        Ok(())
    }
}
