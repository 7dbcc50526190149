//! `agv lidar3d`.

mod arguments;
mod bridge;
mod calibrate;
mod convert;
mod decode;
mod held;
mod info;
mod mount;
mod places;
pub mod relocalise;
mod view;

use std::process::ExitCode;

/// Multi-beam lidars: look at, decode, convert and calibrate, find their mount, and recognise places.
#[derive(clap::Args)]
pub struct Lidar3d {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Info(info::Info),
    Decode(decode::Decode),
    Convert(convert::Convert),
    Calibrate(calibrate::Calibrate),
    Mount(mount::Mount),
    Bridge(bridge::Bridge),
    Places(places::Places),
    View(view::View),
}

impl Lidar3d {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let outcome = match self.action {
            Action::Decode(command) => return command.run(),
            Action::Info(command) => return command.run(),
            Action::Convert(command) => command.run(),
            Action::Calibrate(command) => command.run(),
            Action::Mount(command) => command.run(),
            Action::Bridge(command) => command.run(),
            Action::Places(command) => command.run(),
            Action::View(command) => command.run(),
        };
        outcome.map(|()| ExitCode::SUCCESS)
    }
}
