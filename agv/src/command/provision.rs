//! `agv provision`.

use std::path::PathBuf;

use agv_host_sim::provision::flash_image;
use agv_host_sim::{layout_file, log, output_file};
use agv_settings::Settings;
use agv_settings::leaf::{Leaf, LeafError};
use anyhow::{Context, bail};

use super::ctl::{parse_value, read_key};

const HELP: &str = "\
The image is for the last two pages of the controller's flash, 0x081C0000 on the STM32H743:
  probe-rs download --chip STM32H743ZITx --binary-format bin --base-address 0x081C0000 flash.bin

Examples:
  agv provision --key agv.key --map hall.imk --set nav350.address=192.168.0.1 --output flash.bin
  agv provision --key agv.key --like drive.agvlog --output flash.bin";

/// Make the image of a controller's settings: settings, map and key
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Provision {
    /// File with the key that changes will need: 64 hexadecimal digits.
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// Log whose vehicle and map are those of the controller.
    #[arg(long, value_name = "LOG")]
    like: Option<PathBuf>,
    /// Map, .imk or .csv.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// A setting as NAME=VALUE; agv ctl HOST list shows the names.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Image to write.
    #[arg(short, long)]
    output: PathBuf,
}

impl Provision {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let key = read_key(&self.key)?;
        let (mut settings, mut landmarks) = match &self.like {
            Some(path) => {
                let (recording, _) = log::read(path)?;
                (Settings::of(recording.parameters), recording.landmarks)
            }
            None => (Settings::default(), Vec::new()),
        };
        if let Some(map) = &self.map {
            landmarks = layout_file::landmarks(&layout_file::load(map)?);
        }
        for text in &self.settings {
            let (name, value) = text.split_once('=').with_context(|| format!("{text} is not NAME=VALUE"))?;
            let leaf = Leaf::named(name).with_context(|| format!("there is no setting of the name {name}"))?;
            let like = leaf.get(&settings).with_context(|| format!("the vehicle has no setting {name}"))?;
            match leaf.set(&mut settings, parse_value(name, value, like)?) {
                Ok(()) => {}
                Err(LeafError::Bounds) => {
                    let (least, most) = leaf.bounds;
                    bail!("{name} must be from {least} to {most}");
                }
                Err(LeafError::Kind) => bail!("{value} is no value of {name}"),
            }
        }
        let image = flash_image(&settings, &landmarks, Some(&key))?;
        output_file::write(&self.output, image).with_context(|| self.output.display().to_string())
    }
}
