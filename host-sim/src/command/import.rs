//! `agv import`.

/// Not there yet.
#[derive(clap::Args)]
pub struct Import {}

impl Import {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("`agv import` is not there yet")
    }
}
