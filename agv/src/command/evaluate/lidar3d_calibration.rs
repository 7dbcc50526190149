//! `agv evaluate lidar3d-calibration`.

use std::path::PathBuf;

use agv_host_sim::data;
use agv_lab::evaluate::lidar3d_calibration;
use agv_lidar3d::{geometry, intrinsic};
use anyhow::Context;

use crate::command::progress;

/// Calibration files of HDL-64E sensors in the folder of real data.
const TRUTHS: [&str; 9] = [
    "ajaayc_db.xml",
    "libvelodyne_calib-HDL-64E.xml",
    "mdamien_db.xml",
    "ros_64e_s2.1-sztaki.xml",
    "ros_64e_s2.1-sztaki.yaml",
    "ros_64e_s3-xiesc.yaml",
    "ros_64e_utexas.yaml",
    "vd_HDL-64E_S3-VeloView.yml",
    "veloview_HDL-64.xml",
];

/// How well simulated scans of a wall bring disturbed parameters of all lasers back.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  agv evaluate lidar3d-calibration\n  agv evaluate lidar3d-calibration --seed 7 --json\n  \
                  agv evaluate lidar3d-calibration --truth db.xml --offsets alternate"
)]
pub struct Lidar3dCalibration {
    /// Calibration file that is the truth; without it, every HDL-64E file of the folder of real data.
    #[arg(long)]
    truth: Vec<PathBuf>,
    /// How the offsets of a beam are measured.
    #[arg(long, default_value = "orthogonal")]
    offsets: Offsets,
    /// What the adjustment makes small.
    #[arg(long, default_value = "along-beam")]
    residual: Residual,
    /// Seed of noise and disturbance.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Offsets {
    Orthogonal,
    Alternate,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Residual {
    /// Distance to the plane along the beam.
    AlongBeam,
    /// Distance to the plane at right angles (thesis M, equation 3.7).
    Perpendicular,
}

impl Lidar3dCalibration {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let offsets = match self.offsets {
            Offsets::Orthogonal => geometry::Offsets::Orthogonal,
            Offsets::Alternate => geometry::Offsets::Alternate,
        };
        let residual = match self.residual {
            Residual::AlongBeam => intrinsic::Residual::AlongBeam,
            Residual::Perpendicular => intrinsic::Residual::Perpendicular,
        };
        let truths = if self.truth.is_empty() {
            let folder = data::folder().context("no folder of real data: set AGV_DATA, or name a file with --truth")?;
            TRUTHS.iter().map(|name| folder.join("lidar3d/calib").join(name)).collect()
        } else {
            self.truth
        };
        let bar = progress::bar("calibrations", truths.len() as u64);
        let mut outcomes = Vec::new();
        for truth in truths {
            outcomes.push(lidar3d_calibration::run(&truth, offsets, residual, self.seed)?);
            bar.inc(1);
        }
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "worst of all lasers             D mm   theta deg  alpha deg  within  26 m: thick mm  sum of squares      s"
        );
        for outcome in outcomes {
            println!(
                "{:<29} {:>6.2} {:>11.4} {:>10.4}  {:<6} {:>6.1} -> {:>4.1} {:>9.1} / {:.1} {:>6.1}",
                outcome.truth,
                1000.0 * outcome.worst_distance_m,
                outcome.worst_elevation_deg,
                outcome.worst_rotation_deg,
                if outcome.is_within_limits { "yes" } else { "no" },
                1000.0 * outcome.held_out.thickness_before_m,
                1000.0 * outcome.held_out.thickness_after_m,
                outcome.used.sum_of_squares_ratio,
                outcome.held_out.sum_of_squares_ratio,
                outcome.seconds
            );
        }
        Ok(())
    }
}
