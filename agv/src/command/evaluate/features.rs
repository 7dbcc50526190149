//! `agv evaluate features`.

use std::path::PathBuf;

use agv_lab::evaluate::features::{DetectorKind, Disturbance, Outcome, page, run};
use agv_lab::evaluate::{falko, repeatability};
use anyhow::Context;

use crate::command::output::check_files;
use crate::command::progress;

const HELP: &str = "\
Examples:
  agv evaluate features --set fr079
  agv evaluate features --set intel --json
  agv evaluate features --set fr079 --report features.html";

/// Keypoints and descriptors as K 3.3 measures them: viewpoint, noise, density, stability of landmarks
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Features {
    /// Log to measure on.
    #[arg(long)]
    set: super::Set,
    /// Print a JSON array, one object a detector, instead of tables.
    #[arg(long)]
    json: bool,
    /// Write a page with tables and curves.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl Features {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        check_files(&self.report)?;
        let scans = falko::Set::from(self.set).scans()?;
        let kinds = [DetectorKind::Falko, DetectorKind::Oc];
        let bar = progress::bar("measuring", (kinds.len() * (Disturbance::ALL.len() + 2)) as u64);
        let pairs = repeatability::overlapping_pairs(&scans);
        let outcomes = kinds.map(|kind| run(kind, &scans, &pairs, || bar.inc(1)));
        bar.finish_and_clear();
        if let Some(report) = &self.report {
            let title = match self.set {
                super::Set::Fr079 => "Keypoints and descriptors on fr079",
                super::Set::Intel => "Keypoints and descriptors on intel",
            };
            page(title, &outcomes)?.write(report).with_context(|| report.display().to_string())?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        print_detectors(&outcomes);
        print_levels(&outcomes);
        print_stability(&outcomes);
        print_descriptors(&outcomes);
        Ok(())
    }
}

fn detector(outcome: &Outcome) -> String {
    format!("{:?}", outcome.detector).to_lowercase()
}

fn print_detectors(outcomes: &[Outcome]) {
    println!("detector  keypoints/scan  repeatability  counting empty  us/scan");
    for outcome in outcomes {
        println!(
            "{:<9} {:>14.1} {:>14.3} {:>15.3} {:>8.1}",
            detector(outcome),
            outcome.keypoints_per_scan,
            outcome.repeatability,
            outcome.repeatability_counting_empty,
            outcome.us_per_scan
        );
    }
}

fn print_levels([falko, oc]: &[Outcome; 2]) {
    println!("\ntest          level  repeatability, counting empty");
    println!("{:>21}{:>8}{:>8}", "", "falko", "oc");
    for level in &falko.levels {
        let other = oc.levels.iter().find(|other| other.test == level.test && other.level == level.level);
        println!(
            "{:<13} {:>5.2} {:>8.3}{:>8.3}",
            level.test,
            level.level,
            level.counting_empty,
            other.map_or(f64::NAN, |other| other.counting_empty)
        );
    }
}

fn print_stability(outcomes: &[Outcome]) {
    println!("\ndetector  association  landmarks  seen once  mean      max");
    for outcome in outcomes {
        for row in &outcome.stability {
            println!(
                "{:<9} {:>9.2} m {:>10} {:>8.1} % {:>6.3} m {:>6.3} m",
                detector(outcome),
                row.association_m,
                row.landmarks,
                100.0 * row.single_share,
                row.lambda_mean_m,
                row.lambda_max_m
            );
        }
    }
}

fn print_descriptors(outcomes: &[Outcome]) {
    println!("\ndetector  descriptor  radius  us/scan  test          nearest correct");
    for outcome in outcomes {
        for descriptor in &outcome.descriptors {
            for test in &descriptor.tests {
                println!(
                    "{:<9} {:<10} {:>6.1} m {:>7.1}  {:<13} {:>15.3}",
                    detector(outcome),
                    descriptor.descriptor,
                    descriptor.radius_m,
                    descriptor.us_per_scan,
                    test.test,
                    test.nearest_correct
                );
            }
        }
    }
}
