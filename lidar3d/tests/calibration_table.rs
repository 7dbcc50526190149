//! Calibration where an AGV calibrates: what the walls show comes closer to the truth, what they do not show stays as the
//! factory has it, and the stated deviations are those of the errors. Scenes are cast ray by ray; the truth is kept apart.
//!
//! Two seeds of each scene; `AGV_CALIBRATION_SEEDS=50` makes the whole table.

use std::f64::consts::{PI, TAU};

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::{Offsets, point};
use agv_lidar3d::intrinsic::{Adjustment, AdjustmentError, Residual, Return, Target, calibrate, segment};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// First seed that nothing was chosen by.
const FIRST_SEED: u64 = 100_000;
const LASERS: usize = 32;
/// Standard deviation of a range, m.
const NOISE: f64 = 0.02;
/// Standard deviations of a factory's values: m, deg, deg, m.
const FACTORY: [f64; 4] = [0.02, 0.1, 0.3, 0.0];
const HEIGHT: f64 = 1.7;
const STEP: f64 = 0.7 * PI / 180.0;

struct Random(ChaCha8Rng);

impl Random {
    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.0.random::<f64>()
    }

    /// A normal deviate (Box and Muller).
    fn normal(&mut self) -> f64 {
        (-2.0 * self.between(1e-300, 1.0).ln()).sqrt() * self.between(0.0, TAU).cos()
    }
}

/// A rectangle that stands somewhere: a corner and two edges, in the frame of the world, m.
struct Face {
    corner: [f64; 3],
    edges: [[f64; 3]; 2],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 3] {
    [b * f - c * e, c * d - a * f, a * e - b * d]
}

impl Face {
    /// How far along a beam of unit length it lies.
    fn hit(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let normal = cross(self.edges[0], self.edges[1]);
        let far = dot(minus(self.corner, origin), normal) / dot(direction, normal);
        let at = minus(std::array::from_fn(|axis| origin[axis] + far * direction[axis]), self.corner);
        let is_in = self.edges.iter().all(|edge| (0.0..=dot(*edge, *edge)).contains(&dot(at, *edge)));
        (far > 0.5 && is_in).then_some(far)
    }

    fn upright(from: [f64; 2], to: [f64; 2], height: f64) -> Self {
        Self { corner: [from[0], from[1], 0.0], edges: [[to[0] - from[0], to[1] - from[1], 0.0], [0.0, 0.0, height]] }
    }
}

