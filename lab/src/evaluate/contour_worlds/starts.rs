//! A vehicle that is switched on somewhere in a kept map of contours: how often it finds itself, and that it is never wrong.

use agv_core::contours::{PlaceAnswer, PlaceProgress, PlaceSearch};
use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::sensing::PointScan;
use agv_host_sim::import::RANGES;
use agv_host_sim::mapping::contour_map::ContourMap;
use agv_host_sim::recording::RecordedScan;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::raycast::RayCaster;
use rayon::prelude::*;
use serde::Serialize;

use super::sites::{Site, SiteKind};
use super::survey::{Overlap, map, scan};

/// What became of the starts in worlds of one kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Outcome {
    pub world: &'static str,
    pub moved_share: f64,
    pub starts: usize,
    pub right: usize,
    pub wrong: usize,
    pub ambiguous: usize,
    /// of these, starts at which another pose has indeed 90 per cent of the overlap of the true one.
    pub two_fit: usize,
    pub unknown: usize,
    pub effort: (f64, u64),
    pub largest_step: u32,
    pub wrong_seeds: Vec<String>,
    pub why: Vec<String>,
}

/// Starts in one world.
pub const STARTS_A_WORLD: u64 = 25;

/// An answer with a larger error of position (m) or heading (rad) is wrong.
const RIGHT: (f64, f64) = (0.1, std::f64::consts::PI / 180.0);

/// A pose fits as well as the true one with this share of its overlap.
const AS_GOOD: f64 = 0.9;

const SLICE: u32 = 4000;

pub fn run(kind: SiteKind, moved_share: f64, seed: u64, starts: u64, done: impl Fn() + Sync) -> Outcome {
    let worlds = starts.div_ceil(STARTS_A_WORLD);
    let all: Vec<Outcome> = (0..worlds)
        .into_par_iter()
        .map(|number| {
            let count = STARTS_A_WORLD.min(starts - number * STARTS_A_WORLD);
            in_world(kind, moved_share, seed + number, count, &done)
        })
        .collect();
    let mut sum = Outcome { world: kind.name(), moved_share, ..Outcome::default() };
    for one in all {
        sum.starts += one.starts;
        sum.right += one.right;
        sum.wrong += one.wrong;
        sum.ambiguous += one.ambiguous;
        sum.two_fit += one.two_fit;
        sum.unknown += one.unknown;
        sum.effort = (sum.effort.0 + one.effort.0, sum.effort.1.max(one.effort.1));
        sum.largest_step = sum.largest_step.max(one.largest_step);
        sum.wrong_seeds.extend(one.wrong_seeds);
        sum.why.extend(one.why);
    }
    sum.effort.0 /= sum.starts.max(1) as f64;
    sum
}

fn in_world(kind: SiteKind, moved_share: f64, seed: u64, count: u64, done: &(impl Fn() + Sync)) -> Outcome {
    let site = Site::new(kind, seed);
    let mut random = Random::new(seed, Stream::Kidnapping);
    let kept = map(&site, &mut random);
    let overlap = Overlap::new(&kept);
    let now = site.changed(moved_share, seed);
    let caster = RayCaster::new(&now.world());
    let mut search: Box<PlaceSearch> = Box::default();
    let mut outcome = Outcome::default();
    for start in 0..count {
        let truth = now.free_pose(&mut random);
        let scan = scan(&caster, &truth, Time::default(), &mut random);
        one(
            &mut search,
            &kept,
            &scan,
            &truth,
            &overlap,
            &mut outcome,
            &format!("{} seed {seed} start {start}", kind.name()),
        );
        done();
    }
    outcome
}

fn one(
    search: &mut PlaceSearch,
    kept: &ContourMap,
    scan: &RecordedScan,
    truth: &Pose,
    overlap: &Overlap,
    outcome: &mut Outcome,
    name: &str,
) {
    let mut points: Box<PointScan<1440>> = Box::default();
    points.set(&scan.view(), RANGES.0, RANGES.1);
    let map = kept.view().expect("map");
    search.begin(points.view());
    let mut effort = 0_u64;
    let answer = loop {
        effort += u64::from(SLICE);
        match search.advance(&map, SLICE) {
            PlaceProgress::Done(answer) => break answer,
            PlaceProgress::Searching => {}
        }
    };
    outcome.starts += 1;
    outcome.effort = (outcome.effort.0 + effort as f64, outcome.effort.1.max(effort));
    let is_right = |pose: &Pose| {
        let error = truth.between(pose);
        error.position().norm() < RIGHT.0 && error.theta.abs() < RIGHT.1
    };
    let fits = |pose: &Pose| !is_right(pose) && overlap.share(scan, pose) >= AS_GOOD * overlap.share(scan, truth);
    match answer {
        PlaceAnswer::Found(fix) if is_right(&fix.pose) => outcome.right += 1,
        PlaceAnswer::Found(fix) => {
            outcome.wrong += 1;
            let also = if fits(&fix.pose) { ", which fits as well" } else { "" };
            outcome.wrong_seeds.push(format!(
                "{name}{also}: {:?} share {} shown {}; truth {truth:?} {}",
                fix.pose,
                fix.share,
                fix.shown,
                overlap.share(scan, truth)
            ));
        }
        PlaceAnswer::Ambiguous(one, other) => {
            outcome.ambiguous += 1;
            outcome.two_fit += usize::from(fits(&one.pose) || fits(&other.pose));
            if !(fits(&one.pose) || fits(&other.pose)) {
                outcome.why.push(format!(
                    "{name}: ambiguous {:?} {:.2} {:.2} {:?}; {:?} {:.2} {:.2}; {} {}; truth {truth:?}",
                    one.pose,
                    one.share,
                    one.shown,
                    one.free_axis,
                    other.pose,
                    other.share,
                    other.shown,
                    is_right(&one.pose),
                    is_right(&other.pose)
                ));
            }
        }
        PlaceAnswer::TooFew | PlaceAnswer::Unknown => {
            outcome.unknown += 1;
            outcome.why.push(format!(
                "{name}: {answer:?}; truth {truth:?} overlap {:.2} {:?}",
                overlap.share(scan, truth),
                search.describe()
            ));
        }
    }
}
