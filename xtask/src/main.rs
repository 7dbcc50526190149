//! The project's own commands: `cargo xtask --help`.

mod audit;
mod chip;
mod dist;
mod emulate;
mod figures;
mod firmware;
mod fuzz;
mod requirements;
mod seeds;
mod test;

use std::path::Path;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// The project's own commands.
#[derive(Parser)]
struct Xtask {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Audit(audit::Audit),
    Chip(chip::Chip),
    Dist(dist::Dist),
    Emulate(emulate::Emulate),
    Figures(figures::Figures),
    Firmware(firmware::Firmware),
    Fuzz(fuzz::Fuzz),
    Seeds(seeds::Seeds),
    Test(test::Test),
}

fn main() -> ExitCode {
    let outcome = match Xtask::parse().command {
        Command::Audit(audit) => audit.run(),
        Command::Chip(chip) => chip.run(),
        Command::Dist(dist) => dist.run(),
        Command::Emulate(emulate) => emulate.run(),
        Command::Figures(figures) => figures.run(),
        Command::Firmware(firmware) => firmware.run(),
        Command::Fuzz(fuzz) => fuzz.run(),
        Command::Seeds(seeds) => seeds.run(),
        Command::Test(test) => test.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The top of the repository.
fn repository() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}
