//! Halls and drives that are drawn by a seed, by two generators that share nothing but what a hall is.

mod racks;
mod shapes;
mod sketches;

use agv_core::geometry::{Point, Pose};
use agv_host_sim::simulate::path::Path;
use agv_host_sim::simulate::raycast::{RayCaster, Surface};
use agv_host_sim::simulate::scenario::{DriveOptions, ReflectorOptions, Scenario};
use serde::Serialize;

pub use sketches::{SKETCHES, Sketch, sketch};

/// What draws halls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Generator {
    /// Three aisles between racks, one of them with 10 m without reflectors, and a station.
    #[default]
    Racks,
    /// Halls that people describe in a few words, each of them in turn: aisles in a grid, three reflectors in sight, all on one line,
    /// all far away, open and fast, nearly symmetric, periodic.
    Sketches,
}

/// A hall that was drawn, and a drive in it.
#[derive(Clone, Debug)]
pub struct Hall {
    /// What to simulate.
    pub scenario: Scenario,
    /// Where the vehicle docks, W, m.
    pub station: Point,
    /// Corners of where there are no reflectors on purpose, W, m: losing availability there is no loss of continuity.
    pub bare: Option<[Point; 2]>,
    /// Whether the commissioning check accepts it: but where there are none on purpose, nowhere on more than
    /// [`LONGEST_BLIND`] m in a row are fewer than three reflectors within [`CHECKED_RANGE`] m in sight.
    pub is_accepted: bool,
}

impl Hall {
    /// Whether there are no reflectors on purpose where a vehicle is.
    #[must_use]
    pub fn is_bare(&self, here: &Point) -> bool {
        self.bare.as_ref().is_some_and(|bare| is_within(bare, here))
    }
}

fn is_within([least, most]: &[Point; 2], here: &Point) -> bool {
    (least.x..=most.x).contains(&here.x) && (least.y..=most.y).contains(&here.y)
}

/// Longest way on which the commissioning check tolerates fewer than three reflectors in sight, m.
pub const LONGEST_BLIND: f64 = 3.0;
/// Reflectors farther away than this do not count for the commissioning check, m.
pub const CHECKED_RANGE: f64 = 25.0;
/// How long the vehicle stands, switched on, before anything may happen, s; it drives off a second later.
pub const STANDS: f64 = 5.0;

/// Draws a hall.
#[must_use]
pub fn draw(generator: Generator, seed: u64) -> Hall {
    match generator {
        Generator::Racks => racks::draw(seed),
        Generator::Sketches => sketches::draw(seed),
    }
}

/// How every vehicle drives, and what it misses: stops at the start, between legs and at the end, at that speed, m/s. Hall and way are
/// still to be stated.
fn empty(seed: u64, speed: f64) -> Scenario {
    Scenario {
        seed,
        drive: DriveOptions {
            speed,
            start_standstill: STANDS + 1.0,
            stop_between_legs: 3.0,
            end_standstill: 6.0,
            ..DriveOptions::default()
        },
        reflectors: ReflectorOptions { missing_share: 0.1, ..ReflectorOptions::default() },
        ..Scenario::default()
    }
}

/// The commissioning check, by what stands where.
fn is_accepted(scenario: &Scenario, bare: Option<&[Point; 2]>) -> bool {
    let world = scenario.build_world();
    let caster = RayCaster::new(&world);
    let mut blind = 0.0;
    for pose in poses(&scenario.build_path()) {
        let laser = pose.compose(&scenario.laser.mounting.pose()).position();
        let in_sight = world.reflectors.iter().enumerate().filter(|(index, reflector)| {
            let offset = reflector.body.centre - laser;
            let distance = offset.norm();
            distance < CHECKED_RANGE.min(reflector.farthest)
                && caster
                    .first_hit(&laser, &(offset / distance), CHECKED_RANGE)
                    .is_some_and(|hit| hit.surface == Surface::Reflector(*index))
        });
        let is_bare = bare.is_some_and(|bare| is_within(bare, &laser));
        blind = if is_bare || in_sight.count() >= 3 { 0.0 } else { blind + STEP };
        if blind > LONGEST_BLIND {
            return false;
        }
    }
    true
}

/// Step of the commissioning check along the way, m.
const STEP: f64 = 0.25;

/// The way in steps.
fn poses(path: &Path) -> Vec<Pose> {
    let mut start = path.start;
    let mut poses = Vec::new();
    for leg in &path.legs {
        poses.extend((0..(leg.length() / STEP) as usize).map(|step| leg.pose(&start, step as f64 * STEP)));
        start = leg.pose(&start, leg.length());
    }
    poses
}
