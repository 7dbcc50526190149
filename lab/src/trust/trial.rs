//! One run: a hall and a drive that are drawn, a fault of one size, and the judge at the bus.

use agv_core::geometry::Pose;
use agv_core::integrity::AlertLimits;
use agv_core::localizer::Parameters;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::mapping::contour_mapper::{CELL, map_contours};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{Scenario, Shapes, WorldOptions};
use agv_host_sim::simulate::{START, simulate};

use super::hall::{Generator, STANDS, draw};
use super::judge::{Judge, Moment};
use super::kinds::{Drawn, Hidden, Kind};
use super::nominal::NominalWorld;
use super::outcome::Outcome;
use super::scene::scene;
use super::sight::Sight;
use crate::campaign::CampaignError;
use crate::campaign::fault::{Fault, simulate_with};
use crate::campaign::rig::{self, RigOptions};
use crate::equipment::Equipment;

/// What one run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial<'a> {
    /// The kind of the fault.
    pub kind: &'a Kind,
    /// Its size.
    pub size: f64,
    /// Another fault, and its size.
    pub with: Option<(&'a Kind, f64)>,
    /// The seed of the run among those of its kind.
    pub seed: u64,
    /// The seed of hall, drive, noise and faults.
    pub scene: u64,
}

/// What is put to the test.
#[derive(Clone, Copy)]
pub struct Tested<'a> {
    /// The vehicle.
    pub equipment: Equipment,
    /// What draws the halls.
    pub halls: Generator,
    /// The world.
    pub world: NominalWorld,
    /// Whether it has a map of the contours of its hall, which it has made among the reflectors on the same way before.
    pub has_contours: bool,
    /// What changes that which the controller believes, from its defaults.
    pub settings: &'a (dyn Fn(&mut Parameters) + Sync),
}

impl Default for Tested<'_> {
    fn default() -> Self {
        Self {
            equipment: Equipment::default(),
            halls: Generator::default(),
            world: NominalWorld::default(),
            has_contours: false,
            settings: &|_| {},
        }
    }
}

impl Tested<'_> {
    /// The map of contours that it has of the hall of a scenario.
    fn contours(&self, scenario: &Scenario) -> Result<Option<ContourMap>, CampaignError> {
        if !self.has_contours {
            return Ok(None);
        }
        let mut before = scenario.clone();
        before.seed = before.seed.wrapping_add(MAPPING);
        let map = map_contours(&simulate(&before)?.recording, CELL);
        Ok(Some(map.map_err(CampaignError::Map)?))
    }
}

/// From the seed of a drive to that of the one on which its hall was mapped.
const MAPPING: u64 = 1 << 40;

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

impl<'a> Trial<'a> {
    /// The run of a kind, or of two, with that seed.
    #[must_use]
    pub fn new((kind, size): (&'a Kind, f64), with: Option<(&'a Kind, f64)>, seed: u64) -> Self {
        let names = [Some(kind), with.map(|(kind, _)| kind)].into_iter().flatten().map(|kind| kind.name.as_str());
        Self { kind, size, with, seed, scene: scene(names, seed) }
    }

    /// The run of a kind, or of two, in that scene.
    #[must_use]
    pub const fn in_scene((kind, size): (&'a Kind, f64), with: Option<(&'a Kind, f64)>, scene: u64) -> Self {
        Self { kind, size, with, seed: scene, scene }
    }

    /// The kinds of its faults with their sizes.
    fn kinds(&self) -> impl Iterator<Item = (&Kind, f64)> {
        [(self.kind, self.size)].into_iter().chain(self.with)
    }

