//! `agv completion`.

use std::io::{ErrorKind, Write};

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;

const HELP: &str = "\
Examples:
  agv completion bash > ~/.local/share/bash-completion/completions/agv
  agv completion zsh > ~/.zfunc/_agv
  agv completion fish > ~/.config/fish/completions/agv.fish";

/// Print what a shell needs to complete the command line
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Completion {
    /// The shell.
    shell: Shell,
}

impl Completion {
    /// Runs the command; `Program` is the whole command line.
    pub fn run<Program: CommandFactory>(self) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Program::command(), "agv", &mut script);
        let mut output = std::io::stdout().lock();
        match output.write_all(&script).and_then(|()| output.flush()) {
            // As with `head`.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
            outcome => outcome.context("the result cannot be written"),
        }
    }
}
