//! Loops in a building that looks alike everywhere: none is closed where none was driven.

use std::f64::consts::PI;

use agv_core::geometry::{Point, Pose, difference};
use agv_core::measurement::{LaserId, Time};
use agv_host_sim::mapping::slam::{SlamMap, SlamParameters, map};
use agv_host_sim::recording::RecordedScan;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::raycast::RayCaster;
use agv_host_sim::simulate::world::World;

/// Length of the corridor, half of its width, and depth and width of its niches, one each so many metres on both sides, m.
const LENGTH: f64 = 100.0;
const HALF: f64 = 1.2;
const NICHE: (f64, f64) = (0.2, 1.0);
const EVERY: f64 = 5.0;

const BEAMS: usize = 360;
const REACH: f64 = 25.0;

fn corridor() -> World {
    let mut world = World::default();
    for side in [-1.0, 1.0] {
        let at = |x: f64, y: f64| Point::new(x, side * y);
        for niche in 0..(LENGTH / EVERY) as u32 {
            let from = EVERY * f64::from(niche);
            let (door, end) = (from + EVERY - NICHE.1, from + EVERY);
            world.add_wall(at(from, HALF), at(door, HALF));
            world.add_wall(at(door, HALF), at(door, HALF + NICHE.0));
            world.add_wall(at(door, HALF + NICHE.0), at(end, HALF + NICHE.0));
            world.add_wall(at(end, HALF + NICHE.0), at(end, HALF));
        }
    }
    for x in [0.0, LENGTH] {
        world.add_wall(Point::new(x, -2.0), Point::new(x, 2.0));
    }
    world
}

fn scan(caster: &RayCaster, pose: &Pose, start: Time, random: &mut Random) -> RecordedScan {
    let step = PI / BEAMS as f64;
    let range = |beam: usize| {
        let (sine, cosine) = (pose.theta - 0.5 * PI + step * beam as f64).sin_cos();
        let hit = caster.first_hit(&pose.position(), &Point::new(cosine, sine), REACH);
        hit.map_or(0.0, |hit| (hit.distance + 0.01 * random.normal()) as f32)
    };
    RecordedScan {
        laser: LaserId::FIRST,
        start,
        beam_interval: 0.0,
        first_bearing: -0.5 * PI,
        bearing_step: step,
        ranges: (0..BEAMS).map(range).collect(),
        intensities: Vec::new(),
    }
}

/// Maps a drive of true poses, of which the odometry has the way wrong by a share and by noise.
fn mapped(truth: &[Pose], seed: u64) -> SlamMap {
    let caster = RayCaster::new(&corridor());
    let mut random = Random::new(seed, Stream::Laser);
    let mut odometry = truth[0];
    let mut seen = Vec::new();
    for (number, pair) in [truth[0]].iter().chain(truth).zip(truth).enumerate() {
        let moved = pair.0.between(pair.1);
        let slip = 1.05 + 0.05 * random.normal();
        odometry = odometry.compose(&Pose::new(slip * moved.x, moved.y, moved.theta + 0.002 * random.normal()));
        let start = Time::from_seconds(1.0 + number as f64);
        seen.push((scan(&caster, pair.1, start, &mut random), odometry));
    }
    let scans: Vec<_> = seen.iter().map(|(scan, odometry)| (scan, *odometry)).collect();
    map(&scans, &SlamParameters::all(), || ()).unwrap()
}

/// Loops whose true displacement is another one, by more than 0.5 m or 10 degrees.
fn false_loops(found: &SlamMap, truth: &[Pose]) -> Vec<(Pose, Pose)> {
    let pose = |key: usize| truth[found.keys[key].scan];
    let ends = found.closures.iter().map(|edge| (pose(edge.from).between(&pose(edge.to)), edge.displacement));
    let is_false = |(truth, found): &(Pose, Pose)| {
        let off = truth.between(found);
        off.position().norm() > 0.5 || difference(truth.theta, found.theta).abs() > 10.0_f64.to_radians()
    };
    ends.filter(is_false).collect()
}

/// One way, and there and back: all that is proposed by a place that looks alike is refused.
#[test]
fn along_a_corridor_that_looks_alike_no_loop_is_closed_that_was_not_driven() {
    let there = (0..=80).map(|step| Pose::new(10.0 + f64::from(step), 0.1, 0.0));
    let turn = (1..=8).map(|step| Pose::new(90.0, 0.1, PI * f64::from(step) / 8.0));
    let back = (1..=80).map(|step| Pose::new(90.0 - f64::from(step), 0.1, PI));
    let ways: [Vec<Pose>; 2] = [there.clone().collect(), there.chain(turn).chain(back).collect()];
    for (seed, truth) in (5..).zip(ways) {
        let found = mapped(&truth, seed);
        let wrong = false_loops(&found, &truth);
        assert!(wrong.is_empty(), "{} of {} loops: {wrong:?}", wrong.len(), found.closures.len());
        assert!(found.closures.len() + found.refused.len() > 20, "{} refused", found.refused.len());
    }
}
