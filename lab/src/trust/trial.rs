//! One run: a hall and a drive that are drawn, a fault of one size, and the judge at the bus.

use agv_core::geometry::Pose;
use agv_core::integrity::AlertLimits;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{Scenario, Shapes, WorldOptions};
use agv_host_sim::simulate::{START, simulate};

use super::hall::{Hall, draw};
use super::judge::{Judge, Moment};
use super::kinds::{Drawn, Kind};
use super::outcome::Outcome;
use super::sight::Sight;
use crate::campaign::CampaignError;
use crate::campaign::fault::Fault;
use crate::campaign::rig::{self, RigOptions};

/// What one run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial<'a> {
    /// The kind of the fault.
    pub kind: &'a Kind,
    /// Its size.
    pub size: f64,
    /// The seed of hall, drive, noise and fault.
    pub seed: u64,
}

/// A run that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// What became of it.
    pub outcome: Outcome,
    /// Whether the commissioning check accepts the hall.
    pub is_accepted: bool,
    /// Whether its fault ends early enough, with enough turning and in sight after it, for a recovery to be asked for.
    pub can_recover: bool,
}

impl Trial<'_> {
    /// Makes the run.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn run(&self) -> Result<Tried, CampaignError> {
        let Hall { mut scenario, station, bare, is_accepted } = draw(self.seed);
        let mut random = Random::new(self.seed, Stream::Faults);
        // The drive alone says how long it takes.
        let seconds = duration(&scenario)?;
        let from = self.kind.draw_begin(seconds, &mut random);
        let drawn = self.kind.at(self.size, from).map_err(CampaignError::Name)?;
        if let Drawn::Knock(knock) = &drawn {
            scenario.laser.knocks.push(*knock);
        }
        let simulation = simulate(&scenario)?;
        let mut recording = simulation.recording;
        let sight = Sight::of(&recording, [station.x, station.y]);
        let faults: Vec<&Fault> = match &drawn {
            Drawn::Fault(fault) => vec![fault],
            Drawn::Nothing | Drawn::Knock(_) => Vec::new(),
        };
        for fault in &faults {
            fault.spoil(&mut recording, &simulation.true_tricycle, &mut random);
            fault.mislead(&mut recording, &mut random);
        }
        let mut judge = Judge::new(AlertLimits::default());
        let mut before = None;
        let mut is_hidden = self.kind.revealed.is_some();
        let options = RigOptions { seconds, seed: self.seed, is_told: self.kind.tells_start };
        rig::drive(&recording, &faults, &options, |heard| {
            let here = (heard.truth)(heard.now);
            let driven = before.zip(here).map_or(0.0, |(before, here): (Pose, Pose)| {
                let step = before.between(&here).position().norm();
                // A vehicle that is carried does not drive.
                if step > CARRIED { 0.0 } else { step }
            });
            before = here.or(before);
            is_hidden = is_hidden && !self.kind.revealed.is_some_and(|by| sight.reveals(by, heard.time));
            let [least, most] = bare;
            let is_bare =
                before.is_some_and(|here| (least.x..=most.x).contains(&here.x) && (least.y..=most.y).contains(&here.y));
            judge.hear(&Moment {
                now: heard.now,
                heard: heard.published,
                truth: heard.published.and_then(|(_, stated)| (heard.truth)(stated)),
                driven,
                docks: sight.docks(heard.time),
                is_nominal: sight.is_nominal(heard.time),
                is_bare,
                is_hidden,
            });
        })?;
        let can_recover = faults.iter().filter_map(|fault| fault.until).any(|until| sight.can_recover(until));
        Ok(Tried { outcome: judge.outcome(), is_accepted, can_recover })
    }
}

/// A vehicle that is further away after a hundredth of a second, m, was carried.
const CARRIED: f64 = 0.1;

/// How long the drive takes, s.
fn duration(scenario: &Scenario) -> Result<f64, CampaignError> {
    let mut alone = Scenario { world: WorldOptions::Shapes(Shapes::default()), ..scenario.clone() };
    alone.laser.scans = false;
    let truth = simulate(&alone)?.recording.truth;
    Ok(truth.last().map_or(0.0, |last| last.time.since(START)))
}