/// Where the sensor stands, and what it sees.
struct Stand {
    /// Pitch up and heading, rad; the place is the origin, 1.7 m above the ground.
    attitude: [f64; 2],
    faces: Vec<Face>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scene {
    Upright,
    Ramp(f64),
    Boards,
    Hall,
    BiasedRanges,
    WrongOffsets,
    RightFactory,
}

const SCENES: [Scene; 8] = [
    Scene::Upright,
    Scene::Ramp(3.0),
    Scene::Ramp(10.0),
    Scene::Boards,
    Scene::Hall,
    Scene::BiasedRanges,
    Scene::WrongOffsets,
    Scene::RightFactory,
];

fn ground() -> Face {
    Face { corner: [-60.0, -60.0, 0.0], edges: [[120.0, 0.0, 0.0], [0.0, 120.0, 0.0]] }
}

fn stands(scene: Scene, random: &mut Random) -> Vec<Stand> {
    let wall = |distance: f64| Face::upright([distance, -15.0], [distance, 15.0], 8.0);
    let distances = [3.0, 4.5, 6.0, 8.0, 10.0, 12.5, 15.0, 18.0];
    let mut all = Vec::new();
    for round in 0..3 {
        for distance in distances {
            let heading = random.between(-0.35, 0.35);
            let pitch = match scene {
                Scene::Ramp(degrees) => [degrees, -degrees, 0.0][round].to_radians(),
                Scene::WrongOffsets => [10.0_f64, -10.0, 0.0][round].to_radians(),
                _ => 0.0,
            };
            let faces = match scene {
                Scene::Boards => vec![ground(), board(0.25 * distance + 1.5, round, random)],
                Scene::Hall => hall(distance),
                _ => vec![ground(), wall(distance)],
            };
            all.push(Stand { attitude: [pitch, heading], faces });
        }
    }
    all
}

/// A board of 2.4 m by 1.8 m that leans by up to 30 deg, the middle as high as the sensor.
fn board(distance: f64, round: usize, random: &mut Random) -> Face {
    let lean = ([-30.0, 0.0, 30.0][round] + random.between(-5.0, 5.0)).to_radians();
    let up = [1.8 * lean.sin(), 0.0, 1.8 * lean.cos()];
    let corner = [distance - 0.5 * up[0], -1.2, HEIGHT - 0.5 * up[2]];
    Face { corner, edges: [[0.0, 2.4, 0.0], up] }
}

/// Four walls of 30 m by 18 m and 7 m high, and two pillars' faces.
fn hall(distance: f64) -> Vec<Face> {
    let (ahead, behind, left, right) = (distance, distance - 30.0, 6.0, -12.0);
    vec![
        ground(),
        Face::upright([ahead, right], [ahead, left], 7.0),
        Face::upright([behind, left], [behind, right], 7.0),
        Face::upright([behind, left], [ahead, left], 7.0),
        Face::upright([ahead, right], [behind, right], 7.0),
        Face::upright([0.6 * distance, 2.0], [0.6 * distance, 2.6], 7.0),
    ]
}

fn truth(random: &mut Random) -> Vec<Laser> {
    let laser = |number: usize| Laser {
        distance: 1.2 + random.between(-0.2, 0.2),
        elevation: (2.0 - 26.8 * number as f64 / (LASERS - 1) as f64).to_radians(),
        rotation: ([-4.5, -1.5, 1.5, 4.5][number % 4] + random.between(-0.4, 0.4)).to_radians(),
        vertical_offset: if number < LASERS / 2 { 0.21 } else { 0.15 },
        horizontal_offset: if number.is_multiple_of(2) { 0.026 } else { -0.026 },
        is_enabled: true,
        full: None,
    };
    (0..LASERS).map(laser).collect()
}

fn factory(truth: &[Laser], scene: Scene, random: &mut Random) -> Vec<Laser> {
    let [distance, elevation, rotation, offset] = match scene {
        Scene::RightFactory => [0.0; 4],
        Scene::WrongOffsets => [FACTORY[0], FACTORY[1], FACTORY[2], 0.005],
        _ => FACTORY,
    };
    let mut disturb = |laser: &Laser| Laser {
        distance: laser.distance + distance * random.normal(),
        elevation: laser.elevation + (elevation * random.normal()).to_radians(),
        rotation: laser.rotation + (rotation * random.normal()).to_radians(),
        vertical_offset: laser.vertical_offset + offset * random.normal(),
        horizontal_offset: laser.horizontal_offset + offset * random.normal(),
        ..*laser
    };
    truth.iter().map(&mut disturb).collect()
}

fn turned([pitch, heading]: [f64; 2], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let (x, z) = (x * pitch.cos() - z * pitch.sin(), x * pitch.sin() + z * pitch.cos());
    [x * heading.cos() - y * heading.sin(), x * heading.sin() + y * heading.cos(), z]
}

fn scan(truth: &[Laser], scene: Scene, stand: &Stand, random: &mut Random) -> Vec<Return> {
    let mut returns = Vec::new();
    let start = random.between(0.0, STEP);
    for column in 0..(TAU / STEP) as usize {
        let azimuth = start + STEP * column as f64;
        for (number, laser) in truth.iter().enumerate() {
            let at = |distance: f64| {
                turned(stand.attitude, point(laser, Offsets::Orthogonal, azimuth, distance - laser.distance))
            };
            let [x, y, z] = at(0.0);
            let origin = [x, y, z + HEIGHT];
            let direction = minus(at(1.0), at(0.0));
            let hits = stand.faces.iter().filter_map(|face| face.hit(origin, direction));
            let Some(far) = hits.min_by(f64::total_cmp) else { continue };
            let bias = if scene == Scene::BiasedRanges && far < 8.0 { 0.02 } else { 0.0 };
            let distance = far + bias + NOISE * random.normal() - laser.distance;
            let counted = (distance / 0.002).round() * 0.002;
            if (1.0..60.0).contains(&far) {
                returns.push(Return {
                    laser: number,
                    azimuth: (azimuth * 18_000.0 / PI).round() * PI / 18_000.0,
                    distance: counted,
                });
            }
        }
    }
    returns
}

/// Distances at which points are judged, m.
const JUDGED: [f64; 3] = [5.0, 10.0, 20.0];

/// Root mean square over the observed lasers, at 5, 10 and 20 m, m. Of errors the mean rotation is taken off: no wall
/// shows it.
#[derive(Clone, Copy, Debug)]
struct Judged {
    factory: [f64; 3],
    found: [f64; 3],
    stated: [f64; 3],
}

fn judge(truth: &[Laser], start: &[Laser], found: &Adjustment) -> Judged {
    let observed: Vec<usize> = (0..truth.len()).filter(|laser| found.deviations[*laser].is_some()).collect();
    let mean = |squares: &dyn Fn(usize) -> f64| {
        (observed.iter().map(|laser| squares(*laser)).sum::<f64>() / observed.len() as f64).sqrt()
    };
    let error = |lasers: &[Laser], distance: f64| {
        let off = |laser: &usize| lasers[*laser].rotation - truth[*laser].rotation;
        let common = observed.iter().map(off).sum::<f64>() / observed.len() as f64;
        mean(&|number| {
            let (laser, truth) = (lasers[number], truth[number]);
            let laser = Laser { rotation: laser.rotation - common, ..laser };
            let measured = distance - truth.distance;
            let at = |laser: &Laser| point(laser, Offsets::Orthogonal, 0.0, measured);
            let off = minus(at(&laser), at(&truth));
            dot(off, off)
        })
    };
    let stated = |distance| mean(&|laser| found.point_deviation(laser, Offsets::Orthogonal, distance).unwrap().powi(2));
    Judged {
        factory: JUDGED.map(|distance| error(start, distance)),
        found: JUDGED.map(|distance| error(&found.lasers, distance)),
        stated: JUDGED.map(stated),
    }
}

/// The scene of a seed: the truth, the factory's values, and the targets of so many stands.
fn seen(scene: Scene, seed: u64, count: usize) -> (Vec<Laser>, Vec<Laser>, Vec<Target>) {
    let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
    let truth = truth(&mut random);
    let start = factory(&truth, scene, &mut random);
    let stands = stands(scene, &mut random);
    let target = |(number, stand): (usize, &Stand)| {
        let returns = scan(&truth, scene, stand, &mut random);
        segment(&start, Offsets::Orthogonal, &returns, number as u64).ok()
    };
    let targets = stands.iter().take(count).enumerate().filter_map(target).collect();
    (truth, start, targets)
}

fn run(scene: Scene, seed: u64) -> Result<Judged, AdjustmentError> {
    let (truth, start, targets) = seen(scene, seed, usize::MAX);
    let found = calibrate(&start, Offsets::Orthogonal, Residual::AlongBeam, &targets)?;
    Ok(judge(&truth, &start, &found))
}

#[test]
fn nothing_is_worse_than_the_factorys_and_deviations_are_those_of_the_errors() {
    let seeds = std::env::var("AGV_CALIBRATION_SEEDS").map_or(2, |seeds| seeds.parse().unwrap());
    let first = std::env::var("AGV_CALIBRATION_FIRST").map_or(FIRST_SEED, |seed| seed.parse().unwrap());
    for scene in SCENES {
        let all: Vec<(u64, Judged)> = (first..first + seeds)
            .map(|seed| (seed, run(scene, seed).unwrap_or_else(|error| panic!("{seed}: {error}"))))
            .collect();
        for (at, distance) in JUDGED.into_iter().enumerate() {
            let mean = |value: fn(&Judged) -> [f64; 3]| {
                (all.iter().map(|(_, judged)| value(judged)[at].powi(2)).sum::<f64>() / all.len() as f64).sqrt()
            };
            let [factory, found, stated] = [mean(|j| j.factory), mean(|j| j.found), mean(|j| j.stated)];
            let (seed, worst) = all.iter().max_by(|a, b| a.1.found[at].total_cmp(&b.1.found[at])).unwrap();
            println!(
                "{scene:?} at {distance} m: factory {:.1} mm, found {:.1} (worst {:.1}, seed {seed}), stated {:.1}, ratio {:.2}",
                1e3 * factory,
                1e3 * found,
                1e3 * worst.found[at],
                1e3 * stated,
                found / stated
            );
            for (seed, judged) in &all {
                let limit = judged.factory[at] + judged.stated[at];
                assert!(judged.found[at] <= limit, "{scene:?} {seed}: {judged:?}");
            }
            // Two seeds do not tell a spread to better than this; where the factory is right, errors are below what is
            // stated.
            let limit = if seeds < 10 { 3.0 } else { 2.0 };
            assert!(found < limit * stated, "{scene:?}: {found} {stated}");
            assert!(scene == Scene::RightFactory || stated < limit * found, "{scene:?}: {found} {stated}");
        }
    }
}

#[test]
fn what_upright_walls_do_not_show_is_held() {
    let (_, start, targets) = seen(Scene::Upright, FIRST_SEED, usize::MAX);
    let found = calibrate(&start, Offsets::Orthogonal, Residual::AlongBeam, &targets).unwrap();
    let level = (0..LASERS).min_by(|a, b| start[*a].elevation.abs().total_cmp(&start[*b].elevation.abs())).unwrap();
    let held = found.held(level);
    assert!(held.elevation && held.vertical_offset && !held.distance && !held.rotation, "{held:?}");
    let moved = (found.lasers[level].elevation - start[level].elevation).to_degrees();
    assert!(moved.abs() < 0.02, "{moved}");
    assert!(found.held(LASERS).distance);
}

#[test]
fn scans_that_say_nothing_are_refused() {
    let (_, start, targets) = seen(Scene::Boards, FIRST_SEED, 1);
    let outcome = calibrate(&start, Offsets::Orthogonal, Residual::AlongBeam, &targets).map(|found| found.noise);
    assert!(matches!(outcome, Err(AdjustmentError::NothingGained { .. } | AdjustmentError::NoPoints)), "{outcome:?}");
}

#[test]
fn ranges_of_scans_that_contradict_each_other_are_told() {
    let (_, start, targets) = seen(Scene::BiasedRanges, FIRST_SEED, usize::MAX);
    let found = calibrate(&start, Offsets::Orthogonal, Residual::AlongBeam, &targets).unwrap();
    // The first three stands of each round are nearer than 8 m, where ranges are 20 mm too long.
    let is_near = |number: &usize| number % 8 < 3;
    let mean = |is_wanted: bool| {
        let wanted: Vec<f64> = found
            .common_range_errors
            .iter()
            .enumerate()
            .filter(|(number, _)| is_near(number) == is_wanted)
            .map(|(_, error)| *error)
            .collect();
        wanted.iter().sum::<f64>() / wanted.len() as f64
    };
    let apart = mean(true) - mean(false);
    assert!((0.01..0.05).contains(&apart), "{apart}");
}
