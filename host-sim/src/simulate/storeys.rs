//! What a beam in space meets: worlds that lie above each other, each between two heights, on a level floor.
//!
//! Surfaces are upright. A beam that enters a box through its top ends at its far side.

use agv_core::geometry::Point;

use super::raycast::{RayCaster, Surface};
use super::scenario::{Scenario, WorldOptions};
use super::warehouse_hall::Level;

/// Heights between which reflectors have foil, m.
const FOIL: [f64; 2] = [1.5, 2.5];
/// Levels of a rack: heights between which there are goods, m.
const GOODS: [[f64; 2]; 3] = [[0.15, 1.5], [1.95, 3.3], [3.75, 5.1]];
/// Height of the pallets of a block storage, m.
const PALLETS: f64 = 2.4;
/// Height of a hall, m.
const HALL: f64 = 8.0;

/// A world between two heights, m.
#[derive(Clone, Debug)]
struct Storey {
    low: f64,
    high: f64,
    caster: RayCaster,
}

/// Worlds above each other, from the floor up.
#[derive(Clone, Debug)]
pub struct Storeys(Vec<Storey>);

/// What a beam meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpaceHit {
    /// Along the beam, m.
    pub distance: f64,
    /// What was hit; None for the floor.
    pub surface: Option<Surface>,
}

impl Storeys {
    /// The world of a scenario; of given shapes, all as high as the hall.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let mut heights = vec![0.0, FOIL[0], FOIL[1], HALL];
        match &scenario.world {
            WorldOptions::WarehouseHall(_) => heights.extend(GOODS.as_flattened()),
            WorldOptions::BlockStorage(_) => heights.push(PALLETS),
            WorldOptions::Shapes(_) => {}
        }
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let storey = |pair: &[f64]| {
            let (low, high) = (pair[0], pair[1]);
            let middle = 0.5 * (low + high);
            let is_between = |[low, high]: &[f64; 2]| (*low..*high).contains(&middle);
            let mut world = match &scenario.world {
                WorldOptions::WarehouseHall(hall) => {
                    let number = GOODS.iter().position(is_between);
                    hall.level(scenario.seed, number.map_or(Level::Beams, |number| Level::Goods(number as u8)))
                }
                WorldOptions::BlockStorage(storage) => storage.level(scenario.seed, middle < PALLETS),
                WorldOptions::Shapes(_) => scenario.build_world(),
            };
            if !is_between(&FOIL) {
                world.reflectors.clear();
            }
            Storey { low, high, caster: RayCaster::new(&world) }
        };
        Self(heights.windows(2).map(storey).collect())
    }

    /// The first thing that a beam meets: from a point (x, y, and height above the floor, m) in a direction of length one.
    #[must_use]
    pub fn first_hit(&self, origin: [f64; 3], direction: [f64; 3], farthest: f64) -> Option<SpaceHit> {
        let level = libm::hypot(direction[0], direction[1]);
        if level < 1e-9 {
            return None;
        }
        let ahead = Point::new(direction[0], direction[1]) / level;
        let floor = if direction[2] < 0.0 { -origin[2] / direction[2] } else { f64::INFINITY };
        let end = farthest.min(floor);
        // Along the beam, where it enters a storey and where it leaves it.
        let within = |storey: &Storey| {
            let at = |height: f64| (height - origin[2]) / direction[2];
            match direction[2] {
                0.0 => (storey.low..storey.high).contains(&origin[2]).then_some((0.0, end)),
                up if up > 0.0 => Some((at(storey.low).max(0.0), at(storey.high).min(end))),
                _ => Some((at(storey.high).max(0.0), at(storey.low).min(end))),
            }
            .filter(|(enters, leaves)| enters < leaves)
        };
        let hit = |storey: &Storey| {
            let (enters, leaves) = within(storey)?;
            let from = Point::new(origin[0], origin[1]) + ahead * (enters * level);
            let hit = storey.caster.first_hit(&from, &ahead, (leaves - enters) * level)?;
            Some(SpaceHit { distance: enters + hit.distance / level, surface: Some(hit.surface) })
        };
        let found = if direction[2] >= 0.0 { self.0.iter().find_map(hit) } else { self.0.iter().rev().find_map(hit) };
        found.or((floor <= farthest).then_some(SpaceHit { distance: floor, surface: None }))
    }
}
