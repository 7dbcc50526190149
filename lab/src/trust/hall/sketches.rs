//! Halls as people describe them in a few words, and drives by a random walk on a grid of ways: one sketch for each seed in
//! turn, its measures drawn.

use std::f64::consts::FRAC_PI_2;

use agv_core::geometry::{Point, Pose};
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{
    PathKind, PathOptions, PoseOptions, ReflectorShape, Scenario, Shapes, WorldOptions,
};

use super::shapes::{PROUD, add, add_box};
use super::{Hall, empty, is_accepted, poses};

/// What a hall is, in a few words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sketch {
    /// Aisles in a grid between blocks of racks, reflectors at the corners and along the blocks.
    Grid,
    /// An open hall with just so many reflectors that three are in sight.
    ThreeInSight,
    /// An open hall with all reflectors along one wall.
    OneLine,
    /// A wide floor whose reflectors are 22 m away and farther.
    Far,
    /// An open hall with columns, driven at 2.5 m/s.
    Fast,
    /// An open hall whose reflectors are those on the other side of its middle, but for one to three.
    Symmetric,
    /// Aisles in a grid whose reflectors come at one pitch.
    Periodic,
}

/// All sketches; a seed draws the one of its remainder.
pub const SKETCHES: [Sketch; 7] = [
    Sketch::Grid,
    Sketch::ThreeInSight,
    Sketch::OneLine,
    Sketch::Far,
    Sketch::Fast,
    Sketch::Symmetric,
    Sketch::Periodic,
];

/// The sketch that a seed draws.
#[must_use]
pub fn sketch(seed: u64) -> Sketch {
    SKETCHES[(seed % SKETCHES.len() as u64) as usize]
}

/// Ways that cross each other at right angles, and what is between them.
struct Grid {
    /// Ways along y and along x.
    ways: [usize; 2],
    /// From one to the next, m.
    pitch: [f64; 2],
    /// From the outer ways to the walls, m.
    margin: f64,
    /// Width of a way between blocks, m.
    aisle: f64,
    /// Radius of the bends, m.
    radius: f64,
}

impl Grid {
    fn draw(sketch: Sketch, random: &mut Random) -> Self {
        let ways = [4 + usize::from(random.happens(0.5)), 3 + usize::from(random.happens(0.5))];
        let (pitch, margin, radius) = match sketch {
            Sketch::Fast => ([random.between(20.0, 28.0), random.between(16.0, 22.0)], 8.0, random.between(4.5, 5.5)),
            Sketch::Far => ([random.between(8.0, 10.0), random.between(7.0, 9.0)], 23.0, random.between(1.8, 2.4)),
            _ => ([random.between(11.0, 16.0), random.between(9.0, 12.0)], 5.0, random.between(1.8, 2.4)),
        };
        Self { ways, pitch, margin, aisle: random.between(4.0, 5.5), radius }
    }

    fn size(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.ways[axis] - 1) as f64 * self.pitch[axis] + 2.0 * self.margin)
    }

    fn node(&self, [i, j]: [usize; 2]) -> Point {
        Point::new(self.margin + i as f64 * self.pitch[0], self.margin + j as f64 * self.pitch[1])
    }

    /// Middles of what is between the ways.
    fn blocks(&self) -> Vec<Point> {
        let half = Point::new(0.5 * self.pitch[0], 0.5 * self.pitch[1]);
        let of_row = |j| (0..self.ways[0] - 1).map(move |i| self.node([i, j]) + half);
        (0..self.ways[1] - 1).flat_map(of_row).collect()
    }

    /// Length and width of a block.
    fn block_size(&self) -> [f64; 2] {
        [self.pitch[0] - self.aisle, self.pitch[1] - self.aisle]
    }

    /// Where one is, one step in a direction, counted in quarters from x to y; none beyond the last way.
    fn step(&self, [i, j]: [usize; 2], quarter: usize) -> Option<[usize; 2]> {
        let next = match quarter % 4 {
            0 => [i + 1, j],
            1 => [i, j + 1],
            2 => [i.checked_sub(1)?, j],
            _ => [i, j.checked_sub(1)?],
        };
        (next[0] < self.ways[0] && next[1] < self.ways[1]).then_some(next)
    }
}

/// Ways driven from crossing to crossing.
const EDGES: usize = 9;
/// How far the vehicle reverses in the middle of the drive, and at its end, m.
const REVERSED: f64 = 3.0;

