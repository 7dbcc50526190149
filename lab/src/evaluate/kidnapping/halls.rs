//! Halls with reflectors.

use agv_core::geometry::{Point, Pose};

use super::Layout;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::shape::{Circle, Rectangle, Reflector};
use agv_host_sim::simulate::warehouse_hall::WarehouseHall;
use agv_host_sim::simulate::world::World;

/// A hall and where a vehicle may stand in it.
pub(super) struct Hall {
    pub world: World,
    keep_outs: Vec<Rectangle>,
    size: Point,
}

const SIZE: Point = Point::new(60.0, 40.0);
const REFLECTORS: usize = 60;
const LARGE_SIZE: Point = Point::new(200.0, 120.0);
const LARGE_REFLECTORS: usize = 1000;
const REFLECTOR_RADIUS: f64 = 0.04;
/// A vehicle keeps this distance from racks and walls, m.
const CLEARANCE: f64 = 0.8;
const RACK_DEPTH: f64 = 2.3;

impl Hall {
    pub(super) fn new(layout: Layout, seed: u64) -> Self {
        let mut random = Random::new(seed, Stream::World);
        match layout {
            Layout::Warehouse | Layout::TwinHall => warehouse(seed, &mut random),
            Layout::Symmetric => symmetric(&mut random),
            Layout::Regular(deviation) => regular(deviation, &mut random),
        }
    }

    /// Positions of the reflectors in W, m.
    pub(super) fn positions(&self) -> Vec<Point> {
        self.world.reflectors.iter().map(|reflector| reflector.body.centre).collect()
    }

    /// A pose where a vehicle has room.
    pub(super) fn free_pose(&self, random: &mut Random) -> Pose {
        loop {
            let x = random.between(CLEARANCE, self.size.x - CLEARANCE);
            let y = random.between(CLEARANCE, self.size.y - CLEARANCE);
            let heading = random.between(-std::f64::consts::PI, std::f64::consts::PI);
            let is_free = self.keep_outs.iter().all(|rack| {
                (x - rack.pose.x).abs() > 0.5 * rack.length + CLEARANCE
                    || (y - rack.pose.y).abs() > 0.5 * rack.width + CLEARANCE
            });
            if is_free {
                return Pose::new(x, y, heading);
            }
        }
    }
}

fn reflector(centre: Point) -> Reflector {
    Reflector { body: Circle { centre, radius: REFLECTOR_RADIUS }, farthest: f64::INFINITY, sector: None }
}

/// Keeps that many, at random.
fn thin_out<T>(items: &mut Vec<T>, count: usize, random: &mut Random) {
    while items.len() > count {
        let victim = (random.uniform() * items.len() as f64) as usize;
        items.swap_remove(victim);
    }
}

fn warehouse(seed: u64, random: &mut Random) -> Hall {
    let mut world = WarehouseHall { seed: Some(seed), ..WarehouseHall::default() }.world(seed);
    thin_out(&mut world.reflectors, REFLECTORS, random);
    Hall { world, keep_outs: WarehouseHall::keep_outs(), size: SIZE }
}

/// A hall of closed racks along its first axis, with the sites of reflectors on rack faces, ends and walls.
fn closed_racks(
    size: Point,
    axes: usize,
    rack_length: f64,
    blocks: usize,
    spacing: f64,
) -> (World, Vec<Rectangle>, Vec<Point>) {
    let mut world = World::default();
    world.add_hall(Point::zeros(), size);
    let (mut racks, mut sites) = (Vec::new(), Vec::new());
    let off = 1.5 * REFLECTOR_RADIUS;
    for axis in 0..axes {
        for block in 0..blocks {
            let x = size.x * (block as f64 + 0.5) / blocks as f64;
            let y = size.y * (axis as f64 + 0.5) / axes as f64;
            let rack = Rectangle { pose: Pose::new(x, y, 0.0), length: rack_length, width: RACK_DEPTH };
            world.add_rectangle(&rack);
            racks.push(rack);
            let steps = (rack_length / spacing) as usize;
            for step in 0..=steps {
                let along = x - 0.5 * rack_length + rack_length * step as f64 / steps as f64;
                for side in [-1.0, 1.0] {
                    sites.push(Point::new(along, y + side * (0.5 * RACK_DEPTH + off)));
                }
            }
        }
    }
    let mut walls = |length: f64, place: &dyn Fn(f64) -> [Point; 2]| {
        let steps = (length / spacing) as usize;
        for step in 0..steps {
            sites.extend(place(length * (step as f64 + 0.5) / steps as f64));
        }
    };
    walls(size.x, &|way| [Point::new(way, off), Point::new(way, size.y - off)]);
    walls(size.y, &|way| [Point::new(off, way), Point::new(size.x - off, way)]);
    (world, racks, sites)
}

fn symmetric(random: &mut Random) -> Hall {
    let (mut world, racks, sites) = closed_racks(SIZE, 4, 30.0, 1, 2.5);
    let mut half: Vec<_> = sites.into_iter().filter(|site| site.y < 0.5 * SIZE.y).collect();
    thin_out(&mut half, REFLECTORS / 2, random);
    for site in half {
        let moved = site + Point::new(random.between(-0.5, 0.5), 0.0);
        world.reflectors.push(reflector(moved));
        world.reflectors.push(reflector(SIZE - moved));
    }
    Hall { world, keep_outs: racks, size: SIZE }
}

fn regular(deviation: f64, random: &mut Random) -> Hall {
    let (mut world, racks, mut sites) = closed_racks(LARGE_SIZE, 12, 58.0, 3, 4.0);
    thin_out(&mut sites, LARGE_REFLECTORS, random);
    for site in sites {
        // A reflector stays in front of what carries it.
        let moved = site + Point::new(deviation * random.normal(), 0.0);
        let inside = REFLECTOR_RADIUS * 1.1;
        let moved = Point::new(moved.x.clamp(inside, LARGE_SIZE.x - inside), moved.y);
        world.reflectors.push(reflector(moved));
    }
    Hall { world, keep_outs: racks, size: LARGE_SIZE }
}
