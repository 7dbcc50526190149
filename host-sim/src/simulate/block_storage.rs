//! The standard block storage: a lane between stacked pallets, the aisle before it, and the paths into it.
//!
//! The lane's axis is the first axis of W; its mouth is at x = 0, its end at x = 10 m. The aisle runs along the second
//! axis between the opposite block (x = -8 m) and the mouth. Dimensions are those of the project's feasibility study.

use std::f64::consts::{FRAC_PI_2, PI};

use agv_core::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

use super::path::{Direction, Leg, Path, PathSegment};
use super::random::{Random, Stream};
use super::shape::{Circle, Pallet, Rectangle, Reflector};
use super::world::World;

/// Where the aisle and the lane have reflectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReflectorPlacement {
    /// Nowhere.
    #[default]
    None,
    /// On columns, hall walls, machine, and posts at the lane's mouth and beside the opposite block: many are seen from
    /// the aisle, one or two from the first metres of the lane, none from its end.
    Aisle,
    /// In the aisle, and in line with the lane: at its end, and on the opposite block, where they are seen all the way.
    AisleAndLaneEnd,
}

/// What differs between block storages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BlockStorage {
    /// Seed of dimensions and positions; the scenario's seed if absent.
    pub seed: Option<u64>,
    /// Where the reflectors are.
    pub reflectors: ReflectorPlacement,
    /// Share of the pallets that have been moved, 0 to 1. The scenario's seed says which.
    pub moved_share: f64,
    /// How far they have been moved, m, each in a direction of its own.
    pub moved_by: f64,
}

/// A way through the block storage. P1 to P4 have the lengths of K table 5.6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BlockStoragePath {
    /// 12 m straight: 4 m of aisle, 8 m of lane.
    P1,
    /// 12 m: along the aisle, a right-angled turn to the right of 2.5 m radius, 7 m straight, 6 m of them in the lane.
    P2,
    /// 12 m: 0.5 m straight, an S-bend (4 m radius, 30 degrees there and back), 7.3 m straight, 6.3 m of them in the lane.
    P3,
    /// 7 m straight, all in the lane.
    P4,
    /// A drive for mapping on another way: into the lane 12 cm beside its axis, back on its other side, out into the
    /// aisle with a turn, and along the aisle there and back. 34 m.
    Mapping,
}

const LANE_DEPTH: f64 = 10.0;
const ROWS: usize = 3;
const AISLE_WIDTH: f64 = 8.0;
const PALLET_LENGTH: f64 = 1.2;
const PALLET_DEPTH: f64 = 1.0;
const GAP: (f64, f64) = (0.05, 0.15);
const FACE_OFFSET: f64 = 0.03;
const PALLET_YAW_DEG: f64 = 0.6;
const BOARD_OFFSET: f64 = 0.01;
const REFLECTOR_RADIUS: f64 = 0.04;
const REFLECTOR_FARTHEST: f64 = 30.0;
const HALL_LOW: (f64, f64) = (-16.0, -14.0);
const HALL_HIGH: (f64, f64) = (15.0, 14.0);

impl BlockStorage {
    /// Builds the storage. `seed` is the scenario's.
    #[must_use]
    pub fn world(&self, seed: u64) -> World {
        self.level(seed, true)
    }

