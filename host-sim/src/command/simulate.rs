//! `agv simulate`.

/// Not there yet.
#[derive(clap::Args)]
pub struct Simulate {}

impl Simulate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("`agv simulate` is not there yet")
    }
}
