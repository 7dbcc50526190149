//! `agv manual`.

use std::path::{Path, PathBuf};

use agv_host_sim::output_file;
use anyhow::Context;
use clap::CommandFactory;
use clap_mangen::Man;

const HELP: &str = "\
Examples:
  agv manual --output ~/.local/share/man/man1 && man agv-replay";

/// Write a page for `man` for each command
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Manual {
    /// Folder for the pages.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

impl Manual {
    /// Runs the command; `Program` is the whole command line.
    pub fn run<Program: CommandFactory>(self) -> anyhow::Result<()> {
        std::fs::create_dir_all(&self.output).with_context(|| self.output.display().to_string())?;
        let mut program = Program::command();
        program.build();
        write(&program, "agv", &self.output)
    }
}

/// Writes the page of a command and those of the commands in it.
fn write(command: &clap::Command, name: &str, folder: &Path) -> anyhow::Result<()> {
    let path = folder.join(format!("{name}.1"));
    let mut page = Vec::new();
    Man::new(command.clone()).title(name).render(&mut page).with_context(|| path.display().to_string())?;
    output_file::write(&path, page).with_context(|| path.display().to_string())?;
    let inner = command.get_subcommands().filter(|inner| inner.get_name() != "help");
    inner.into_iter().try_for_each(|inner| write(inner, &format!("{name}-{}", inner.get_name()), folder))
}
