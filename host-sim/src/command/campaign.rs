//! `agv campaign`.

use std::path::PathBuf;

use agv_host_sim::campaign::verdict::{Class, Verdict};
use agv_host_sim::campaign::{Campaign as Plan, CampaignError, Run};
use rayon::prelude::*;

use crate::command::progress;

/// Let things go wrong in simulated drives, through the controller's wire code, and say how it takes them.
#[derive(clap::Args)]
pub struct Campaign {
    /// The campaign, such as host-sim/scenarios/faults.toml.
    file: PathBuf,
    /// Every two faults together, each pair with one seed, instead of each alone.
    #[arg(long)]
    pairs: bool,
    /// Seeds of each fault, instead of what the file says.
    #[arg(long)]
    runs: Option<u64>,
    /// Only faults whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
}

impl Campaign {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let (mut plan, scenario) = Plan::read(&self.file)?;
        plan.runs = self.runs.unwrap_or(plan.runs);
        let mut runs = if self.pairs { plan.pairs() } else { plan.alone() };
        runs.retain(|run| run.faults.iter().any(|&fault| plan.faults[fault].name.contains(&self.only)));
        let progress = progress::bar("runs", runs.len() as u64);
        let verdicts: Vec<(Run, Verdict)> = runs
            .into_par_iter()
            .map(|run| {
                let verdict = plan.run(&scenario, &run)?;
                progress.inc(1);
                Ok((run, verdict))
            })
            .collect::<Result<_, CampaignError>>()?;
        progress.finish_and_clear();
        for (index, fault) in plan.faults.iter().enumerate() {
            let of: Vec<&Verdict> =
                verdicts.iter().filter(|(run, _)| run.faults == [index]).map(|(_, verdict)| verdict).collect();
            if of.is_empty() {
                continue;
            }
            let count = |class: Class| of.iter().filter(|verdict| verdict.class == class).count();
            let most = |value: &dyn Fn(&Verdict) -> f64| of.iter().map(|verdict| value(verdict)).fold(0.0, f64::max);
            println!(
                "{:<38} {:>3} {:>3} {:>3} {:>3}  late {:>5.2} s {:>5.2} m  rec {:>2}/{:>2} {:>5.1} s  worst {:>6.3} m {:>6.2} deg  degraded {:>5.1} s",
                fault.name,
                count(Class::Unimpressed),
                count(Class::Said),
                count(Class::Late),
                count(Class::Misleading),
                most(&|verdict| verdict.late_s),
                most(&|verdict| verdict.late_m),
                of.iter().filter(|verdict| verdict.is_recovered).count(),
                of.len(),
                most(&|verdict| verdict.recovered_after_s.unwrap_or(0.0)),
                most(&|verdict| verdict.worst_position_m),
                most(&|verdict| verdict.worst_heading_deg),
                most(&|verdict| verdict.degraded_s),
            );
        }
        Ok(())
    }
}
