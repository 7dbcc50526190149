//! `agv accept`.

use std::path::PathBuf;
use std::process::ExitCode;

use agv_host_sim::acceptance::{self, Halts, Line, Verdict};
use agv_host_sim::drive::{Figures, Track};
use agv_host_sim::log::{self, Contents};
use agv_host_sim::replay::{Comparisons, replay};
use anyhow::Context;
use serde::Serialize;

use super::progress;
use super::setting_arguments::SettingArguments;

const HELP: &str = "\
Exit codes: 0 every line passes; 3 a line fails; 4 none fails, but something was not measured.
A file of halts has the line along_mm,across_mm,heading_deg, and then one line for each halt at one mark, as a ruler says: whether it is
the same place again. A file of marks has the line mark,x_m,y_m,heading_deg,along_mm,across_mm,turned_deg, and then one line for each halt
of the log at a mark, in the order of the drive: the mark's surveyed pose of the logical point, and where the vehicle halted beside it. At
least three marks, 1 m apart: whether it is the right place.

Examples:
  agv accept drive.agvlog
  agv accept drive.agvlog --halts halts.csv --marks marks.csv --json

Keys of --json: verdict, summary, lines [what, verdict, found, must_be]; verdicts are pass, fail and not_measured.";

/// Say whether a drive is as that of an accepted vehicle, line by line
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Accept {
    /// The log of a day's ways.
    log: PathBuf,
    /// Halts at one mark, measured with a ruler.
    #[arg(long, value_name = "FILE")]
    halts: Option<PathBuf>,
    /// Halts at surveyed marks, measured with a ruler.
    #[arg(long, value_name = "FILE")]
    marks: Option<PathBuf>,
    #[command(flatten)]
    settings: SettingArguments,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Result {
    verdict: Verdict,
    summary: String,
    lines: Vec<Line>,
}

impl Accept {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<ExitCode> {
        let halts = self.halts.as_deref().map(acceptance::read_halts).transpose()?.unwrap_or_default();
        let marks = self.marks.as_deref().map(acceptance::read_marks).transpose()?.unwrap_or_default();
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
        let track = Track::new(&recording, &replay);
        let figures = Figures::new(&recording, &replay, &track);
        let halts = Halts { at_one: &halts, at_marks: &marks };
        let lines = acceptance::test(&figures, &track, &recording.landmarks, &said, &halts);
        let (verdict, summary) = (overall(&lines), summary(&lines));
        if self.json {
            println!("{}", serde_json::to_string_pretty(&Result { verdict, summary, lines })?);
        } else {
            println!("{summary}");
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

/// The verdict in one sentence, with the lines that it hangs on.
fn summary(lines: &[Line]) -> String {
    let of = |wanted| -> Vec<&str> {
        lines.iter().filter(|line| line.verdict == wanted).map(|line| line.what.as_str()).collect()
    };
    let (failed, open) = (of(Verdict::Fail), of(Verdict::NotMeasured));
    let open_words = format!("not measured: {}", open.join(", "));
    match (failed.is_empty(), open.is_empty()) {
        (true, true) => "accepted: every line passes".to_owned(),
        (true, false) => format!("not accepted yet; {open_words}"),
        (false, true) => format!("not accepted; failed: {}", failed.join(", ")),
        (false, false) => format!("not accepted; failed: {}; {open_words}", failed.join(", ")),
    }
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
