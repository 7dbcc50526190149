//! The command `agv`.

mod command;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Localisation of automated guided vehicles: replay, simulate, measure.
#[derive(Parser)]
#[command(name = "agv", version)]
struct Agv {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Import(command::import::Import),
    Simulate(command::simulate::Simulate),
    Replay(command::replay::Replay),
    Map(command::map::Map),
    Evaluate(command::evaluate::Evaluate),
    Features(command::features::Features),
    Nav350(command::nav350::Nav350),
    Record(command::record::Record),
}

fn main() -> ExitCode {
    let outcome = match Agv::parse().command {
        None => Err(anyhow::anyhow!("the default run is not there yet")),
        Some(Command::Import(command)) => command.run(),
        Some(Command::Simulate(command)) => command.run(),
        Some(Command::Replay(command)) => command.run(),
        Some(Command::Map(command)) => command.run(),
        Some(Command::Evaluate(command)) => command.run(),
        Some(Command::Features(command)) => command.run(),
        Some(Command::Nav350(command)) => command.run(),
        Some(Command::Record(command)) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // One line, whatever a library says.
            let complaint = format!("{error:#}");
            eprintln!("agv: {}", complaint.lines().map(str::trim).collect::<Vec<_>>().join(" "));
            ExitCode::FAILURE
        }
    }
}
