//! `agv evaluate lidar3d-sharpness`.

use agv_host_sim::data;
use agv_lab::evaluate::lidar3d_sharpness::{self, Thickness};
use anyhow::Context;

/// How much thinner ground and facades of real scans become by calibrating a multi-beam lidar on them.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  agv evaluate lidar3d-sharpness\n  agv evaluate lidar3d-sharpness --json")]
pub struct Lidar3dSharpness {
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

impl Lidar3dSharpness {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let folder = data::folder().context("there is no folder of real data (AGV_DATA)")?;
        let outcome = lidar3d_sharpness::moosmann(&folder.join("lidar3d/moosmann/MuehlburgerTor"))?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcome)?);
            return Ok(());
        }
        println!("surface              patches  points   thickness mm");
        for (name, Thickness { patches, points, before_m, after_m }) in [
            ("ground, used", outcome.ground_used),
            ("facades, used", outcome.facades_used),
            ("ground, held out", outcome.ground_held_out),
            ("facades, held out", outcome.facades_held_out),
        ] {
            println!("{name:<20} {patches:>7} {points:>7} {:>6.1} -> {:.1}", 1000.0 * before_m, 1000.0 * after_m);
        }
        let [distance, elevation, rotation] = outcome.greatest_change;
        println!(
            "{} rows, changed by at most {:.1} mm, {elevation:.3} deg, {rotation:.3} deg",
            outcome.rows,
            1000.0 * distance
        );
        Ok(())
    }
}
