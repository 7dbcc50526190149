//! The project's own commands: `cargo xtask --help`.

mod packages;
mod seeds;
mod test;

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
    Seeds(seeds::Seeds),
    Test(test::Test),
}

fn main() -> ExitCode {
    let outcome = match Xtask::parse().command {
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
