//! What stands in these worlds, what of it may be moved, and where a vehicle may be.

use std::f64::consts::{FRAC_PI_2, PI};

use agv_core::geometry::{Point, Pose};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::shape::Rectangle;
use agv_host_sim::simulate::world::World;

/// Kinds of worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SiteKind {
    /// A hall of 44 m x 24 m with four rows of racks on legs of 10 cm; 60 per cent of the places between the legs hold a load.
    Racks,
    /// A hall of 100 m x 60 m: outer walls, columns, two short walls and 24 boxes.
    OpenHall,
    /// A corridor 60 m long and 2.4 m wide with doors in niches at irregular distances, and cupboards.
    Corridor,
    /// A hall of 40 m x 20 m with eight gates, trucks behind half of them, and goods before them. Trucks and goods change.
    Dock,
}

impl SiteKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Racks, Self::OpenHall, Self::Corridor, Self::Dock];

    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Racks => "racks",
            Self::OpenHall => "open hall",
            Self::Corridor => "corridor",
            Self::Dock => "dock",
        }
    }
}

/// A vehicle keeps this distance from all that stands there, m.
const CLEARANCE: f64 = 0.6;

/// What is moved is moved by this much at least and at most, m.
const MOVED: (f64, f64) = (0.05, 0.5);

/// What is moved is turned by this much at most, rad.
const TURNED: f64 = 5.0 * PI / 180.0;

/// Share of the trucks of a dock that have come or gone.
const TRUCKS_CHANGED: f64 = 0.5;

/// Boxes that are moved as one: a load, or a rack with its legs.
type Group = Vec<Rectangle>;

/// One world.
#[derive(Clone, Debug)]
pub(super) struct Site {
    walls: Vec<(Point, Point)>,
    /// What may be moved.
    groups: Vec<Group>,
    /// Trucks, and whether they are there.
    trucks: Vec<(Rectangle, bool)>,
    /// Where a vehicle may be: opposite corners, m.
    floor: (Point, Point),
}

impl Site {
    /// A world of a kind.
    pub(super) fn new(kind: SiteKind, seed: u64) -> Self {
        let mut random = Random::new(seed, Stream::World);
        match kind {
            SiteKind::Racks => racks(&mut random),
            SiteKind::OpenHall => open_hall(&mut random),
            SiteKind::Corridor => corridor(&mut random),
            SiteKind::Dock => dock(&mut random),
        }
    }

    /// The same world after a while: that share of what may be moved has been moved, and trucks have come and gone.
    pub(super) fn changed(&self, share: f64, seed: u64) -> Self {
        let mut random = Random::new(seed, Stream::MovedPallets);
        let mut site = self.clone();
        for group in &mut site.groups {
            let is_moved = random.happens(share);
            let (direction, distance) = (random.between(-PI, PI), random.between(MOVED.0, MOVED.1));
            let turn = random.between(-TURNED, TURNED);
            let Some(first) = group.first().map(|first| first.pose).filter(|_| is_moved) else { continue };
            let centre = Pose::new(first.x, first.y, 0.0);
            let moved = Pose::new(first.x + distance * direction.cos(), first.y + distance * direction.sin(), turn);
            for part in group.iter_mut() {
                part.pose = moved.compose(&centre.between(&part.pose));
            }
        }
        if share > 0.0 {
            for (truck, is_there) in &mut site.trucks {
                *is_there ^= random.happens(TRUCKS_CHANGED);
                truck.pose.x += random.between(-0.2, 0.2);
            }
        }
        site
    }

    /// What the laser sees.
    pub(super) fn world(&self) -> World {
        let mut world = World::default();
        for (from, to) in &self.walls {
            world.add_wall(*from, *to);
        }
        for part in self.groups.iter().flatten().chain(self.present_trucks()) {
            world.add_rectangle(part);
        }
        world
    }

