//! A vehicle that is switched on somewhere in a kept map of contours: how often it finds itself, and that it is never wrong.
//!
//! It stands still and sees one revolution after another, with default parameters and the effort that a revolution leaves.

use agv_core::geometry::Pose;
use agv_core::localizer::{CONTOUR_EFFORT_A_REVOLUTION, CONTOUR_SLICE, Event, Parameters, StartState};
use agv_core::measurement::{PoseIncrement, Time};
use agv_core::odometry::Vehicle;
use agv_host_sim::accuracy::Spread;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::recording::RecordedScan;
use agv_host_sim::replay::{ContourFinder, ContourRoom};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::raycast::RayCaster;
use rayon::prelude::*;
use serde::Serialize;

use super::sites::{Site, SiteKind};
use super::survey::{Overlap, map, scan};

/// What became of the starts in worlds of one kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Kind of the worlds.
    pub world: &'static str,
    /// Share of what may be moved that was moved since the map was made, by 5 to 50 cm; trucks have come and gone then.
    pub moved_share: f64,
    /// Number of starts.
    pub starts: usize,
    /// Starts with a right answer, and with a wrong one.
    pub right: usize,
    /// See `right`.
    pub wrong: usize,
    /// The same of the starts where the vehicle said that two places fit.
    pub ambiguous: usize,
    /// Of the ambiguous ones those at which a pose that it named, and that is not the true one, has nine tenths of the true one's
    /// overlap, by the returns and the points of the map alone.
    pub two_fit: usize,
    /// Starts at which it said nothing.
    pub unknown: usize,
    /// Share of right answers among all starts but those where two fit.
    pub right_share: f64,
    /// Time to an answer, s.
    pub seconds: Spread,
    /// Effort of a start: points that are looked up.
    pub effort: Spread,
    /// Starts that were wrong, ambiguous without reason, or without answer: seed of the world and number of the start.
    pub failed: Vec<(u64, u64)>,
}

/// Starts in one world.
pub const STARTS_A_WORLD: u64 = 25;

/// An answer with a larger error of position (m) or heading (rad) is wrong.
const RIGHT: (f64, f64) = (0.1, std::f64::consts::PI / 180.0);

/// A pose fits as well as the true one with this share of its overlap.
const AS_GOOD: f64 = 0.9;

/// Time of a revolution, s.
const REVOLUTION: f64 = 0.125;

/// Revolutions after which a start is given up: what it cannot tell after some looks it cannot tell later.
const REVOLUTIONS: u32 = 40;

/// Looks without an answer after which it is given up.
const LOOKS: u32 = 3;

/// What a vehicle says of its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Said {
    Right,
    Wrong,
    /// Whether two fit.
    Ambiguous(bool),
    Nothing,
}

/// What happened at one start.
struct Start {
    name: (u64, u64),
    said: Said,
    seconds: f64,
    effort: f64,
}

/// Simulates `starts` starts in worlds of a kind, of which that share has been moved since they were mapped, from a seed on; `done` is
/// called after each.
#[must_use]
pub fn run(kind: SiteKind, moved_share: f64, seed: u64, starts: u64, done: impl Fn() + Sync) -> Outcome {
    let worlds = starts.div_ceil(STARTS_A_WORLD);
    let all: Vec<Vec<Start>> = (0..worlds)
        .into_par_iter()
        .map(|number| {
            let count = STARTS_A_WORLD.min(starts - number * STARTS_A_WORLD);
            in_world(kind, moved_share, seed + number, count, &done)
        })
        .collect();
    outcome(kind, moved_share, &all.into_iter().flatten().collect::<Vec<_>>())
}