    /// The storage at the height of its pallets, or above them.
    #[must_use]
    pub fn level(&self, seed: u64, has_pallets: bool) -> World {
        let mut random = Random::new(self.seed.unwrap_or(seed), Stream::World);
        let half_lane = 0.5 * random.between(2.0, 2.4);
        let mut pallets = lane_sides(half_lane, &mut random);
        pallets.extend(across(LANE_DEPTH + random.between(GAP.0, GAP.1), 1.0, 4.2, &mut random));
        let mut opposite = -AISLE_WIDTH;
        for _ in 0..ROWS {
            pallets.extend(across(opposite, -1.0, 6.2, &mut random));
            opposite -= PALLET_DEPTH + random.between(GAP.0, GAP.1);
        }
        let columns = columns(&mut random);
        let machine = Rectangle {
            pose: Pose::new(
                random.between(-4.8, -4.2),
                random.between(7.8, 8.2),
                random.between(-3.0, 3.0).to_radians(),
            ),
            length: 2.4,
            width: 1.6,
        };

        let mut world = World::default();
        world.add_hall(Point::new(HALL_LOW.0, HALL_LOW.1), Point::new(HALL_HIGH.0, HALL_HIGH.1));
        let mut moves = Random::new(seed, Stream::MovedPallets);
        for pallet in &mut pallets {
            self.move_pallet(pallet, &mut moves);
            if has_pallets {
                world.add_pallet(pallet);
            }
        }
        for rectangle in columns.iter().chain([&machine]) {
            world.add_rectangle(rectangle);
        }
        if self.reflectors != ReflectorPlacement::None {
            aisle_reflectors(&mut world, half_lane, &columns, &machine);
        }
        if self.reflectors == ReflectorPlacement::AisleAndLaneEnd {
            let end = LANE_DEPTH - 0.1;
            for (x, y) in [(end, -0.55), (end, 0.2), (end, 0.75), (-7.7, 0.6), (-7.7, -0.5)] {
                add_reflector(&mut world, Point::new(x, y));
            }
        }
        world
    }

    fn move_pallet(&self, pallet: &mut Pallet, random: &mut Random) {
        let is_moved = random.happens(self.moved_share);
        let (sine, cosine) = libm::sincos(random.between(-PI, PI));
        if is_moved {
            pallet.outline.pose.x += self.moved_by * cosine;
            pallet.outline.pose.y += self.moved_by * sine;
        }
    }
}

fn pallet(centre: Point, heading: f64, random: &mut Random) -> Pallet {
    let yaw = random.between(-PALLET_YAW_DEG, PALLET_YAW_DEG).to_radians();
    let boards = [[0.0; 3]; 4].map(|face| face.map(|_: f64| random.between(-BOARD_OFFSET, BOARD_OFFSET)));
    let pose = Pose::new(centre.x, centre.y, heading + yaw);
    Pallet { outline: Rectangle { pose, length: PALLET_LENGTH, width: PALLET_DEPTH }, boards }
}

fn lane_sides(half_lane: f64, random: &mut Random) -> Vec<Pallet> {
    let mut pallets = Vec::new();
    for side in [-1.0, 1.0] {
        let mut face = half_lane;
        for _ in 0..ROWS {
            let mut start = 0.0;
            while start + PALLET_LENGTH <= LANE_DEPTH {
                let depth = face + random.between(-FACE_OFFSET, FACE_OFFSET) + 0.5 * PALLET_DEPTH;
                pallets.push(pallet(Point::new(start + 0.5 * PALLET_LENGTH, side * depth), 0.0, random));
                start += PALLET_LENGTH + random.between(GAP.0, GAP.1);
            }
            face += PALLET_DEPTH + random.between(GAP.0, GAP.1);
        }
    }
    pallets
}

/// A row across the lane's direction that shows its face at `face` and stands behind it in the sense of `side`.
fn across(face: f64, side: f64, half_width: f64, random: &mut Random) -> Vec<Pallet> {
    let mut pallets = Vec::new();
    let mut start = -half_width + random.between(-0.3, 0.3);
    while start < half_width {
        let depth = face + random.between(-FACE_OFFSET, FACE_OFFSET) + side * 0.5 * PALLET_DEPTH;
        pallets.push(pallet(Point::new(depth, start + 0.5 * PALLET_LENGTH), FRAC_PI_2, random));
        start += PALLET_LENGTH + random.between(GAP.0, GAP.1);
    }
    pallets
}

fn columns(random: &mut Random) -> [Rectangle; 3] {
    [(-0.8, 5.4), (-0.8, -5.4), (-6.6, -6.0)].map(|(x, y)| Rectangle {
        pose: Pose::new(
            x + random.between(-0.1, 0.1),
            y + random.between(-0.1, 0.1),
            random.between(-1.0, 1.0).to_radians(),
        ),
        length: 0.4,
        width: 0.4,
    })
}