/// A random walk that never turns about: it begins in the first way along x.
fn walk(grid: &Grid, random: &mut Random) -> PathOptions {
    let start = [0, (random.uniform() * grid.ways[1] as f64) as usize];
    let (mut at, mut quarter) = (start, 0);
    let mut segments = Vec::new();
    let mut legs = Vec::new();
    // What the bend behind has taken of the next way.
    let mut taken = 0.0;
    for edge in 0..EDGES {
        let Some(next) = grid.step(at, quarter) else { break };
        at = next;
        let turns: Vec<i32> =
            [0, 1, -1].into_iter().filter(|turn| grid.step(at, turned(quarter, *turn)).is_some()).collect();
        let turn = turns.get((random.uniform() * turns.len() as f64) as usize).copied().unwrap_or(0);
        let is_last = edge + 1 == EDGES;
        let gives = if turn == 0 || is_last { 0.0 } else { grid.radius };
        let length = grid.pitch[quarter % 2] - taken - gives;
        if edge == EDGES / 2 {
            // It stops in the middle, reverses, and goes on.
            segments.push(PathSegment::straight(0.5 * length));
            legs.push(Leg { direction: Direction::Forward, segments: std::mem::take(&mut segments) });
            legs.push(reversed());
            segments.push(PathSegment::straight(0.5 * length + REVERSED));
        } else {
            segments.push(PathSegment::straight(length));
        }
        taken = gives;
        if gives > 0.0 {
            segments.push(PathSegment::arc(grid.radius, f64::from(turn) * FRAC_PI_2));
            quarter = turned(quarter, turn);
        }
    }
    legs.push(Leg { direction: Direction::Forward, segments });
    legs.push(reversed());
    let node = grid.node(start);
    PathOptions { kind: PathKind::Legs, start: PoseOptions { x: node.x, y: node.y, heading_deg: 0.0 }, legs }
}

fn reversed() -> Leg {
    Leg { direction: Direction::Backward, segments: vec![PathSegment::straight(REVERSED)] }
}

fn turned(quarter: usize, turn: i32) -> usize {
    (quarter as i32 + turn).rem_euclid(4) as usize
}

/// Draws a hall.
pub(super) fn draw(seed: u64) -> Hall {
    let sketch = sketch(seed);
    let mut random = Random::new(seed, Stream::World);
    let grid = Grid::draw(sketch, &mut random);
    let path = walk(&grid, &mut random);
    let [length, width] = grid.size();
    let mut shapes = Shapes { walls: Shapes::hall([0.0, 0.0], [length, width]), ..Shapes::default() };
    let mut scenario = Scenario { path, ..empty(seed, random.between(1.0, 1.6)) };
    let way = poses(&scenario.build_path());
    match sketch {
        Sketch::Grid => grid_of_racks(&grid, &mut shapes, &mut random, None),
        Sketch::Periodic => {
            let pitch = random.between(3.5, 6.0);
            grid_of_racks(&grid, &mut shapes, &mut random, Some(pitch));
        }
        Sketch::ThreeInSight => three_in_sight(&grid, &way, &mut shapes, &mut random),
        Sketch::OneLine => {
            let mut x = random.between(0.5, 3.0);
            while x < length - 0.3 {
                add(&mut shapes, x, width - PROUD);
                x += random.between(2.5, 5.5);
            }
        }
        Sketch::Far => {
            scenario.reflectors.farthest = 50.0;
            along_walls(&grid, &mut shapes, &mut random, [6.0, 11.0]);
            shapes.reflectors.iter_mut().for_each(|reflector| reflector.farthest = 50.0);
        }
        Sketch::Fast => {
            (scenario.drive.speed, scenario.drive.acceleration, scenario.drive.braking) = (2.5, 0.8, 0.8);
            columns(&grid, &mut shapes, &mut random, 0.8);
            along_walls(&grid, &mut shapes, &mut random, [7.0, 13.0]);
        }
        Sketch::Symmetric => nearly_symmetric(&grid, &mut shapes, &mut random),
    }
    scenario.world = WorldOptions::Shapes(shapes);
    let station = way.last().map_or(Point::zeros(), Pose::position);
    let is_accepted = is_accepted(&scenario, None);
    Hall { scenario, station, bare: None, is_accepted }
}

/// Blocks between the ways, with reflectors at their corners and along them: at random, or at one pitch.
fn grid_of_racks(grid: &Grid, shapes: &mut Shapes, random: &mut Random, pitch: Option<f64>) {
    let [length, width] = grid.block_size();
    for middle in grid.blocks() {
        add_box(shapes, Pose::new(middle.x, middle.y, 0.0), length, width);
        for (sign_x, sign_y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let is_there = pitch.is_none() && random.happens(0.8);
            if is_there {
                add(shapes, middle.x + sign_x * (0.5 * length + PROUD), middle.y + sign_y * (0.5 * width + PROUD));
            }
        }
        for side in [-1.0, 1.0] {
            let mut along = pitch.map_or_else(|| random.between(1.0, 5.0), |pitch| 0.5 * pitch);
            while along < length - 0.3 {
                let x = middle.x - 0.5 * length + along;
                add(shapes, x, middle.y + side * (0.5 * width + PROUD));
                along += pitch.unwrap_or_else(|| random.between(4.0, 8.0));
            }
        }
    }
    along_walls(grid, shapes, random, pitch.map_or([5.0, 10.0], |pitch| [pitch, pitch]));
}

