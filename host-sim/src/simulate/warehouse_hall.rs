//! A hall of 60 x 40 m with double racks, a column grid and reflectors, and a loop through two of its aisles.
//!
//! W starts in a corner of the hall; the racks run along its first axis.

use std::f64::consts::FRAC_PI_2;

use agv_core::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

use super::path::{Direction, Leg, Path, PathSegment};
use super::random::{Random, Stream};
use super::shape::{Circle, Rectangle, Reflector};
use super::world::World;

/// What differs between halls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WarehouseHall {
    /// Seed of dimensions and positions; the scenario's seed if absent.
    pub seed: Option<u64>,
    /// Whether there are reflectors.
    pub reflectors: bool,
    /// Share of the racks' places that are taken, 0 to 1.
    pub filled_share: f64,
}

impl Default for WarehouseHall {
    fn default() -> Self {
        Self { seed: None, reflectors: true, filled_share: 0.8 }
    }
}

/// A height in the hall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// That of a planar laser.
    Laser,
    /// Where racks have goods of their own, by number.
    Goods(u8),
    /// Between goods: uprights alone.
    Beams,
}

const LENGTH: f64 = 60.0;
const WIDTH: f64 = 40.0;
const RACK_START: f64 = 14.0;
const RACK_AXES: [f64; 4] = [8.0, 16.0, 24.0, 32.0];
const BAYS: usize = 11;
const BAY: f64 = 2.75;
/// From a double rack's axis to its faces.
const RACK_HALF_DEPTH: f64 = 1.15;
const UPRIGHT: f64 = 0.1;
const COLUMN: f64 = 0.4;
/// Columns stand this far beside their grid at most, m.
const COLUMN_SHIFT: f64 = 0.1;
const REFLECTOR_RADIUS: f64 = 0.04;
const REFLECTOR_FARTHEST: f64 = 30.0;
const WALL_SPACING: f64 = 7.0;
const TURN_RADIUS: f64 = 2.5;

impl WarehouseHall {
    /// Builds the hall. `seed` is the scenario's.
    #[must_use]
    pub fn world(&self, seed: u64) -> World {
        self.level(seed, Level::Laser)
    }

    /// The hall at some height.
    #[must_use]
    pub fn level(&self, seed: u64, level: Level) -> World {
        let seed = self.seed.unwrap_or(seed);
        let mut random = Random::new(seed, Stream::World);
        let mut goods = match level {
            Level::Laser | Level::Beams => None,
            Level::Goods(number) => Some(Random::new(seed ^ (u64::from(number) + 1) << 48, Stream::World)),
        };
        let mut world = World::default();
        world.add_hall(Point::zeros(), Point::new(LENGTH, WIDTH));
        for axis in RACK_AXES {
            for side in [-1.0, 1.0] {
                let goods = (level != Level::Beams).then_some(goods.as_mut());
                self.add_rack_side(&mut world, axis, side, &mut random, goods);
            }
        }
        for (x, y) in columns() {
            let pose = Pose::new(x, y + random.between(-COLUMN_SHIFT, COLUMN_SHIFT), 0.0);
            world.add_rectangle(&Rectangle { pose, length: COLUMN, width: COLUMN });
            let reflector = pose.position() + Point::new(0.0, 0.5 * COLUMN + 1.5 * REFLECTOR_RADIUS);
            self.add_reflector(&mut world, reflector);
        }
        self.add_wall_reflectors(&mut world, &mut random);
        world
    }

    /// Where no vehicle can stand: outlines of the double racks, filled or not, and of the columns wherever they are put.
    #[must_use]
    pub fn keep_outs() -> Vec<Rectangle> {
        let length = BAYS as f64 * BAY;
        let rack = |axis| Rectangle {
            pose: Pose::new(RACK_START + 0.5 * length, axis, 0.0),
            length,
            width: 2.0 * RACK_HALF_DEPTH,
        };
        let column =
            |(x, y)| Rectangle { pose: Pose::new(x, y, 0.0), length: COLUMN, width: COLUMN + 2.0 * COLUMN_SHIFT };
        RACK_AXES.into_iter().map(rack).chain(columns().map(column)).collect()
    }

    /// `goods` draws what lies in the rack: None for nothing, Some(None) as for the plane of the laser.
    fn add_rack_side(
        &self,
        world: &mut World,
        axis: f64,
        side: f64,
        random: &mut Random,
        mut goods: Option<Option<&mut Random>>,
    ) {
        let face = axis + side * RACK_HALF_DEPTH;
        for bay in 0..=BAYS {
            let x = RACK_START + bay as f64 * BAY;
            let pose = Pose::new(x, face - side * 0.5 * UPRIGHT, 0.0);
            world.add_rectangle(&Rectangle { pose, length: UPRIGHT, width: UPRIGHT });
            let has_reflector = random.happens(0.25) || bay == 0 || bay == BAYS;
            if has_reflector {
                self.add_reflector(world, Point::new(x, face + side * 1.5 * REFLECTOR_RADIUS));
            }
            if bay == BAYS {
                break;
            }
            for place in [0.28, 0.72] {
                let good = |random: &mut Random| {
                    let is_filled = random.happens(self.filled_share);
                    let yaw = random.between(-0.8, 0.8).to_radians();
                    let x = x + place * BAY + random.between(-0.04, 0.04);
                    let y = face - side * (0.56 + random.between(0.0, 0.05));
                    is_filled.then(|| Rectangle { pose: Pose::new(x, y, yaw), length: 0.8, width: 1.0 })
                };
                let in_plane = good(random);
                let good = match &mut goods {
                    None => None,
                    Some(None) => in_plane,
                    Some(Some(random)) => good(random),
                };
                if let Some(good) = good {
                    world.add_rectangle(&good);
                }
            }
        }
    }

    fn add_wall_reflectors(&self, world: &mut World, random: &mut Random) {
        let inset = 1.5 * REFLECTOR_RADIUS;
        let mut way = 0.5 * WALL_SPACING;
        while way < LENGTH - 1.0 {
            for y in [inset, WIDTH - inset] {
                self.add_reflector(world, Point::new(way + random.between(-1.5, 1.5), y));
            }
            way += WALL_SPACING;
        }
        way = 0.5 * WALL_SPACING;
        while way < WIDTH - 1.0 {
            for x in [inset, LENGTH - inset] {
                self.add_reflector(world, Point::new(x, way + random.between(-1.5, 1.5)));
            }
            way += WALL_SPACING;
        }
    }

    fn add_reflector(&self, world: &mut World, centre: Point) {
        if self.reflectors {
            let body = Circle { centre, radius: REFLECTOR_RADIUS };
            world.reflectors.push(Reflector { body, farthest: REFLECTOR_FARTHEST, sector: None });
        }
    }
}

/// Grid of the columns, W, m.
fn columns() -> impl Iterator<Item = (f64, f64)> {
    [7.0, 53.0].into_iter().flat_map(|x| [4.0, 16.0, 24.0, 36.0].map(|y| (x, y)))
}

/// Once round the second rack, 90 m, counter-clockwise.
#[must_use]
pub fn loop_path() -> Path {
    let turn = PathSegment::arc(TURN_RADIUS, FRAC_PI_2);
    let long = PathSegment::straight(34.0);
    let short = PathSegment::straight(8.0 - 2.0 * TURN_RADIUS);
    Path {
        start: Pose::new(12.0, 12.0, 0.0),
        legs: vec![Leg {
            direction: Direction::Forward,
            segments: vec![long, turn, short, turn, long, turn, short, turn],
        }],
    }
}
