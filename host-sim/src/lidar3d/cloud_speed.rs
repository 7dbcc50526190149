//! How fast a sensor moves, by its own revolutions: the upright surfaces of each one are laid over those of the one before.

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use nalgebra::{Rotation3, Vector3};

use super::projection::Speed;
use super::revolution::Revolution;
use super::scan_motion::Target;
use super::wall_points::{WallPoint, wall_points};

/// Points that are aligned, about, and rings of them.
const POINTS: usize = 2500;
const RINGS: usize = 16;
/// Lowest height above the floor and farthest distance that count, m.
const LOWEST: f64 = 0.3;
const FARTHEST: f64 = 40.0;
/// How far a surface may be off at the beginning of an alignment, m: the speed changes little from turn to turn.
const GATE: f64 = 0.2;
/// Share of the points that must agree before other turns are tried, and these, rad.
const AGREEING: f64 = 0.7;
const TURNS: [f64; 6] = [-0.06, -0.04, -0.02, 0.02, 0.04, 0.06];
/// What changes faster is a wrong alignment, m/s^2 and rad/s^2.
const SUDDEN: (f64, f64) = (4.0, 6.0);
/// So many in a row are right: the sensor was switched on while it moved.
const PATIENCE: u32 = 3;
/// After a gap of so many seconds the sensor is taken to stand.
const LONGEST: f64 = 0.5;

/// The speed of a sensor, revolution by revolution.
pub struct CloudSpeed {
    levelling: Rotation3<f64>,
    height: f64,
    last: Option<(Time, Target)>,
    speed: Speed,
    /// Sudden speeds in a row.
    sudden: u32,
}

impl CloudSpeed {
    /// Of a sensor that stands.
    #[must_use]
    pub fn new(levelling: Rotation3<f64>, height: f64) -> Self {
        Self { levelling, height, last: None, speed: Speed::default(), sudden: 0 }
    }

    /// The speed in a revolution; that of the one before if its surfaces do not tell.
    pub fn speed(&mut self, revolution: &Revolution) -> Speed {
        let points = self.walls(revolution);
        let found = self.last.as_ref().and_then(|(start, target)| {
            let passed = revolution.start.since(*start);
            if passed <= 0.0 || passed > LONGEST {
                return Some(Speed::default());
            }
            let Speed { x, y, turn } = self.speed;
            let moved = aligned(target, &points, &Pose::new(x * passed, y * passed, turn * passed))?;
            let (sin, cos) = libm::sincos(-0.5 * moved.theta);
            // At constant speed the chord lies at half of the turn.
            let found = Speed {
                x: (moved.x * cos - moved.y * sin) / passed,
                y: (moved.x * sin + moved.y * cos) / passed,
                turn: moved.theta / passed,
            };
            let is_sudden = libm::hypot(found.x - x, found.y - y) > SUDDEN.0 * passed.max(0.1)
                || (found.turn - turn).abs() > SUDDEN.1 * passed.max(0.1);
            self.sudden = if is_sudden { self.sudden + 1 } else { 0 };
            (!is_sudden || self.sudden > PATIENCE).then_some(found)
        });
        // A wrong speed distorts the surfaces, and the next one is then wrong the other way round: the mean of both is right.
        if let Some(found) = found {
            let Speed { x, y, turn } = self.speed;
            self.speed = Speed { x: 0.5 * (x + found.x), y: 0.5 * (y + found.y), turn: 0.5 * (turn + found.turn) };
        }
        self.last = Target::new(points).map(|target| (revolution.start, target));
        self.speed
    }

    /// Upright surfaces as they are seen from where the revolution began.
    fn walls(&self, revolution: &Revolution) -> Vec<WallPoint> {
        let rings = revolution.points.iter().map(|point| usize::from(point.ring) + 1).max().unwrap_or(0);
        let step = rings.div_ceil(RINGS).max(1);
        let mut levelled = vec![Vec::new(); rings.div_ceil(step)];
        for point in revolution.points.iter().filter(|point| usize::from(point.ring).is_multiple_of(step)) {
            let [x, y, z] = (self.levelling * Vector3::from(point.position.map(f64::from))).into();
            let after = 1e-9 * f64::from(point.time);
            let (sin, cos) = libm::sincos(self.speed.turn * after);
            let seen = [x * cos - y * sin + self.speed.x * after, x * sin + y * cos + self.speed.y * after, z];
            levelled[usize::from(point.ring) / step].push(seen);
        }
        let least = LOWEST - self.height;
        wall_points(&levelled, POINTS, |[x, y, z]| *z > least && libm::hypot(*x, *y) < FARTHEST)
    }
}

/// Near to a start; where few points agree, as at the beginning of a bend, the turn is searched for.
fn aligned(target: &Target, points: &[WallPoint], start: &Pose) -> Option<Pose> {
    let align = |turn: f64| target.align(points, &Pose::new(start.x, start.y, start.theta + turn), GATE);
    let first = align(0.0);
    let enough = (AGREEING * points.len() as f64) as usize;
    if let Some(found) = first.filter(|found| found.agreeing >= enough) {
        return Some(found.pose);
    }
    let others = TURNS.into_iter().filter_map(align);
    first.into_iter().chain(others).max_by_key(|found| found.agreeing).map(|found| found.pose)
}
