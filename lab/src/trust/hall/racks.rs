//! Halls of three aisles between racks: size, racks, spacing of the reflectors, near-symmetry, clutter.
//!
//! A vehicle drives through three aisles with bends to both sides. In the middle one no reflector is in sight for about 10 m:
//! its flat reflectors, at both ends, are seen from in front of them only. In the third one it
//! stops, reverses and stands; then it docks at a station on the wall, stands, and reverses out.

use std::f64::consts::FRAC_PI_2;

use agv_core::geometry::{Point, Pose};
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{PathKind, PathOptions, PoseOptions, Scenario, Shapes, WorldOptions};

use super::shapes::{PROUD, add, add_box, add_flat};
use super::{Hall, empty, is_accepted};

/// From the middle of the middle aisle to the first reflector, m; one on a rack is seen from 2 m before it.
const HALF_BARE: f64 = 6.8;
const RACK_DEPTH: f64 = 2.2;
const BAY: f64 = 2.75;
const UPRIGHT: f64 = 0.1;
const ROWS: usize = 4;

/// The sizes of a hall.
struct Plan {
    /// First and last end of the racks.
    racks: (f64, f64),
    bays: usize,
    /// Axis of the first rack, and from one to the next.
    first_row: f64,
    pitch: f64,
    length: f64,
    width: f64,
}

impl Plan {
    fn draw(random: &mut Random) -> Self {
        let bays = 5 + (random.uniform() * 4.0) as usize;
        let start = random.between(8.0, 11.0);
        let end = start + bays as f64 * BAY;
        let (first_row, pitch) = (random.between(5.0, 8.0), RACK_DEPTH + random.between(3.6, 5.2));
        let width = first_row + (ROWS - 1) as f64 * pitch + random.between(7.0, 10.0);
        Self { racks: (start, end), bays, first_row, pitch, length: end + random.between(8.5, 13.0), width }
    }

    fn row(&self, row: usize) -> f64 {
        self.first_row + row as f64 * self.pitch
    }

    /// Middle of the aisle above that row.
    fn aisle(&self, row: usize) -> f64 {
        self.row(row) + 0.5 * self.pitch
    }

    /// Whether something at that height belongs to the middle aisle.
    fn is_middle(&self, y: f64) -> bool {
        (y - self.aisle(1)).abs() < 0.5 * self.pitch
    }

    /// Middle of the aisles.
    fn middle(&self) -> f64 {
        0.5 * (self.racks.0 + self.racks.1)
    }
}

/// Draws a hall.
#[must_use]
pub fn draw(seed: u64) -> Hall {
    let mut random = Random::new(seed, Stream::World);
    let plan = Plan::draw(&mut random);
    let mut shapes = Shapes { walls: Shapes::hall([0.0, 0.0], [plan.length, plan.width]), ..Shapes::default() };
    add_racks(&plan, &mut shapes, &mut random);
    add_wall_reflectors(&plan, &mut shapes, &mut random);
    add_clutter(&plan, &mut shapes, &mut random);
    let station = Point::new(plan.racks.1 + 3.0, plan.width - random.between(1.6, 2.2));
    for offset in [-2.4, -0.9, 0.8, 2.6] {
        add(&mut shapes, station.x + offset + random.between(-0.2, 0.2), plan.width - PROUD);
    }
    let path = path(&plan, station);
    let speed = random.between(1.0, 1.6);
    let scenario = Scenario { world: WorldOptions::Shapes(shapes), path, ..empty(seed, speed) };
    let bare =
        [-1.0, 1.0].map(|side| Point::new(plan.middle() + side * HALF_BARE, plan.aisle(1) + side * 0.5 * plan.pitch));
    let is_accepted = is_accepted(&scenario, Some(&bare));
    Hall { scenario, station, bare: Some(bare), is_accepted }
}

fn add_racks(plan: &Plan, shapes: &mut Shapes, random: &mut Random) {
    let (filled, reflected) = (random.between(0.4, 0.95), random.between(0.1, 0.45));
    for row in 0..ROWS {
        for side in [-1.0, 1.0] {
            let face = plan.row(row) + side * 0.5 * RACK_DEPTH;
            for bay in 0..=plan.bays {
                let x = plan.racks.0 + bay as f64 * BAY;
                add_box(shapes, Pose::new(x, face - side * 0.5 * UPRIGHT, 0.0), UPRIGHT, UPRIGHT);
                let is_end = bay == 0 || bay == plan.bays;
                let has_reflector = random.happens(if is_end { 0.9 } else { reflected });
                let y = face + side * PROUD;
                if plan.is_middle(y) {
                    if (x - plan.middle()).abs() > HALF_BARE {
                        add_flat(shapes, x, y, 90.0 * side);
                    }
                } else if has_reflector {
                    add(shapes, x, y);
                }
                for place in [0.28, 0.72] {
                    let is_filled = random.happens(filled);
                    let yaw = random.between(-0.8, 0.8).to_radians();
                    let (x, depth) = (x + place * BAY + random.between(-0.05, 0.05), random.between(0.5, 0.56));
                    if is_filled && bay < plan.bays {
                        add_box(shapes, Pose::new(x, face - side * depth, yaw), 0.8, 0.9);
                    }
                }
            }
        }
    }
}