fn outcome(kind: SiteKind, moved_share: f64, all: &[Start]) -> Outcome {
    let count = |said: Said| all.iter().filter(|start| start.said == said).count();
    let (right, two_fit) = (count(Said::Right), count(Said::Ambiguous(true)));
    let has_failed = |start: &&Start| !matches!(start.said, Said::Right | Said::Ambiguous(true));
    Outcome {
        world: kind.name(),
        moved_share,
        starts: all.len(),
        right,
        wrong: count(Said::Wrong),
        ambiguous: two_fit + count(Said::Ambiguous(false)),
        two_fit,
        unknown: count(Said::Nothing),
        right_share: right as f64 / (all.len() - two_fit).max(1) as f64,
        seconds: Spread::of(all.iter().filter(|start| start.said == Said::Right).map(|start| start.seconds)),
        effort: Spread::of(all.iter().map(|start| start.effort)),
        failed: all.iter().filter(has_failed).map(|start| start.name).collect(),
    }
}

fn in_world(kind: SiteKind, moved_share: f64, seed: u64, count: u64, done: &(impl Fn() + Sync)) -> Vec<Start> {
    let site = Site::new(kind, seed);
    let mut random = Random::new(seed, Stream::Kidnapping);
    let kept = map(&site, &mut random);
    let overlap = Overlap::new(&kept);
    let now = site.changed(moved_share, seed);
    let caster = RayCaster::new(&now.world());
    let mut finder = Box::new(ContourFinder::new(Parameters::new(Vehicle::Increments, Pose::default())));
    let mut room: Box<ContourRoom> = Box::default();
    (0..count)
        .map(|number| {
            let truth = now.free_pose(&mut random);
            let look = |time: Time, random: &mut Random| scan(&caster, &truth, time, random);
            let (said, seconds, effort) =
                switch_on((&mut finder, &mut room), &kept, &truth, &overlap, look, &mut random);
            done();
            Start { name: (seed, number), said, seconds, effort }
        })
        .collect()
}

/// What the vehicle says that stands at `truth`, when, s, and with which effort.
fn switch_on<'m>(
    (finder, room): (&mut ContourFinder<'m>, &mut ContourRoom),
    kept: &'m ContourMap,
    truth: &Pose,
    overlap: &Overlap,
    look: impl Fn(Time, &mut Random) -> RecordedScan,
    random: &mut Random,
) -> (Said, f64, f64) {
    let map = kept.view();
    let is_right = |pose: &Pose| {
        let error = truth.between(pose);
        error.position().norm() < RIGHT.0 && error.theta.abs() < RIGHT.1
    };
    finder.forget();
    let (mut said, mut effort, mut answers) = (Said::Nothing, 0.0, 0);
    for revolution in 0..REVOLUTIONS {
        let seconds = f64::from(revolution) * REVOLUTION;
        let time = Time::from_seconds(1.0 + seconds);
        finder.handle(&Event::Increment(PoseIncrement { time, displacement: Pose::default() }));
        let scan = look(time, random);
        finder.handle(&Event::Scan(scan.view()));
        let fits = |pose: &Pose| !is_right(pose) && overlap.share(&scan, pose) >= AS_GOOD * overlap.share(&scan, truth);
        let mut left = CONTOUR_EFFORT_A_REVOLUTION;
        while left > 0 {
            left = left.saturating_sub(CONTOUR_SLICE);
            effort += f64::from(CONTOUR_SLICE);
            match finder.search(&map, room, CONTOUR_SLICE) {
                StartState::Searching => continue,
                StartState::Found(fix) => {
                    let said = if is_right(&fix.pose) { Said::Right } else { Said::Wrong };
                    return (said, seconds + REVOLUTION, effort);
                }
                StartState::Ambiguous(one, other) => {
                    said = Said::Ambiguous(said == Said::Ambiguous(true) || fits(&one) || fits(&other));
                    answers += 1;
                }
                StartState::TooFew | StartState::Unknown => answers += 1,
                StartState::Waiting | StartState::Unconfirmed(_) => {}
            }
            break;
        }
        if answers >= LOOKS {
            break;
        }
    }
    (said, f64::NAN, effort)
}