/// Reflectors on all walls, so far apart.
fn along_walls(grid: &Grid, shapes: &mut Shapes, random: &mut Random, [least, most]: [f64; 2]) {
    let [length, width] = grid.size();
    for (extent, is_long) in [(length, true), (width, false)] {
        for is_far in [false, true] {
            let mut along = random.between(0.5, most);
            while along < extent - 0.3 {
                match (is_long, is_far) {
                    (true, false) => add(shapes, along, PROUD),
                    (true, true) => add(shapes, along, width - PROUD),
                    (false, false) => add(shapes, PROUD, along),
                    (false, true) => add(shapes, length - PROUD, along),
                }
                along += random.between(least, most);
            }
        }
    }
}

const COLUMN: f64 = 0.4;

/// Columns between the ways, with a reflector on that share of them.
fn columns(grid: &Grid, shapes: &mut Shapes, random: &mut Random, share: f64) {
    for middle in grid.blocks() {
        let offset = Point::new(random.between(-1.5, 1.5), random.between(-1.5, 1.5));
        let place = middle + offset;
        add_box(shapes, Pose::new(place.x, place.y, 0.0), COLUMN, COLUMN);
        if random.happens(share) {
            add(shapes, place.x, place.y + 0.5 * COLUMN + PROUD);
        }
    }
}

/// How far reflectors are seen where three are in sight, m.
const NEAR: f64 = 10.0;
const FEWEST: usize = 3;

/// Just so many reflectors, between the ways and on the walls, that three are in sight along the way.
fn three_in_sight(grid: &Grid, way: &[Pose], shapes: &mut Shapes, random: &mut Random) {
    let mut all = Shapes::default();
    along_walls(grid, &mut all, random, [1.0, 3.0]);
    let on_walls = all.reflectors.iter().map(|reflector| Point::new(reflector.x, reflector.y));
    let scattered = grid.blocks().into_iter().flat_map(|middle| {
        let [length, width] = grid.block_size().map(|size| 0.4 * size);
        [0; 4].map(|_| middle + Point::new(random.between(-length, length), random.between(-width, width)))
    });
    let candidates: Vec<Point> = on_walls.chain(scattered).collect();
    // The laser stands before the middle of the rear axle, whose way this is.
    let reach = NEAR - 1.5;
    let sees = |pose: &Pose, place: &Point| (place - pose.position()).norm() < reach;
    let mut chosen: Vec<Point> = Vec::new();
    for pose in way {
        while chosen.iter().filter(|place| sees(pose, place)).count() < FEWEST {
            // The one that is seen most from where too few are, and least from where enough are.
            let count = |pose: &Pose| chosen.iter().filter(|other| sees(pose, other)).count();
            let worth = |place: &Point| {
                let seen = way.iter().filter(|pose| sees(pose, place));
                seen.map(|pose| if count(pose) < FEWEST { 1 } else { -1 }).sum::<i32>()
            };
            let free = candidates
                .iter()
                .filter(|place| sees(pose, place) && chosen.iter().all(|other| (*place - other).norm() > 1.0));
            let Some(best) = free.max_by_key(|place| worth(place)) else { break };
            chosen.push(*best);
        }
    }
    // What was chosen for one part of the way may be seen from another one, too.
    for place in chosen.clone() {
        let is_needed =
            |pose: &Pose| sees(pose, &place) && chosen.iter().filter(|other| sees(pose, other)).count() <= FEWEST;
        if !way.iter().any(is_needed) {
            chosen.retain(|other| *other != place);
        }
    }
    for place in chosen {
        add(shapes, place.x, place.y);
        if let Some(added) = shapes.reflectors.last_mut() {
            *added = ReflectorShape { farthest: NEAR, ..*added };
        }
    }
}

/// Reflectors on walls and columns, and the same ones turned by half a circle about the middle; one to three others.
fn nearly_symmetric(grid: &Grid, shapes: &mut Shapes, random: &mut Random) {
    let [length, width] = grid.size();
    let mut half = Shapes::default();
    along_walls(grid, &mut half, random, [6.0, 12.0]);
    half.reflectors.truncate(half.reflectors.len() / 2);
    for reflector in half.reflectors {
        add(shapes, reflector.x, reflector.y);
        add(shapes, length - reflector.x, width - reflector.y);
    }
    let blocks = grid.blocks();
    for middle in &blocks {
        add_box(shapes, Pose::new(middle.x, middle.y, 0.0), COLUMN, COLUMN);
    }
    let odd = 1 + (random.uniform() * 3.0) as usize;
    for _ in 0..odd {
        let block = (random.uniform() * blocks.len() as f64) as usize;
        if let Some(middle) = blocks.get(block) {
            add(shapes, middle.x + random.between(0.5, 1.5), middle.y + random.between(0.5, 1.5));
        }
    }
}