    /// What of it stands at the same place in another one.
    pub(super) fn in_common(&self, other: &Self) -> Self {
        let groups = self.groups.iter().zip(&other.groups).filter(|(one, other)| one == other);
        let trucks = self.trucks.iter().zip(&other.trucks).filter(|(one, other)| one == other);
        Self {
            walls: self.walls.clone(),
            groups: groups.map(|(group, _)| group.clone()).collect(),
            trucks: trucks.map(|(truck, _)| *truck).collect(),
            floor: self.floor,
        }
    }

    fn present_trucks(&self) -> impl Iterator<Item = &Rectangle> {
        self.trucks.iter().filter(|(_, is_there)| *is_there).map(|(truck, _)| truck)
    }

    /// Opposite corners of where a vehicle may be, m.
    pub(super) fn floor(&self) -> (Point, Point) {
        self.floor
    }

    /// Whether a vehicle has room at a place.
    pub(super) fn is_free(&self, place: &Point) -> bool {
        let (low, high) = self.floor;
        let is_on_floor = (low.x + CLEARANCE..high.x - CLEARANCE).contains(&place.x)
            && (low.y + CLEARANCE..high.y - CLEARANCE).contains(&place.y);
        let is_far_from_box = |part: &Rectangle| {
            let local = part.pose.inverse_transform(place);
            local.x.abs() > 0.5 * part.length + CLEARANCE || local.y.abs() > 0.5 * part.width + CLEARANCE
        };
        let is_far_from_wall = |(from, to): &(Point, Point)| {
            let along = to - from;
            let share = ((place - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (from + along * share - place).norm() > CLEARANCE
        };
        is_on_floor
            && self.walls.iter().all(is_far_from_wall)
            && self.groups.iter().flatten().chain(self.present_trucks()).all(is_far_from_box)
    }

    /// A pose where a vehicle has room.
    pub(super) fn free_pose(&self, random: &mut Random) -> Pose {
        let (low, high) = self.floor;
        loop {
            let place = Point::new(random.between(low.x, high.x), random.between(low.y, high.y));
            let heading = random.between(-PI, PI);
            if self.is_free(&place) {
                return Pose::new(place.x, place.y, heading);
            }
        }
    }
}

fn rectangle(x: f64, y: f64, theta: f64, length: f64, width: f64) -> Rectangle {
    Rectangle { pose: Pose::new(x, y, theta), length, width }
}

/// Walls around an area, m.
fn outline(low: Point, high: Point) -> Vec<(Point, Point)> {
    let corners = [low, Point::new(high.x, low.y), high, Point::new(low.x, high.y)];
    (0..4).map(|index| (corners[index], corners[(index + 1) % 4])).collect()
}

/// A box somewhere on a floor.
fn goods(random: &mut Random, low: Point, high: Point) -> Group {
    let (x, y) = (random.between(low.x, high.x), random.between(low.y, high.y));
    let theta = random.between(-0.3, 0.3) + if random.happens(0.5) { FRAC_PI_2 } else { 0.0 };
    vec![rectangle(x, y, theta, random.between(0.8, 2.4), random.between(0.8, 1.6))]
}

fn racks(random: &mut Random) -> Site {
    let size = Point::new(44.0, 24.0);
    let mut groups = Vec::new();
    for row in 0..4 {
        let y = 4.5 + 5.0 * f64::from(row);
        for bay in 0..=12 {
            let x = 4.0 + 2.8 * f64::from(bay);
            for side in [-0.5, 0.5] {
                groups.push(vec![rectangle(x, y + side, 0.0, 0.1, 0.1)]);
            }
            if bay < 12 && random.happens(0.6) {
                let (along, across) = (random.between(-0.4, 0.4), random.between(-0.1, 0.1));
                let theta = 0.05 * random.normal();
                let length = random.between(0.8, 1.8);
                groups.push(vec![rectangle(x + 1.4 + along, y + across, theta, length, random.between(0.8, 1.1))]);
            }
        }
    }
    let mut walls = outline(Point::zeros(), size);
    // An office in a corner.
    walls.push((Point::new(38.5, 0.0), Point::new(38.5, 2.5)));
    walls.push((Point::new(38.5, 2.5), Point::new(44.0, 2.5)));
    Site { walls, groups, trucks: Vec::new(), floor: (Point::zeros(), size) }
}

fn open_hall(random: &mut Random) -> Site {
    let size = Point::new(100.0, 60.0);
    let mut walls = outline(Point::zeros(), size);
    for column in 1..5 {
        for row in 1..3 {
            let (x, y) = (20.0 * f64::from(column), 20.0 * f64::from(row));
            walls.extend(outline(Point::new(x - 0.3, y - 0.3), Point::new(x + 0.3, y + 0.3)));
        }
    }
    for _ in 0..2 {
        let (x, y) = (random.between(10.0, 90.0), random.between(8.0, 52.0));
        walls.push((Point::new(x, y), Point::new(x + random.between(3.0, 7.0), y)));
    }
    let groups = (0..24).map(|_| goods(random, Point::new(3.0, 3.0), Point::new(97.0, 57.0))).collect();
    Site { walls, groups, trucks: Vec::new(), floor: (Point::zeros(), size) }
}

fn corridor(random: &mut Random) -> Site {
    let (length, half) = (60.0, 1.2);
    let mut walls =
        vec![(Point::new(0.0, -half), Point::new(0.0, half)), (Point::new(length, -half), Point::new(length, half))];
    let mut groups = Vec::new();
    for side in [-1.0, 1.0] {
        let mut x = 0.0;
        loop {
            let door = x + random.between(2.0, 8.0);
            let (deep, wide) = (half + random.between(0.1, 0.3), random.between(0.9, 1.3));
            if door + wide + 1.0 > length {
                break;
            }
            let at = |x: f64, y: f64| Point::new(x, side * y);
            walls.push((at(x, half), at(door, half)));
            walls.push((at(door, half), at(door, deep)));
            walls.push((at(door, deep), at(door + wide, deep)));
            walls.push((at(door + wide, deep), at(door + wide, half)));
            x = door + wide;
        }
        walls.push((Point::new(x, side * half), Point::new(length, side * half)));
    }
    for _ in 0..8 {
        let (x, side) = (random.between(2.0, 58.0), random.sign());
        groups.push(vec![rectangle(x, side * (half - 0.2), 0.0, random.between(0.6, 1.2), 0.4)]);
    }
    Site { walls, groups, trucks: Vec::new(), floor: (Point::new(0.0, -half), Point::new(length, half)) }
}

fn dock(random: &mut Random) -> Site {
    let size = Point::new(40.0, 20.0);
    let mut walls = vec![
        (Point::new(0.0, 0.0), Point::new(40.0, 0.0)),
        (Point::new(40.0, 0.0), Point::new(40.0, 20.0)),
        (Point::new(0.0, 20.0), Point::new(0.0, 0.0)),
    ];
    let (mut trucks, mut groups, mut from) = (Vec::new(), Vec::new(), 0.0);
    for gate in 0..8 {
        let middle = 2.5 + 5.0 * f64::from(gate);
        walls.push((Point::new(from, 20.0), Point::new(middle - 1.4, 20.0)));
        from = middle + 1.4;
        // The yard ends at a fence.
        let is_there = random.happens(0.5);
        trucks.push((rectangle(middle, 20.0 + random.between(0.3, 1.0) + 6.5, FRAC_PI_2, 13.0, 2.5), is_there));
        if random.happens(0.7) {
            groups.push(goods(random, Point::new(middle - 1.5, 14.0), Point::new(middle + 1.5, 17.5)));
        }
    }
    walls.push((Point::new(from, 20.0), Point::new(40.0, 20.0)));
    walls.push((Point::new(-5.0, 35.0), Point::new(45.0, 35.0)));
    for column in [10.0, 20.0, 30.0] {
        walls.extend(outline(Point::new(column - 0.2, 9.8), Point::new(column + 0.2, 10.2)));
    }
    walls.push((Point::new(0.0, 5.0), Point::new(4.0, 5.0)));
    walls.push((Point::new(33.0, 0.0), Point::new(33.0, 3.0)));
    for _ in 0..8 {
        groups.push(goods(random, Point::new(3.0, 2.0), Point::new(37.0, 8.0)));
    }
    Site { walls, groups, trucks, floor: (Point::zeros(), size) }
}
