//! `agv features`.

/// Not there yet.
#[derive(clap::Args)]
pub struct Features {}

impl Features {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        anyhow::bail!("`agv features` is not there yet")
    }
}
