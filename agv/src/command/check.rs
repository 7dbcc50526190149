//! `agv check`.

use std::path::PathBuf;

use agv_host_sim::calibrate::causes::TRIES;
use agv_host_sim::drive::{Figures, Track};
use agv_host_sim::drive_check::{Finding, check, moved, poor_share};
use agv_host_sim::log::{self, Contents};
use agv_host_sim::replay::replay;
use anyhow::Context;
use serde::Serialize;

use super::progress;
use super::setting_arguments::SettingArguments;
use super::vehicle_argument::VehicleArgument;

const HELP: &str = "\
Looks at what is missing, at times, at the encoders and the laser against each other, at the map, and at the noise.

Examples:
  agv check drive.agvlog
  agv check drive.agvlog --json
  agv check drive.agvlog --put-right mended.agvlog
  agv check drive.agvlog --vehicle vehicle.toml

Keys of --json: poor_share, damage, findings [what, next].";

/// Say in plain words what is wrong with a drive, and what to type next
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Check {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    vehicle: VehicleArgument,
    #[command(flatten)]
    settings: SettingArguments,
    /// Write the log with the laser's times moved to those of the encoders, if they are off; an older one is replaced.
    #[arg(long, value_name = "LOG2")]
    put_right: Option<PathBuf>,
    /// Print one JSON object instead of sentences.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Result {
    poor_share: f64,
    damage: Vec<String>,
    findings: Vec<Finding>,
}

impl Check {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let Contents { mut recording, damages, .. } = log::read_contents(&self.log, |_| ())?;
        self.settings.apply(&mut recording.parameters)?;
        self.vehicle.apply(&mut recording.parameters, &self.log)?;
        let name = self.log.display().to_string();
        if let Some(path) = &self.put_right {
            let (right, late) = moved(&recording).with_context(|| format!("{name}: the laser's times are not off"))?;
            log::write(path, &right)?;
            println!("{}: the laser's times moved by {:.1} ms", path.display(), -1e3 * late);
            return Ok(());
        }
        let replay = replay(&recording, |_| ()).with_context(|| name.clone())?;
        let figures = Figures::new(&recording, &replay, &Track::new(&recording, &replay));
        let bar = progress::bar("looking", TRIES as u64);
        let mut findings = check(&recording, &replay, &figures, &name, |done| bar.set_position(done as u64));
        findings.iter_mut().for_each(|finding| self.keep_vehicle(finding, &name));
        bar.finish_and_clear();
        let poor_share = poor_share(&figures);
        let damage: Vec<String> = damages.iter().map(ToString::to_string).collect();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&Result { poor_share, damage, findings })?);
            return Ok(());
        }
        println!("{:.1} % of the drive is lost, degraded, without odometry or not localised", 100.0 * poor_share);
        damage.iter().for_each(|damage| println!("the log is damaged: {damage}"));
        if findings.is_empty() {
            println!("nothing is wrong with it");
        }
        for Finding { what, next } in &findings {
            println!("{what}\n  next: {next}");
        }
        Ok(())
    }

    /// Has the command that comes next take the vehicle that was taken here. The viewer shows what was recorded.
    fn keep_vehicle(&self, finding: &mut Finding, log: &str) {
        if let Some(vehicle) = self.vehicle.vehicle.as_ref().filter(|_| !finding.next.contains("agv view")) {
            finding.next = with_vehicle(&finding.next, log, &vehicle.display().to_string());
        }
    }
}

/// What comes next, with the vehicle behind each log that is read; one that is written has it already.
fn with_vehicle(next: &str, log: &str, vehicle: &str) -> String {
    let mut before = "";
    let words = next.split(' ').map(|word| {
        let is_written = std::mem::replace(&mut before, word) == "--put-right";
        if word == log && !is_written { format!("{word} --vehicle {vehicle}") } else { word.to_owned() }
    });
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::with_vehicle;

    #[test]
    fn each_log_that_is_read_has_the_vehicle_once() {
        let cases = [
            (
                "agv calibrate d.agvlog --mend --apply vehicle.toml",
                "d.agvlog",
                "agv calibrate d.agvlog --vehicle V --mend --apply vehicle.toml",
            ),
            (
                "agv check d.agvlog --put-right mended.agvlog",
                "d.agvlog",
                "agv check d.agvlog --vehicle V --put-right mended.agvlog",
            ),
            (
                "agv check mended.agvlog --put-right mended.agvlog",
                "mended.agvlog",
                "agv check mended.agvlog --vehicle V --put-right mended.agvlog",
            ),
            (
                "agv replay d.agvlog --map MAP, or agv replay d.agvlog --start X",
                "d.agvlog",
                "agv replay d.agvlog --vehicle V --map MAP, or agv replay d.agvlog --vehicle V --start X",
            ),
            ("agv settings vehicle.kind", "d.agvlog", "agv settings vehicle.kind"),
        ];
        for (next, log, expected) in cases {
            assert_eq!(with_vehicle(next, log, "V"), expected);
        }
    }
}
