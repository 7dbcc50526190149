//! `agv map`.

/// Not there yet.
#[derive(clap::Args)]
pub struct Map {}

impl Map {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("`agv map` is not there yet")
    }
}
