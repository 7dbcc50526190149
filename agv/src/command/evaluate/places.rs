//! `agv evaluate places`.

use std::path::PathBuf;

use agv_lab::evaluate::falko;
use agv_lab::evaluate::places::{CANDIDATES, Combination, Experiment, Method, Mode, Protocol, page};
use anyhow::Context;

use crate::command::output::check_files;
use crate::command::{posed_scans, progress};

const HELP: &str = "\
Protocol `thesis`: an answer is right within 0.5 m and 10 degrees; neighbours in time are allowed; every scan is a question
that counts. Protocol `honest`: candidates within 50 scans or 10 s are not allowed; only questions that truly have an
allowed scan within 0.5 m and 30 degrees count for recall; wrong answers to all questions count against precision.

Examples:
  agv evaluate places --set fr079 --json
  agv evaluate places --set intel --report places.html
  agv evaluate places --log freiburg-079-corrected.log.gz --candidates 50";

/// How well places are recognised from keypoints of one scan (K 4.2).
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Places {
    /// Log to measure on.
    #[arg(long, required_unless_present = "log")]
    set: Option<super::Set>,
    /// A log with poses instead: of this program, a pose graph, or a CARMEN log with corrected poses, plain or .gz.
    #[arg(long, conflicts_with = "set")]
    log: Option<PathBuf>,
    /// Candidates that are looked at for each question.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u8).range(1..=CANDIDATES as i64))]
    candidates: u8,
    /// Keypoints that must support an answer.
    #[arg(long, default_value_t = 5)]
    n_min: u8,
    /// Print a JSON array instead of a table.
    #[arg(long)]
    json: bool,
    /// Write a page with the curves of precision and recall.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl Places {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        check_files(&self.report)?;
        let scans = match (self.set, &self.log) {
            (Some(set), _) => falko::Set::from(set).scans()?,
            (None, Some(log)) => posed_scans::read(log)?,
            (None, None) => anyhow::bail!("state a set or a log"),
        };
        anyhow::ensure!(!scans.is_empty(), "the log has no scans");
        let asked: Vec<_> = [Protocol::Thesis, Protocol::Honest]
            .into_iter()
            .flat_map(|protocol| [Mode::Offline, Mode::Online].map(|mode| (protocol, mode)))
            .collect();
        let bar = progress::bar("recognising places", (Method::ALL.len() * asked.len() * scans.len()) as u64);
        let mut outcomes = Vec::new();
        for method in Method::ALL {
            let experiment = Experiment::new(method, &scans);
            for &(protocol, mode) in &asked {
                let combination = Combination {
                    protocol,
                    mode,
                    candidates: usize::from(self.candidates),
                    n_min: usize::from(self.n_min),
                };
                outcomes.push(experiment.run(&combination, || bar.inc(1)));
            }
        }
        bar.finish_and_clear();
        if let Some(report) = &self.report {
            page(&outcomes)?.write(report).with_context(|| report.display().to_string())?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "method         protocol  mode     precision  recall    r95    r99  max f1  ceiling  questions  us: signature  search  association"
        );
        for outcome in outcomes {
            println!(
                "{:<14} {:<9} {:<8} {:>9.3} {:>7.3} {:>6.3} {:>6.3} {:>7.3} {:>8.3} {:>10} {:>14.1} {:>7.0} {:>12.0}",
                name(outcome.method),
                name(outcome.protocol),
                name(outcome.mode),
                outcome.precision,
                outcome.recall,
                outcome.r95,
                outcome.r99,
                outcome.max_f1,
                outcome.ceiling,
                outcome.questions,
                outcome.signature_us,
                outcome.search_us,
                outcome.association_us,
            );
        }
        Ok(())
    }
}

/// The name that the value has in JSON.
fn name(value: impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}
