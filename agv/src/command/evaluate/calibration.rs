//! `agv evaluate calibration`.

use agv_host_sim::data;
use agv_lab::evaluate::calibration::simulated::{self, ADOPTED_ROW, Experiment, Figures};
use agv_lab::evaluate::calibration::{course::Disturbance, optiodom, sapienza, thesis};
use anyhow::{Context, ensure};

use super::super::progress;

/// Calibration: on a real tricycle, or in simulation.
#[derive(clap::Args)]
pub struct Calibration {
    /// Which drives.
    #[arg(long, value_enum)]
    set: Set,
    /// Runs of each row; simulated only.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    runs: u32,
    /// First seed; simulated only.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only this row of K table 5.1, from 1; 11 is the one with eight half circles a phase.
    #[arg(long)]
    row: Option<usize>,
    /// Fits each path on the very drives that are checked, too, as the method hindsight: what the model of the wheels leaves; optiodom
    /// only.
    #[arg(long)]
    hindsight: bool,
    /// One JSON array instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Set {
    /// The tricycle of the Sapienza University.
    Sapienza,
    /// The drives of K tables 5.1 and 5.2.
    Simulated,
    /// Robots of four kinds with motion capture (OptiOdom): fitted on one or two sessions, checked on all others.
    Optiodom,
}

impl Calibration {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.set {
            Set::Sapienza => self.sapienza(),
            Set::Simulated => self.simulated(),
            Set::Optiodom => self.optiodom(),
        }
    }

    fn sapienza(&self) -> anyhow::Result<()> {
        let folder = data::folder().context("the recordings are not there: set AGV_DATA to their folder")?;
        let outcomes = sapienza::run(&folder.join("sapienza_tricycle"))?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "{:<14} {:<17} {:>8} {:>8} {:>7} {:>7} {:>7} {:>8} {:>8} {:>9} {:>10}",
            "method", "fitted on", "F rad", "B rad", "L m", "x m", "y m", "ATE m", "deg", "fitted m", "checked m"
        );
        for outcome in outcomes {
            print_fit(outcome.method, "all", &outcome.fit);
            println!();
            for half in &outcome.halves {
                print_fit("", half.fitted_on, &half.fit);
                println!(" {:>9.3} {:>10.3}", half.fitted_ate_rmse_m, half.checked_ate_rmse_m);
            }
        }
        Ok(())
    }

    fn optiodom(&self) -> anyhow::Result<()> {
        let folder = data::folder().context("the recordings are not there: set AGV_DATA to their folder")?;
        let outcome = optiodom::run(&folder.join("optiodom"), self.hindsight)?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcome.cells)?);
            return Ok(());
        }
        for fit in &outcome.fits {
            println!("{}, fitted on {}", fit.kind, fit.fitted_on.join(", "));
            for fitted in &fit.fit.fitted {
                let open = if fitted.is_open { "  open" } else { "" };
                println!("  {:<32} {:>+10.5} +- {:.5}{open}", fitted.name, fitted.change, fitted.deviation);
            }
        }
        println!(
            "{:<13} {:<9} {:>6} {:<11} {:>7} {:>7} {:>7} {:>11} {:>8}",
            "kind", "path", "drives", "method", "end m", "ATE m", "deg", "as recorded", "worst m"
        );
        for cell in &outcome.cells {
            println!(
                "{:<13} {:<9} {:>6} {:<11} {:>7.4} {:>7.4} {:>7.2} {:>11.4} {:>8.4}",
                cell.kind,
                cell.path,
                cell.drives,
                cell.method,
                cell.end_m,
                cell.ate_m,
                cell.end_heading_deg,
                cell.ate_as_recorded_m,
                cell.worst_ate_m
            );
        }
        Ok(())
    }

    fn simulated(&self) -> anyhow::Result<()> {
        let rows = thesis::TABLE.len();
        if let Some(row) = self.row {
            ensure!(
                (1..=rows).contains(&row),
                "--row: there are rows 1 to {rows}; {} is the adopted one",
                ADOPTED_ROW + 1
            );
        }
        let experiment = Experiment { runs: self.runs, seed: self.seed, row: self.row.map(|row| row - 1) };
        let steps = Disturbance::ALL.len() * self.row.map_or(rows, |_| 1);
        let bar = progress::bar("calibrating", steps as u64);
        let outcomes = simulated::run(&experiment, || bar.inc(1))?;
        bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string_pretty(&outcomes)?);
            return Ok(());
        }
        println!(
            "{:>4} {:>9} {:>5} {:>5} {:<5} {:<16} {:<7} {:>8} {:>8} {:>10} {:>7} {:>7} {:>8} {:>7}",
            "nseg",
            "deg",
            "beta",
            "mm/s",
            "noise",
            "method",
            "figure",
            "F cdeg",
            "B cdeg",
            "1e-5mm",
            "x mm",
            "y mm",
            "th cdeg",
            "L mm"
        );
        for outcome in &outcomes {
            let design = &outcome.design;
            for (name, figures) in [("bias", &outcome.bias), ("std", &outcome.std), ("stated", &outcome.stated)] {
                let Figures { alpha_forward_cdeg, alpha_backward_cdeg, drive_scale_mm, .. } = figures;
                println!(
                    "{:>4} {:>9} {:>5} {:>5} {:<5} {:<16} {name:<7} {alpha_forward_cdeg:>8.3} {alpha_backward_cdeg:>8.3} {:>10.3} {:>7.3} {:>7.3} {:>8.3} {:>7.3}",
                    design.n_seg,
                    format!("{}..{}", design.steering_deg[0], design.steering_deg[1]),
                    design.beta_deg,
                    design.speed_mm_s,
                    outcome.noise,
                    outcome.method,
                    1e5 * drive_scale_mm,
                    figures.laser_x_mm,
                    figures.laser_y_mm,
                    figures.laser_theta_cdeg,
                    figures.wheelbase_mm,
                );
            }
        }
        Ok(())
    }
}

fn print_fit(method: &str, fitted_on: &str, fit: &sapienza::Fit) {
    print!(
        "{method:<14} {fitted_on:<17} {:>8.4} {:>8.4} {:>7.3} {:>7.3} {:>7.3} {:>8.3} {:>8.2}",
        fit.steer_offset_forward_rad,
        fit.steer_offset_backward_rad,
        fit.wheelbase_m,
        fit.laser_x_m,
        fit.laser_y_m,
        fit.ate_rmse_m,
        fit.heading_rmse_deg
    );
}
