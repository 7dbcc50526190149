//! `agv provision`.

use std::path::PathBuf;

use agv_host_sim::mapping::contour_file;
use agv_host_sim::provision::{contour_image, flash_image};
use agv_host_sim::setting_doubts::doubt;
use agv_host_sim::{log, output_file};
use agv_settings::leaf::{Leaf, Value};
use agv_settings::{LEAVES, Settings, map_identity};
use anyhow::Context;
use serde_json::json;

use super::ctl::read_key;
use super::layout_input;
use super::output::{note, print_rows};
use super::setting_arguments::SettingArguments;
use super::setting_text::show_setting;

const HELP: &str = "\
The image is for the last two pages of the controller's flash, 0x081C0000 on the STM32H743 and 0x080C0000 on the STM32H723,
that of a map of contours for the two before them, 0x08180000 on the STM32H743; the STM32H723 has no room for one:
  probe-rs download --chip STM32H743ZITx --binary-format bin --base-address 0x081C0000 flash.bin
  probe-rs download --chip STM32H743ZITx --binary-format bin --base-address 0x08180000 contours.bin

Examples:
  agv provision --key agv.key --map hall.imk --set nav350.address=192.168.0.1 --output flash.bin
  agv provision --key agv.key --like drive.agvlog --output flash.bin
  agv provision --key agv.key --output flash.bin --contours hall.csv --contours-output contours.bin";

/// Make the images of what a controller keeps: settings, key and maps
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
    /// Map of contours, as agv map --kind contours writes it.
    #[arg(long, value_name = "FILE", requires = "contours_output")]
    contours: Option<PathBuf>,
    /// Image of that map to write.
    #[arg(long, value_name = "FILE", requires = "contours")]
    contours_output: Option<PathBuf>,
    #[command(flatten)]
    settings: SettingArguments,
    /// Image to write.
    #[arg(short, long)]
    output: PathBuf,
    /// Print what was written as JSON.
    #[arg(long)]
    json: bool,
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
            landmarks = layout_input::load_map(map)?;
        }
        self.settings.change(&mut settings)?;
        let doubts = doubts(&settings);
        doubts.iter().for_each(|doubt| note(&format!("agv: {doubt}")));
        let image = flash_image(&settings, &landmarks, Some(&key))?;
        let contours = self.contours.as_deref().map(contour_file::read).transpose()?;
        if let (Some(map), Some(output)) = (&contours, &self.contours_output) {
            output_file::write(output, contour_image(map)?).with_context(|| output.display().to_string())?;
        }
        let contour_bytes = contours.as_ref().map(|map| map.bytes().len());
        output_file::write(&self.output, &image).with_context(|| self.output.display().to_string())?;
        let changed = changed(&settings, &self.settings);
        if self.json {
            let settings: serde_json::Map<_, _> =
                changed.iter().map(|[name, value]| (name.clone(), value.clone().into())).collect();
            let written = json!({
                "bytes": image.len(), "landmarks": landmarks.len(), "map_identity": map_identity(&landmarks),
                "settings": settings, "questions": doubts, "contour_bytes": contour_bytes,
            });
            println!("{}", serde_json::to_string_pretty(&written)?);
            return Ok(());
        }
        let mut rows = changed;
        rows.push(["all other settings".to_owned(), "as agv settings shows".to_owned()]);
        rows.push(["landmarks".to_owned(), landmarks.len().to_string()]);
        rows.push(["map identity".to_owned(), map_identity(&landmarks).to_string()]);
        if let (Some(bytes), Some(output)) = (contour_bytes, &self.contours_output) {
            rows.push(["map of contours".to_owned(), format!("{}, {bytes} bytes of the map", output.display())]);
        }
        rows.push(["key".to_owned(), self.key.display().to_string()]);
        rows.push(["written".to_owned(), format!("{}, {} bytes", self.output.display(), image.len())]);
        print_rows(&rows);
        Ok(())
    }
}

/// Settings that were given or are not as they leave the factory, with their values.
fn changed(settings: &Settings, given: &SettingArguments) -> Vec<[String; 2]> {
    let usual = Settings::default();
    let row = |leaf: &Leaf| {
        let value = leaf.get(settings)?;
        (leaf.get(&usual) != Some(value) || given.has(leaf)).then(|| {
            [leaf.name.to_owned(), format!("{} {}", show_setting(leaf.name, value), leaf.unit).trim_end().to_owned()]
        })
    };
    LEAVES.iter().filter_map(row).collect()
}

/// Values that are asked about.
fn doubts(settings: &Settings) -> Vec<String> {
    let number = |leaf: &Leaf| match leaf.get(settings) {
        Some(Value::Number(number)) => doubt(leaf.name, number),
        _ => None,
    };
    LEAVES.iter().filter_map(number).collect()
}
