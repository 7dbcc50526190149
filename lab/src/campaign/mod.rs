//! Fault campaigns: seeded drives in simulated time, through the wire code of the controller, in which something goes
//! wrong.

pub mod event_fuzz;
pub mod fault;
pub mod results;
pub mod rig;
pub mod soak;
pub mod table;
pub mod tape;
pub mod verdict;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use agv_host_sim::replay::ReplayError;
use agv_host_sim::simulate::SimulateError;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{Scenario, ScenarioError, toml_complaint};
use agv_host_sim::simulate::standard;
use fault::{Fault, simulate_with, window};
use rayon::prelude::*;
use results::Row;
use rig::{RigError, RigOptions};
use verdict::{AlertLimits, Judge, Verdict};

/// A campaign as a file states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// The drive, relative to the file.
    pub scenario: PathBuf,
    /// How long each run lasts, s.
    pub seconds: f64,
    /// Seeds of each fault.
    pub runs: u64,
    /// The first of them.
    #[serde(default = "one")]
    pub first_seed: u64,
    /// What the vehicle can live with.
    #[serde(default)]
    pub limits: AlertLimits,
    /// What goes wrong.
    #[serde(rename = "fault")]
    pub faults: Vec<Fault>,
}

fn one() -> u64 {
    1
}

/// Why a campaign cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file cannot be read.
    #[error("{0}")]
    Read(std::io::Error),
    /// The text is not a campaign.
    #[error("this is not a campaign, line {line}: {problem}")]
    Parse {
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// Two faults have the same name, or none has any.
    #[error("every fault of a campaign has a name of its own; {0:?} is there twice or empty")]
    Name(String),
    /// Reflectors cannot be added to the hall.
    #[error("reflectors are added to halls of shapes only")]
    Hall,
    /// A kind of faults makes no fault.
    #[error("{0}")]
    Kind(String),
    /// The scenario makes no sense.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The drive cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The hall cannot be mapped.
    #[error("the drive before cannot be replayed: {0}")]
    Map(ReplayError),
    /// The run cannot be made.
    #[error(transparent)]
    Rig(#[from] RigError),
}

/// One run: which faults, and the seed of everything.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// Indices of the faults in the campaign, one or two.
    pub faults: Vec<usize>,
    /// The seed.
    pub seed: u64,
}

/// A part of a campaign's runs: every `of`th, from `number` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part, from 0.
    pub number: usize,
    /// Of how many parts.
    pub of: usize,
}

impl Shard {
    /// All of it.
    pub const ALL: Self = Self { number: 0, of: 1 };

    /// Whether a run is in it.
    #[must_use]
    pub fn has(&self, run: usize) -> bool {
        run % self.of.max(1) == self.number
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    /// "i/n", with i from 0.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if number < of => Ok(Self { number, of }),
            _ => Err(format!("{text:?} is not a shard; the third of four is 2/4")),
        }
    }
}

impl Campaign {
    /// Reads a campaign and its scenario.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn read(path: &Path) -> Result<(Self, Scenario), CampaignError> {
        let text = standard::read_to_string(path).map_err(CampaignError::Read)?;
        let campaign: Self = toml::from_str(&text).map_err(|error| {
            let (line, problem) = toml_complaint(&text, &error);
            CampaignError::Parse { line, problem }
        })?;
        for (index, fault) in campaign.faults.iter().enumerate() {
            let is_known = campaign.faults[..index].iter().any(|known| known.name == fault.name);
            if fault.name.is_empty() || is_known {
                return Err(CampaignError::Name(fault.name.clone()));
            }
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let scenario = Scenario::read(&folder.join(&campaign.scenario))?;
        Ok((campaign, scenario))
    }

    /// The runs with each fault alone.
    #[must_use]
    pub fn alone(&self) -> Vec<Run> {
        let of_fault = |fault| {
            (self.first_seed..self.first_seed.saturating_add(self.runs))
                .map(move |seed| Run { faults: vec![fault], seed })
        };
        (0..self.faults.len()).flat_map(of_fault).collect()
    }

    /// The runs with every two of them, each pair with one seed.
    #[must_use]
    pub fn pairs(&self) -> Vec<Run> {
        let count = self.faults.len();
        let pair = |first| (first + 1..count).map(move |second| vec![first, second]);
        (0..count)
            .flat_map(pair)
            .zip(0..)
            .map(|(faults, number)| Run { faults, seed: self.first_seed.saturating_add(number % self.runs.max(1)) })
            .collect()
    }

    /// Makes those runs that are in a shard, on all cores, and returns them in order. A run that panics is one of them.
    /// `done` is called after each.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn rows(
        &self,
        scenario: &Scenario,
        runs: &[Run],
        shard: Shard,
        done: impl Fn() + Sync,
    ) -> Result<Vec<Row>, CampaignError> {
        let name =
            |run: &Run, place| run.faults.get(place).map_or("", |&fault: &usize| self.faults[fault].name.as_str());
        let of_shard: Vec<(usize, &Run)> = runs.iter().enumerate().filter(|(run, _)| shard.has(*run)).collect();
        of_shard
            .into_par_iter()
            .map(|(number, run)| {
                let verdict = catch_unwind(AssertUnwindSafe(|| self.run(scenario, run))).ok().transpose()?;
                done();
                let can_recover = run.faults.iter().all(|&fault| self.faults[fault].can_recover);
                Ok(Row::new(number, [name(run, 0), name(run, 1)], run.seed, can_recover, verdict.as_ref()))
            })
            .collect()
    }

    /// Makes a run.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn run(&self, scenario: &Scenario, run: &Run) -> Result<Verdict, CampaignError> {
        let faults: Vec<&Fault> = run.faults.iter().filter_map(|&index| self.faults.get(index)).collect();
        let mut scenario = Scenario { seed: run.seed, ..scenario.clone() };
        // The controller of a campaign has a map of reflectors only; scans would cost ten times as much.
        scenario.laser.scans = false;
        let mut random = Random::new(run.seed, Stream::Faults);
        let simulation = simulate_with(&scenario, &faults, &mut random)?;
        let mut recording = simulation.recording;
        for fault in &faults {
            fault.spoil(&mut recording, &simulation.true_tricycle, &mut random);
            fault.mislead(&mut recording, &mut random);
        }
        let mut judge = Judge::new(self.limits, window(&faults).0);
        let options = RigOptions::told(self.seconds, run.seed, None);
        rig::drive(&recording, &faults, &options, |heard| {
            // The vehicle is told where it is when it drives off.
            if heard.time >= 0.0 {
                judge.hear(heard.now, heard.time, heard.output, heard.truth);
            }
        })?;
        Ok(judge.verdict(&faults))
    }
}
