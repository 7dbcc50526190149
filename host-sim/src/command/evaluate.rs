//! `agv evaluate`.

/// Not there yet.
#[derive(clap::Args)]
pub struct Evaluate {}

impl Evaluate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("`agv evaluate` is not there yet")
    }
}