/// Reflectors on the walls; in three halls of ten those of one side are nearly those of the other, turned by half a circle.
fn add_wall_reflectors(plan: &Plan, shapes: &mut Shapes, random: &mut Random) {
    let spacing = random.between(4.0, 9.0);
    let twin = random.happens(0.3).then(|| random.between(0.05, 0.8));
    let along = |random: &mut Random, length: f64| {
        let mut places = Vec::new();
        let mut place = random.between(0.3, 1.0) * spacing;
        while place < length - 0.5 {
            places.push(place);
            place += spacing * random.between(0.6, 1.4);
        }
        places
    };
    for (extent, is_long) in [(plan.length, true), (plan.width, false)] {
        let first = along(random, extent);
        let second: Vec<f64> = match twin {
            Some(shift) => first.iter().rev().map(|place| extent - place + random.between(-shift, shift)).collect(),
            None => along(random, extent),
        };
        for (places, is_far) in [(first, false), (second, true)] {
            for place in places.into_iter().filter(|place| (0.3..extent - 0.3).contains(place)) {
                match (is_long, is_far) {
                    (true, false) => add(shapes, place, PROUD),
                    (true, true) => add(shapes, place, plan.width - PROUD),
                    (false, _) if plan.is_middle(place) => {}
                    (false, false) => add(shapes, PROUD, place),
                    (false, true) => add(shapes, plan.length - PROUD, place),
                }
            }
        }
    }
}

/// Boxes along the lower wall and columns in the corners, with a reflector on some.
fn add_clutter(plan: &Plan, shapes: &mut Shapes, random: &mut Random) {
    for _ in 0..(random.uniform() * 12.0) as usize {
        let (x, length) = (random.between(2.0, plan.length - 2.0), random.between(0.4, 1.6));
        let (width, yaw) = (random.between(0.4, 1.0), random.between(-0.3, 0.3));
        add_box(shapes, Pose::new(x, 0.6, yaw), length, width);
        if random.happens(0.2) {
            add(shapes, x, 0.6 + 0.5 * width.hypot(length) + PROUD);
        }
    }
    for (x, y) in [(3.0, 2.5), (plan.length - 3.0, 2.5), (3.0, plan.width - 3.0)] {
        add_box(shapes, Pose::new(x, y, 0.0), 0.4, 0.4);
        if random.happens(0.7) {
            add(shapes, x, y + 0.2 + PROUD);
        }
    }
}

fn path(plan: &Plan, station: Point) -> PathOptions {
    let radius = (0.5 * plan.pitch - 0.3).min(2.6);
    let (before, behind) = (plan.racks.0 - 3.0, plan.racks.1 + 3.0);
    let (left, right) = (PathSegment::arc(radius, FRAC_PI_2), PathSegment::arc(radius, -FRAC_PI_2));
    let across = PathSegment::straight(plan.pitch - 2.0 * radius);
    let aisle = PathSegment::straight(behind - before);
    let into = 0.55 * (behind - before);
    // From the third aisle to the wall with the station; the last bend ends `radius` above the aisle.
    let to_station = station.y - plan.aisle(2) - radius;
    let forward = |segments: Vec<PathSegment>| Leg { direction: Direction::Forward, segments };
    let backward = |length| Leg { direction: Direction::Backward, segments: vec![PathSegment::straight(length)] };
    PathOptions {
        kind: PathKind::Legs,
        start: PoseOptions { x: before, y: plan.aisle(0), heading_deg: 0.0 },
        legs: vec![
            forward(vec![aisle, left, across, left, aisle, right, across, right, PathSegment::straight(into)]),
            backward(4.0),
            forward(vec![
                PathSegment::straight(behind - before - into + 4.0 - radius),
                left,
                PathSegment::straight(to_station),
            ]),
            backward(3.0),
        ],
    }
}
