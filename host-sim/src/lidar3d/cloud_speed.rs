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
/// After a gap of so many seconds the sensor is taken to stand.
const LONGEST: f64 = 0.5;

/// The speed of a sensor, revolution by revolution.
pub struct CloudSpeed {
    levelling: Rotation3<f64>,
    height: f64,
    last: Option<(Time, Target)>,
    speed: Speed,
}

impl CloudSpeed {
    /// Of a sensor that stands.
    #[must_use]
    pub fn new(levelling: Rotation3<f64>, height: f64) -> Self {
        Self { levelling, height, last: None, speed: Speed::default() }
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
            let moved = target.align(&points, &Pose::new(x * passed, y * passed, turn * passed))?.pose;
            let (sin, cos) = libm::sincos(-0.5 * moved.theta);
            // At constant speed the chord lies at half of the turn.
            Some(Speed {
                x: (moved.x * cos - moved.y * sin) / passed,
                y: (moved.x * sin + moved.y * cos) / passed,
                turn: moved.theta / passed,
            })
        });
        self.speed = found.unwrap_or(self.speed);
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
