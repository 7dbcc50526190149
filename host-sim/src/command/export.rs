//! `agv export`.

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use agv_host_sim::export::candump;
use anyhow::{Context, bail};

const HELP: &str = "\
Examples:
  agv export candump drive.agvlog --output drive.candump
  agv export candump drive.agvlog --interface vcan0 --output drive.candump && canplayer -I drive.candump";

/// Write what a log holds in the formats of others
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Export {
    #[command(subcommand)]
    format: Format,
}

#[derive(clap::Subcommand)]
enum Format {
    Candump(Candump),
}

/// The frames of a CAN bus, as candump -l writes them
#[derive(clap::Args)]
struct Candump {
    /// Log with the raw bytes of a bus.
    log: PathBuf,
    /// Name of the interface in the output.
    #[arg(long, default_value = "can0")]
    interface: String,
    /// File to write; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl Export {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.format {
            Format::Candump(command) => command.run(),
        }
    }
}

impl Candump {
    fn run(self) -> anyhow::Result<()> {
        let file = File::create(&self.output).with_context(|| self.output.display().to_string())?;
        let frames = candump::write(&self.log, &self.interface, &mut BufWriter::new(file))?;
        if frames == 0 {
            bail!("{}: there are no frames of a bus in the log", self.log.display());
        }
        if self.json {
            println!("{}", serde_json::json!({ "frames": frames }));
        } else {
            println!("frames  {frames}");
        }
        Ok(())
    }
}
