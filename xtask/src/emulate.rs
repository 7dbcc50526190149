//! `cargo xtask emulate`.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};

use crate::{firmware, repository, requirements};

/// Build the firmware and drive a vehicle with it in emulation: arguments behind -- go to `agv emulate`
#[derive(clap::Args)]
pub struct Emulate {
    /// Arguments of `agv emulate`, such as --seconds 30 or --scenario FILE.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl Emulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        for missing in requirements::prepare_emulator() {
            eprintln!("{missing}");
        }
        let image = firmware::emulated_vehicle()?;
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        let mut agv = Command::new(cargo);
        agv.args(["run", "--quiet", "--release", "--package", "agv", "--", "emulate", "--image"]);
        agv.arg(image).args(self.arguments).current_dir(repository());
        if agv.status().context("cargo cannot be started")?.success() { Ok(()) } else { bail!("the drive failed") }
    }
}
