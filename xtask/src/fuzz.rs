//! `cargo xtask fuzz`.

use std::process::Command;

use anyhow::{Context, bail};

use crate::repository;
use crate::seeds::Seeds;

/// Run the fuzz targets, each from the seeds of recorded telegrams
#[derive(clap::Args)]
pub struct Fuzz {
    /// Targets; all of them if none is named.
    targets: Vec<String>,
    /// How long each one runs, s.
    #[arg(long, default_value_t = 60)]
    pub seconds: u32,
}

/// Targets of the folder `fuzz`.
const TARGETS: [&str; 19] = [
    "cola_a",
    "cola_b",
    "canopen",
    "slcan",
    "log_reader",
    "velodyne_packet",
    "capture",
    "localizer",
    "can_log",
    "scan_log",
    "layout",
    "table",
    "drawing",
    "point_cloud",
    "lidar_calibration",
    "robot_log",
    "car_park",
    "robot_session",
    "described_table",
];

impl Fuzz {
    /// Every target, for so many seconds.
    pub fn all(seconds: u32) -> Self {
        Self { targets: Vec::new(), seconds }
    }

    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(unknown) = self.targets.iter().find(|target| !TARGETS.contains(&target.as_str())) {
            bail!("{unknown} is no fuzz target; there are {}", TARGETS.join(", "));
        }
        if !is_there() {
            let mut install = Command::new("cargo");
            install.args(["install", "--locked", "cargo-fuzz"]);
            if !install.status().is_ok_and(|status| status.success()) || !is_there() {
                bail!(
                    "cargo-fuzz is missing, or the nightly toolchain; `cargo install cargo-fuzz` and `rustup toolchain install nightly` bring them"
                );
            }
        }
        Seeds {}.run()?;
        if !fuzz(&["build"]).status().context("cargo cannot be started")?.success() {
            bail!("the fuzz targets do not build");
        }
        let targets: Vec<&str> = match self.targets.as_slice() {
            [] => TARGETS.to_vec(),
            named => named.iter().map(String::as_str).collect(),
        };
        for target in targets {
            println!("fuzzing {target} for {} s", self.seconds);
            let mut run = fuzz(&["run", target, "--", "-print_final_stats=1"]);
            run.arg(format!("-max_total_time={}", self.seconds));
            if !run.status().context("cargo cannot be started")?.success() {
                bail!("{target} has found something; see fuzz/artifacts/{target}");
            }
        }
        println!("no findings");
        Ok(())
    }
}

/// `cargo fuzz` in its folder. The toolchain that runs this program is not the one that fuzzes.
fn fuzz(arguments: &[&str]) -> Command {
    let mut command = Command::new("cargo");
    command.args(["+nightly", "fuzz"]).args(arguments).current_dir(repository().join("fuzz"));
    command.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
    command
}

fn is_there() -> bool {
    fuzz(&["--version"]).output().is_ok_and(|output| output.status.success())
}
