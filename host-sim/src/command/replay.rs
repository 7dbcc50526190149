//! `agv replay`.

/// Not there yet.
#[derive(clap::Args)]
pub struct Replay {}

impl Replay {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("`agv replay` is not there yet")
    }
}
