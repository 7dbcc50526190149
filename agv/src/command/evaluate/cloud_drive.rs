//! `agv evaluate cloud-drive`.

use agv_lab::evaluate::cloud_drive::{SensorKind, Site, cloud_drives};

use super::arguments::Drives;
use crate::command::progress;

const HELP: &str = "\
The vehicle is started by a stored place that its first cloud is recognised as. Then the clouds come as scans of a planar laser over
the NAV350 protocol, and the controller follows them in a map of contours. There are no reflectors.

Examples:
  agv evaluate cloud-drive --runs 3
  agv evaluate cloud-drive --site block-storage --sensor vlp16 --runs 10 --json

Keys of --json: an array of site, sensor, drives, recognised, wrong_starts, start_worst_m, good_share (poses within 10 mm and
0.1 deg), worst_drive_share, worst_drive_seed, position_mm and heading_deg [median, 95 % mark, largest], worst_seed, poses.";

/// Drives that are localised by the clouds of a multi-beam lidar.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct CloudDrive {
    /// Where the vehicle drives; both if absent.
    #[arg(long)]
    site: Option<SiteName>,
    /// With which sensor; both if absent.
    #[arg(long)]
    sensor: Option<SensorName>,
    #[command(flatten)]
    drives: Drives,
    /// Only so many seconds of each drive.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
}

/// Drives of each kind if nothing is said.
const RUNS: u32 = 10;

#[derive(Clone, Copy, clap::ValueEnum)]
enum SiteName {
    /// 90 m round a double rack.
    Hall,
    /// 12 m into a lane between pallets.
    BlockStorage,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SensorName {
    /// 16 rings.
    Vlp16,
    /// 64 rings.
    Hdl64e,
}

impl CloudDrive {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::ensure!(self.seconds.is_none_or(|seconds| seconds > 2.0), "--seconds must be more than 2");
        let sites = match self.site {
            None => vec![Site::Hall, Site::BlockStorage],
            Some(SiteName::Hall) => vec![Site::Hall],
            Some(SiteName::BlockStorage) => vec![Site::BlockStorage],
        };
        let sensors = match self.sensor {
            None => vec![SensorKind::Vlp16, SensorKind::Hdl64e],
            Some(SensorName::Vlp16) => vec![SensorKind::Vlp16],
            Some(SensorName::Hdl64e) => vec![SensorKind::Hdl64e],
        };
        let runs = u64::from(self.drives.runs.unwrap_or(RUNS));
        let bar = progress::bar("drives", runs * (sites.len() * sensors.len()) as u64);
        let mut found = Vec::new();
        for (site, sensor) in sites.iter().flat_map(|site| sensors.iter().map(|sensor| (*site, *sensor))) {
            let seeds = self.drives.seed..self.drives.seed + runs;
            found.push(cloud_drives(site, sensor, self.seconds, seeds, || bar.inc(1))?);
        }
        bar.finish_and_clear();
        if self.drives.json {
            println!("{}", serde_json::to_string_pretty(&found)?);
            return Ok(());
        }
        println!(
            "{:<14} {:<8} {:>6} {:>10} {:>6} {:>14}   {:<26} deg",
            "", "", "drives", "recognised", "good", "worst, seed", "mm median, 95 %, max"
        );
        for of in &found {
            println!(
                "{:<14} {:<8} {:>6} {:>10} {:>5.1}% {:>5.1}% {:>7}   {:>6.1} {:>6.1} {:>7.1}      {:>6.3} {:>6.3} {:>6.3}",
                format!("{:?}", of.site),
                format!("{:?}", of.sensor),
                of.drives,
                of.recognised,
                100.0 * of.good_share,
                100.0 * of.worst_drive_share,
                of.worst_drive_seed,
                of.position_mm[0],
                of.position_mm[1],
                of.position_mm[2],
                of.heading_deg[0],
                of.heading_deg[1],
                of.heading_deg[2],
            );
        }
        Ok(())
    }
}
