//! `agv accept`.

use std::path::PathBuf;
use std::process::ExitCode;

use agv_host_sim::acceptance::{self, Line, Verdict};
use agv_host_sim::drive::{Figures, Track};
use agv_host_sim::log::{self, Contents};
use agv_host_sim::replay::{Comparisons, replay};
use anyhow::Context;
use serde::Serialize;

use super::progress;
use super::setting_arguments::SettingArguments;

const HELP: &str = "\
Exit codes: 0 every line passes; 3 a line fails; 4 none fails, but something was not measured.
A file of halts has the line along_mm,across_mm,heading_deg, and then one line for each halt at one mark, as a ruler says.

Examples:
  agv accept drive.agvlog
  agv accept drive.agvlog --halts halts.csv --json

Keys of --json: verdict, lines [what, verdict, found, must_be]; verdicts are pass, fail and not_measured.";

/// Say whether a drive is as that of an accepted vehicle, line by line
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Accept {
    /// The log of a day's ways.
    log: PathBuf,
    /// Halts at one mark, measured with a ruler.
    #[arg(long, value_name = "FILE")]
    halts: Option<PathBuf>,
    #[command(flatten)]
    settings: SettingArguments,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Result {
    verdict: Verdict,
    lines: Vec<Line>,
}

impl Accept {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let halts = self.halts.as_deref().map(acceptance::read_halts).transpose()?.unwrap_or_default();
        let Contents { mut recording, outputs, publishing, .. } = log::read_contents(&self.log, |_| ())?;
        self.settings.apply(&mut recording.parameters)?;
        let running = progress::bar("replaying", recording.events.len() as u64);
        let replay = replay(&recording, |events| running.set_position(events as u64))
            .with_context(|| self.log.display().to_string())?;
        running.finish_and_clear();
        let said = if self.settings.is_empty() {
            Comparisons::of(&outputs, &publishing, &recording, &replay)
        } else {
            Comparisons::default()
        };
        let figures = Figures::new(&recording, &replay, &Track::new(&recording, &replay));
        let lines = acceptance::test(&figures, &recording.landmarks, &said, &halts);
        let verdict = overall(&lines);
        if self.json {
            println!("{}", serde_json::to_string_pretty(&Result { verdict, lines })?);
        } else {
            print(&lines);
        }
        Ok(match verdict {
            Verdict::Pass => ExitCode::SUCCESS,
            Verdict::Fail => ExitCode::from(3),
            Verdict::NotMeasured => ExitCode::from(4),
        })
    }
}

/// The worst of all lines.
fn overall(lines: &[Line]) -> Verdict {
    let has = |wanted| lines.iter().any(|line| line.verdict == wanted);
    [Verdict::Fail, Verdict::NotMeasured].into_iter().find(|wanted| has(*wanted)).unwrap_or(Verdict::Pass)
}

fn print(lines: &[Line]) {
    let width = lines.iter().map(|line| line.what.len()).max().unwrap_or_default();
    for Line { what, verdict, found, must_be } in lines {
        let word = match verdict {
            Verdict::Pass => "pass",
            Verdict::Fail => "FAIL",
            Verdict::NotMeasured => "not measured",
        };
        println!("{word:<12}  {what:<width$}  {found}; must be: {must_be}");
    }
}
