//! The command `agv`.
#![allow(rustdoc::broken_intra_doc_links, reason = "brackets of help texts are no links")]

mod command;

use std::io::Write;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

/// Localisation of automated guided vehicles: replay, simulate, measure.
///
/// Without a command: simulates a drive into a block storage, maps its world, localises the drive by odometry,
/// reflectors, mapped features and both, prints the errors and writes a report with pictures.
#[derive(Parser)]
#[command(name = "agv", version, after_help = HELP)]
struct Agv {
    /// Print results and errors only: neither progress nor notes.
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    demonstration: command::demonstration::Demonstration,
}

const HELP: &str = "\
Examples:
  agv
  agv --report /tmp/report
  agv simulate block_storage_p2 --output drive.agvlog
  agv replay drive.agvlog --report report
  agv view drive.agvlog
  agv run --demo

Exit codes: 0 done (agv accept says more); 1 it could not be done, and one line on standard error says why; 2 the command line is wrong;
3 an import ended with a warning, and --strict was asked for; 130 ended by a second Ctrl-C.";

#[derive(Subcommand)]
enum Command {
    Import(command::import::Import),
    Export(command::export::Export),
    Simulate(command::simulate::Simulate),
    Replay(command::replay::Replay),
    Check(command::check::Check),
    Accept(command::accept::Accept),
    View(command::view::View),
    Report(command::report::Report),
    Map(command::map::Map),
    Calibrate(command::calibrate::Calibrate),
    Evaluate(command::evaluate::Evaluate),
    Features(command::features::Features),
    Layout(command::layout::Layout),
    Lidar3d(command::lidar3d::Lidar3d),
    Places(command::places::Places),
    Campaign(command::campaign::Campaign),
    Can(command::can::Can),
    Nav350(command::nav350::Nav350),
    Record(command::record::Record),
    #[cfg(unix)]
    Run(command::run::Run),
    Emulate(command::emulate::Emulate),
    Ctl(command::ctl::Ctl),
    Settings(command::settings::Settings),
    Provision(command::provision::Provision),
    Completion(command::completion::Completion),
    Manual(command::manual::Manual),
}

/// Room for a whole controller, which the threads of an evaluation make on their stacks, bytes.
const THREAD_STACK: usize = 16 << 20;

fn main() -> ExitCode {
    command::panic_message::install();
    // Nobody has made the threads yet.
    let _ = rayon::ThreadPoolBuilder::new().stack_size(THREAD_STACK).build_global();
    let matches = Agv::command().try_get_matches().unwrap_or_else(|error| leave(&error));
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let Some(option) = matches.subcommand_name().and_then(|command| stray_option(command, &words)) {
        let problem = format!("--{option} does not go with a command before which it stands");
        Agv::command().error(ErrorKind::ArgumentConflict, problem).exit();
    }
    let arguments = Agv::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    if arguments.quiet {
        command::output::be_quiet();
    }
    let outcome = match arguments.command {
        None => arguments.demonstration.run(),
        Some(Command::Import(command)) => match command.run() {
            Ok(code) => return code,
            Err(error) => Err(error),
        },
        Some(Command::Export(command)) => command.run(),
        Some(Command::Simulate(command)) => command.run(),
        Some(Command::Replay(command)) => command.run(),
        Some(Command::Check(command)) => command.run(),
        Some(Command::Accept(command)) => match command.run() {
            Ok(code) => return code,
            Err(error) => Err(error),
        },
        Some(Command::View(command)) => command.run(),
        Some(Command::Report(command)) => command.run(),
        Some(Command::Map(command)) => command.run(),
        Some(Command::Calibrate(command)) => command.run(),
        Some(Command::Evaluate(command)) => command.run(),
        Some(Command::Features(command)) => command.run(),
        Some(Command::Layout(command)) => match command.run() {
            Ok(code) => return code,
            Err(error) => Err(error),
        },
        Some(Command::Lidar3d(command)) => match command.run() {
            Ok(code) => return code,
            Err(error) => Err(error),
        },
        Some(Command::Places(command)) => command.run(),
        Some(Command::Campaign(command)) => command.run(),
        Some(Command::Can(command)) => command.run(),
        Some(Command::Nav350(command)) => command.run(),
        Some(Command::Record(command)) => command.run(),
        #[cfg(unix)]
        Some(Command::Run(command)) => command.run(),
        Some(Command::Emulate(command)) => command.run(),
        Some(Command::Ctl(command)) => command.run(),
        Some(Command::Settings(command)) => command.run(),
        Some(Command::Provision(command)) => command.run(),
        Some(Command::Completion(command)) => command.run::<Agv>(),
        Some(Command::Manual(command)) => command.run::<Agv>(),
    };
    finish(outcome)
}

/// The exit code of a command, and a line if it failed.
fn finish(outcome: anyhow::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("agv: {}", command::complaint::line(&error));
            ExitCode::FAILURE
        }
    }
}

/// Ends with help, version, or what is wrong with the command line.
fn leave(error: &clap::Error) -> ! {
    let is_result = !error.use_stderr();
    match error.print().and_then(|()| std::io::stdout().flush()) {
        // As with `head`.
        Err(problem) if is_result && problem.kind() != std::io::ErrorKind::BrokenPipe => {
            eprintln!("agv: the result cannot be written: {problem}");
            std::process::exit(1)
        }
        _ => std::process::exit(error.exit_code()),
    }
}

/// An option of the demonstration that stands before a command, where it would mean nothing.
fn stray_option(command: &str, words: &[String]) -> Option<&'static str> {
    let before = words.iter().take_while(|word| *word != command);
    let options = command::demonstration::OPTIONS;
    before
        .filter_map(|word| word.strip_prefix("--"))
        .find_map(|word| options.into_iter().find(|option| word == *option || word.starts_with(&format!("{option}="))))
}
