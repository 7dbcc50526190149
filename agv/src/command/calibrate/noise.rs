//! `agv calibrate noise`.

use std::path::PathBuf;

use agv_host_sim::calibrate::innovation_noise::{HONEST, STEPS, SourceNoise, Squares, find};
use agv_host_sim::log;
use anyhow::Context;
use serde_json::json;

use crate::command::progress;
use crate::command::setting_arguments::SettingArguments;

const HELP: &str = "\
The noise is fitted on the first half of the drive and held against the second half. A squared innovation is stated by the one that
the filter expects, for one degree of freedom: 1 if the noise is right, less if the filter is told too much of it.

Examples:
  agv calibrate noise drive.agvlog
  agv calibrate noise drive.agvlog --json

Keys of --json: sources [source, good, before, after, check {count, mean}, settings [name, before, after]].";

/// Find the noise of reflectors and features from a drive with a map
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Noise {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    settings: SettingArguments,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

impl Noise {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let (mut recording, _) = log::read(&self.log)?;
        self.settings.apply(&mut recording.parameters)?;
        let bar = progress::bar("replaying", STEPS as u64);
        let found =
            find(&recording, |done| bar.set_position(done as u64)).with_context(|| self.log.display().to_string())?;
        bar.finish_and_clear();
        if self.json {
            let sources: Vec<_> = found.iter().map(entry).collect();
            println!("{}", serde_json::to_string_pretty(&json!({ "sources": sources }))?);
            return Ok(());
        }
        println!("{:<18} {:>10} {:>10} {:>10}", "squared innovation", "before", "after", "check");
        for noise in &found {
            let [before, after, check] = [noise.before, noise.after, noise.check].map(|squares| squares.mean);
            println!("{:<18} {before:>10.2} {after:>10.2} {check:>10.2}", noise.source.name());
        }
        for changed in found.iter().flat_map(|noise| noise.settings) {
            println!("{:<32} {:.6} was {:.6}", changed.name, changed.after, changed.before);
        }
        for noise in found.iter().filter(|noise| !noise.is_good()) {
            let why = if HONEST.contains(&noise.after.mean) {
                "the second half of the drive disagrees"
            } else {
                "no setting brings it to 1, as the detector or the map states another noise"
            };
            println!("{}: {why}", noise.source.name());
        }
        println!("next: agv accept {}{}", self.log.display(), options(&found));
        Ok(())
    }
}

fn entry(noise: &SourceNoise) -> serde_json::Value {
    let squares = |squares: Squares| json!({ "count": squares.count, "mean": squares.mean });
    let settings: Vec<_> = noise
        .settings
        .iter()
        .map(|changed| json!({ "name": changed.name, "before": changed.before, "after": changed.after }))
        .collect();
    json!({
        "source": noise.source.name(),
        "good": noise.is_good(),
        "before": squares(noise.before),
        "after": squares(noise.after),
        "check": squares(noise.check),
        "settings": settings,
    })
}

/// The settings as options of other commands: all of them, as they were found together.
fn options(found: &[SourceNoise]) -> String {
    let settings = found.iter().flat_map(|noise| noise.settings);
    settings.map(|changed| format!(" --set {}={:.6}", changed.name, changed.after)).collect()
}