    /// Makes the run.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn run(&self, tested: &Tested) -> Result<Tried, CampaignError> {
        self.run_heard(tested, |_| {})
    }

    /// Makes the run, and tells each moment that is judged.
    ///
    /// # Errors
    /// See [`CampaignError`].
    pub fn run_heard(&self, tested: &Tested, mut tell: impl FnMut(&Moment)) -> Result<Tried, CampaignError> {
        let hall = draw(tested.halls, self.scene);
        let mut scenario = hall.scenario.clone();
        tested.world.apply(&mut scenario);
        tested.equipment.apply(&mut scenario);
        let contours = tested.contours(&scenario)?;
        let mut random = Random::new(self.scene, Stream::Faults);
        let timetable = Timetable::of(&scenario)?;
        let seconds = timetable.seconds;
        let mut drawn = Vec::new();
        for (kind, size) in self.kinds() {
            let from = kind.draw_begin(seconds, &timetable.standing, &mut random);
            drawn.push((from, kind.at(size, from).map_err(CampaignError::Kind)?));
        }
        let faults = enter(&drawn, &mut scenario);
        let simulation = simulate_with(&scenario, &faults, &mut random)?;
        let mut recording = simulation.recording;
        (tested.settings)(&mut recording.parameters);
        let sight = Sight::of(&recording, [hall.station.x, hall.station.y]);
        for fault in &faults {
            fault.spoil(&mut recording, &simulation.true_tricycle, &mut random);
        }
        for fault in &faults {
            fault.mislead(&mut recording, &mut random);
        }
        let begins = drawn.iter().filter(|(_, drawn)| *drawn != Drawn::Nothing).map(|(from, _)| *from);
        let begins = begins.fold(f64::INFINITY, f64::min);
        let mut judge = Judge::new(AlertLimits::default());
        let mut here = None;
        let of_drawn = self.kinds().zip(&drawn);
        let mut hidden: Vec<Hidden> =
            of_drawn.filter_map(|((kind, _), (from, drawn))| kind.hidden(*from, drawn)).collect();
        let is_told = self.kinds().any(|(kind, _)| kind.tells_start);
        let contours = contours.as_ref().map(ContourMap::view);
        let told = is_told.then_some(STANDS);
        let options = RigOptions { seconds, seed: self.scene, stands: 0.0, told, contours };
        rig::drive(&recording, &faults, &options, |heard| {
            let before = here;
            here = (heard.truth)(heard.now).or(before);
            hidden.retain(|one| !sight.reveals(one.by, one.since, heard.time));
            let moment = Moment {
                now: heard.now,
                heard: heard.published,
                truth: heard.published.and_then(|(_, stated)| (heard.truth)(stated)),
                driven: before.zip(here).map_or(0.0, |(before, here)| driven(&before, &here)),
                docks: sight.docks(heard.time),
                is_nominal: sight.is_nominal(heard.time),
                is_bare: here.is_some_and(|here| hall.is_bare(&here.position())),
                has_begun: heard.time >= begins,
                is_hidden: hidden.iter().any(|one| heard.time >= one.from),
            };
            judge.hear(&moment);
            tell(&moment);
        })?;
        let ends = |fault: &&Fault| fault.until.is_some_and(|until| sight.can_recover(until));
        // Of two faults both must end.
        let can_recover = match self.with {
            None => faults.iter().any(ends),
            Some(_) => faults.len() == drawn.len() && faults.iter().all(ends),
        };
        Ok(Tried { outcome: judge.outcome(), is_accepted: hall.is_accepted, can_recover })
    }
}

/// Enters what was drawn into the scenario, where that simulates it. Returns the faults of what is measured and told.
fn enter<'a>(drawn: &'a [(f64, Drawn)], scenario: &mut Scenario) -> Vec<&'a Fault> {
    let mut faults = Vec::new();
    for (_, drawn) in drawn {
        match drawn {
            Drawn::Nothing => {}
            Drawn::Fault(fault) => faults.push(fault),
            Drawn::Knock(knock) => scenario.laser.knocks.push(*knock),
            Drawn::Carry(carry) => scenario.drive.carries.push(*carry),
            Drawn::Age(age) => scenario.laser.ages.push(*age),
        }
    }
    faults
}

/// A vehicle that is further away after a hundredth of a second, m, was carried.
const CARRIED: f64 = 0.1;

/// How far a vehicle has driven from one pose to the next, m. One that is carried does not drive.
fn driven(before: &Pose, here: &Pose) -> f64 {
    let step = before.between(here).position().norm();
    if step > CARRIED { 0.0 } else { step }
}

/// When a drive ends, and when it stands in between.
struct Timetable {
    /// How long it takes, s.
    seconds: f64,
    /// Times at which the vehicle stands, and has driven before, and drives on later, s.
    standing: Vec<f64>,
}

impl Timetable {
    /// The drive alone says it.
    fn of(scenario: &Scenario) -> Result<Self, CampaignError> {
        let mut alone = Scenario { world: WorldOptions::Shapes(Shapes::default()), ..scenario.clone() };
        alone.laser.scans = false;
        let truth = simulate(&alone)?.recording.truth;
        let moves: Vec<bool> = truth
            .windows(2)
            .map(|pair| {
                pair.first().zip(pair.last()).is_some_and(|(a, b)| a.pose.between(&b.pose).position().norm() > 1e-9)
            })
            .collect();
        let first = moves.iter().position(|moves| *moves).unwrap_or(0);
        let last = moves.iter().rposition(|moves| *moves).unwrap_or(0);
        let standing = truth
            .iter()
            .zip(&moves)
            .enumerate()
            .filter(|(place, (_, moves))| !**moves && (first..last).contains(place));
        Ok(Self {
            seconds: truth.last().map_or(0.0, |last| last.time.since(START)),
            standing: standing.map(|(_, (sample, _))| sample.time.since(START)).collect(),
        })
    }
}
