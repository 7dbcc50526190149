//! `agv calibrate noise`.

use std::path::PathBuf;

use agv_host_sim::calibrate::innovation_noise::{KindNoise, Noise as Found, STEPS, Squares, find};
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::drive::kind_name;
use agv_host_sim::log;
use agv_host_sim::mapping::map_file;
use agv_host_sim::replay::replay;
use anyhow::Context;
use serde_json::json;

use crate::command::progress;
use crate::command::setting_arguments::SettingArguments;
use crate::command::vehicle_argument::VehicleArgument;

const HELP: &str = "\
The drive is cut into sixteen pieces. The noise is fitted on every other one and held against those between. The mean normalised square
of the innovations is 2 if the noise is right, as in agv replay and agv check, and less if the filter is told too much of it.
What the map shares between sightings, how exact it is, and what the odometry does are found with it: each is told apart from the
others by every sighting.

Examples:
  agv calibrate noise drive.agvlog
  agv calibrate noise drive.agvlog --output measured.agvlog
  agv calibrate noise drive.agvlog --apply noise.toml --map-output map.csv --json

Keys of --json: good, sources [source, good, before, after, check {count, mean}], settings [name, before, after],
map [source, factor].";

/// Find the noise of reflectors and features from a drive with a map
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Noise {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    vehicle: VehicleArgument,
    #[command(flatten)]
    settings: SettingArguments,
    /// Write the log with the noise that was found, and with what the localiser then answers.
    #[arg(short, long, value_name = "LOG2")]
    output: Option<PathBuf>,
    /// Write the settings that were found to a file that 'agv ctl HOST apply' and 'agv replay --vehicle' take.
    #[arg(long, value_name = "FILE")]
    apply: Option<PathBuf>,
    /// Write the map with the deviations that were found.
    #[arg(long, value_name = "MAP")]
    map_output: Option<PathBuf>,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

impl Noise {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let (mut recording, _) = log::read(&self.log)?;
        self.settings.apply(&mut recording.parameters)?;
        self.vehicle.apply(&mut recording.parameters, &self.log)?;
        let name = || self.log.display().to_string();
        let bar = progress::bar("replaying", STEPS as u64);
        let found = find(&recording, |done| bar.set_position(done as u64)).with_context(name)?;
        bar.finish_and_clear();
        if let Some(path) = &self.output {
            let answers = replay(&found.recording, |_| ()).with_context(name)?;
            log::write_with_outputs(path, &found.recording, |event| answers.output(event))?;
        }
        if let Some(path) = &self.map_output {
            map_file::write(path, &found.recording.landmarks)?;
        }
        if let Some(path) = &self.apply {
            let settings = found.settings.iter().map(|changed| (changed.name.to_owned(), changed.after)).collect();
            VehicleFile { settings, ..VehicleFile::default() }.write(path)?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&summary(&found))?);
        } else {
            self.print(&found);
        }
        Ok(())
    }

    fn print(&self, found: &Found) {
        println!("{:<32} {:>10} {:>10} {:>10}", "normalised square, 2 expected", "before", "after", "check");
        for noise in &found.kinds {
            let [before, after, check] =
                [noise.before, noise.after, noise.check].map(|squares| COMPONENTS * squares.mean);
            println!("{:<32} {before:>10.2} {after:>10.2} {check:>10.2}", kind_name(noise.kind));
        }
        for changed in &found.settings {
            println!("{:<32} {:.6} was {:.6}", changed.name, changed.after, changed.before);
        }
        for (kind, factor) in &found.map {
            println!("{:<32} {factor:.3} of what the map states", format!("deviation of {}", kind_name(*kind)));
        }
        for noise in found.kinds.iter().filter(|noise| !noise.is_good()) {
            println!("{}: the other half of the drive disagrees", kind_name(noise.kind));
        }
        if let Some(path) = &self.apply {
            println!("next: agv ctl HOST --key FILE apply {}", path.display());
        }
        match &self.output {
            Some(path) => println!("next: agv accept {}", path.display()),
            None => println!("next: agv calibrate noise {} --output measured.agvlog", self.log.display()),
        }
    }
}

/// Components of an innovation: means are stated for both, as everywhere.
const COMPONENTS: f64 = 2.0;

fn summary(found: &Found) -> serde_json::Value {
    let squares = |squares: Squares| json!({ "count": squares.count, "mean": COMPONENTS * squares.mean });
    let source = |noise: &KindNoise| {
        json!({
            "source": kind_name(noise.kind),
            "good": noise.is_good(),
            "before": squares(noise.before),
            "after": squares(noise.after),
            "check": squares(noise.check),
        })
    };
    let sources: Vec<_> = found.kinds.iter().map(source).collect();
    let settings = found.settings.iter();
    let settings: Vec<_> = settings
        .map(|changed| json!({ "name": changed.name, "before": changed.before, "after": changed.after }))
        .collect();
    let map: Vec<_> =
        found.map.iter().map(|(kind, factor)| json!({ "source": kind_name(*kind), "factor": factor })).collect();
    let is_good = found.kinds.iter().all(KindNoise::is_good);
    json!({ "good": is_good, "sources": sources, "settings": settings, "map": map })
}
