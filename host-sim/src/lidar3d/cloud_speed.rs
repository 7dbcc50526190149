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

/// Alignments of a revolution: the first speed distorts its surfaces, the second one hardly.
const ROUNDS: usize = 2;

/// The speed of a sensor, revolution by revolution.
pub struct CloudSpeed {
    levelling: Rotation3<f64>,
    height: f64,
    last: Option<Last>,
    /// Mean speed between the middles of the last two revolutions, and the time between these.
    mean: Option<(Time, Speed)>,
    speed: Speed,
    /// Sudden speeds in a row.
    sudden: u32,
}

/// The revolution before, as it was seen from its middle.
struct Last {
    middle: Time,
    target: Option<Target>,
}

impl CloudSpeed {
    /// Of a sensor that stands.
    #[must_use]
    pub fn new(levelling: Rotation3<f64>, height: f64) -> Self {
        Self { levelling, height, last: None, mean: None, speed: Speed::default(), sudden: 0 }
    }

    /// The speed in the middle of a revolution; that of the one before if its surfaces do not tell.
    pub fn speed(&mut self, revolution: &Revolution) -> Speed {
        let half = 5e-10 * f64::from(revolution.points.iter().map(|point| point.time).max().unwrap_or(0));
        let middle = revolution.start.offset(half);
        let mut points = self.walls(revolution, half);
        let passed = self.last.as_ref().map(|last| middle.since(last.middle));
        match passed {
            Some(passed) if passed > 0.0 && passed <= LONGEST => {
                let mean = self.mean;
                for _ in 0..ROUNDS {
                    let Some(found) = self.found(&points, passed) else { break };
                    self.mean = Some((middle.offset(-0.5 * passed), found));
                    self.speed = self.extrapolated(mean, middle);
                    points = self.walls(revolution, half);
                }
            }
            _ => (self.speed, self.mean) = (Speed::default(), None),
        }
        self.last = Some(Last { middle, target: Target::new(points) });
        self.speed
    }

    /// The mean speed since the revolution before, whose surfaces are laid under these; None if they do not tell, or if it has changed
    /// too much.
    fn found(&mut self, points: &[WallPoint], passed: f64) -> Option<Speed> {
        let Speed { x, y, turn } = self.speed;
        let target = self.last.as_ref()?.target.as_ref()?;
        let moved = aligned(target, points, &Pose::new(x * passed, y * passed, turn * passed))?;
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
    }

    /// The speed at a time by the last mean and by the one before it: it changes as it has changed between these.
    fn extrapolated(&self, before: Option<(Time, Speed)>, time: Time) -> Speed {
        let Some((at, mean)) = self.mean else { return self.speed };
        let Some((earlier, other)) = before else { return mean };
        let share = time.since(at) / at.since(earlier);
        Speed {
            x: mean.x + share * (mean.x - other.x),
            y: mean.y + share * (mean.y - other.y),
            turn: mean.turn + share * (mean.turn - other.turn),
        }
    }

    /// Upright surfaces as they are seen from the middle of the revolution, `half` of its time after it began, s: there an error of the speed
    /// moves the one half of them against the other, and not all.
    fn walls(&self, revolution: &Revolution, half: f64) -> Vec<WallPoint> {
        let rings = revolution.points.iter().map(|point| usize::from(point.ring) + 1).max().unwrap_or(0);
        let step = rings.div_ceil(RINGS).max(1);
        let mut levelled = vec![Vec::new(); rings.div_ceil(step)];
        for point in revolution.points.iter().filter(|point| usize::from(point.ring).is_multiple_of(step)) {
            let [x, y, z] = (self.levelling * Vector3::from(point.position.map(f64::from))).into();
            let after = 1e-9 * f64::from(point.time) - half;
            let (sin, cos) = libm::sincos(self.speed.turn * after);
            let [ahead, left] = self.speed.way(after);
            let seen = [x * cos - y * sin + ahead, x * sin + y * cos + left, z];
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
