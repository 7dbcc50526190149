//! `cargo xtask emulate`.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, bail};

use crate::firmware::image::{Board, H743};
use crate::{chip, firmware, repository, requirements};

/// Build the firmware and drive a vehicle with it in emulation: arguments behind -- go to `agv emulate`
#[derive(clap::Args)]
pub struct Emulate {
    /// Drive in virtual time with the image that is flashed, in the emulated chip of its board.
    #[arg(long)]
    chip: bool,
    /// Feature of the board whose chip it is: h743 or h723.
    #[arg(long, default_value = H743.feature)]
    board: String,
    /// Arguments of `agv emulate`, such as --seconds 30 or --scenario FILE.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl Emulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        let mut agv = Command::new(cargo);
        agv.args(["run", "--quiet", "--release", "--package", "agv", "--", "emulate"]).args(&self.arguments);
        if self.chip {
            let chip = chip::command(Board::named(&self.board)?, None)?;
            agv.arg("--chip").arg(chip.get_program()).args(chip.get_args()).arg("--serve");
        } else {
            for missing in requirements::prepare_emulator() {
                eprintln!("{missing}");
            }
            agv.arg("--image").arg(firmware::emulated_vehicle()?);
        }
        agv.current_dir(repository());
        if agv.status().context("cargo cannot be started")?.success() { Ok(()) } else { bail!("the drive failed") }
    }
}