/// All of them can be approached from the aisle with a tachymeter, and none stands in a pallet's way.
fn aisle_reflectors(world: &mut World, half_lane: f64, columns: &[Rectangle; 3], machine: &Rectangle) {
    let wall = HALL_HIGH.1 - 1.5 * REFLECTOR_RADIUS;
    for (x, y) in [(-1.3, wall), (-7.1, wall), (-2.2, -wall), (-5.4, -wall)] {
        add_reflector(world, Point::new(x, y));
    }
    let before_face = |rectangle: &Rectangle, along: f64, across: f64| {
        let reach = 1.5 * REFLECTOR_RADIUS;
        let (length, width) = (0.5 * rectangle.length, 0.5 * rectangle.width);
        let outside = |share: f64, half: f64| if share.abs() == 1.0 { share * (half + reach) } else { share * half };
        rectangle.pose.transform(&Point::new(outside(along, length), outside(across, width)))
    };
    for (rectangle, along, across) in [
        (&columns[0], -1.0, 0.2),
        (&columns[1], -1.0, -0.3),
        (&columns[2], 1.0, 0.1),
        (machine, -0.8, -1.0),
        (machine, 0.7, -1.0),
    ] {
        add_reflector(world, before_face(rectangle, along, across));
    }
    for (x, y) in [(-0.25, half_lane + 0.3), (-0.35, -half_lane - 0.45), (-7.7, 3.4), (-7.7, -2.6)] {
        add_reflector(world, Point::new(x, y));
    }
}

fn add_reflector(world: &mut World, centre: Point) {
    let body = Circle { centre, radius: REFLECTOR_RADIUS };
    world.reflectors.push(Reflector { body, farthest: REFLECTOR_FARTHEST, sector: None });
}

impl BlockStoragePath {
    /// The path.
    #[must_use]
    pub fn path(self) -> Path {
        let forward = |segments| Leg { direction: Direction::Forward, segments };
        let backward = |segments| Leg { direction: Direction::Backward, segments };
        let straight = PathSegment::straight;
        match self {
            Self::P1 => Path { start: Pose::new(-4.0, 0.0, 0.0), legs: vec![forward(vec![straight(12.0)])] },
            Self::P2 => {
                let radius = 2.5;
                let before = 5.0 - radius * FRAC_PI_2;
                Path {
                    start: Pose::new(-1.0 - radius, -radius - before, FRAC_PI_2),
                    legs: vec![forward(vec![straight(before), PathSegment::arc(radius, -FRAC_PI_2), straight(7.0)])],
                }
            }
            Self::P3 => {
                let (radius, angle) = (4.0, PI / 6.0);
                let shift = 2.0 * radius * (1.0 - libm::cos(angle));
                Path {
                    start: Pose::new(-5.5, -shift, 0.0),
                    legs: vec![forward(vec![
                        straight(0.5),
                        PathSegment::arc(radius, angle),
                        PathSegment::arc(radius, -angle),
                        straight(11.5 - 2.0 * radius * angle),
                    ])],
                }
            }
            Self::P4 => Path { start: Pose::new(1.0, 0.0, 0.0), legs: vec![forward(vec![straight(7.0)])] },
            Self::Mapping => {
                // Backing through these two arcs shifts the vehicle by 24 cm to the right.
                let (radius, shift) = (6.0, 0.24);
                let angle = libm::acos(1.0 - shift / (2.0 * radius));
                Path {
                    start: Pose::new(-5.0, 0.12, 0.0),
                    legs: vec![
                        forward(vec![straight(13.0)]),
                        backward(vec![
                            straight(4.0),
                            PathSegment::arc(radius, -angle),
                            PathSegment::arc(radius, angle),
                            straight(3.4),
                            PathSegment::arc(2.5, FRAC_PI_2),
                        ]),
                        forward(vec![straight(5.0)]),
                        backward(vec![straight(2.5)]),
                    ],
                }
            }
        }
    }
}
