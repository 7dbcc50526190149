//! A multi-beam lidar that turns on a simulated vehicle.

use std::f64::consts::TAU;

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_lidar3d::calibration::Laser;
use agv_lidar3d::packet::{Point, ReturnKind};
use nalgebra::{Rotation3, Vector3};

use super::revolution::Revolution;
use crate::recording::{Truth, truth_at};
use crate::simulate::random::Random;
use crate::simulate::raycast::Surface;
use crate::simulate::storeys::Storeys;

/// Strength of the returns of foil and of everything else, by a maker's scale on which retroreflectors begin above 100 (VLP-16 user manual,
/// chapter 6.1).
const FOIL: u16 = 200;
const PLAIN: u16 = 40;

/// A sensor and how it is mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct SpinningLidar {
    /// Elevations of its beams, rad, from the lowest up.
    pub elevations: Vec<f64>,
    /// Directions in which each beam measures in a turn.
    pub columns: u32,
    /// Turns a second.
    pub frequency: f64,
    /// Standard deviation of a distance, m.
    pub noise: f64,
    /// Distances that it measures, m.
    pub distances: [f64; 2],
    /// Its pose on the vehicle, seen from above.
    pub mount: Pose,
    /// Its height above the floor, m.
    pub height: f64,
    /// Its turns about the axes ahead and to the left, rad.
    pub roll: f64,
    /// See `roll`.
    pub pitch: f64,
}

impl SpinningLidar {
    /// A VLP-16 at ten turns a second: 16 beams from -15 to 15 deg, 0.2 deg, 3 cm, 100 m (data sheet 63-9229). The 3 cm that it states
    /// without saying of what are taken for a standard deviation.
    #[must_use]
    pub fn vlp16() -> Self {
        Self::of_beams(16, [-15.0, 15.0], 1800, 0.03, 100.0)
    }

    /// An HDL-64E at ten turns a second: 64 beams from -24.8 to 2 deg, evenly; 0.1728 deg, standard deviation below 2 cm, 120 m
    /// (data sheet 63-9194).
    #[must_use]
    pub fn hdl64e() -> Self {
        Self::of_beams(64, [-24.8, 2.0], 2083, 0.02, 120.0)
    }

    fn of_beams(count: usize, [least, most]: [f64; 2], columns: u32, noise: f64, farthest: f64) -> Self {
        let step = (most - least) / (count - 1) as f64;
        Self {
            elevations: (0..count).map(|beam| (least + step * beam as f64).to_radians()).collect(),
            columns,
            frequency: 10.0,
            noise,
            distances: [0.9, farthest],
            mount: Pose::new(0.9, 0.0, 0.0),
            height: 2.0,
            roll: 0.0,
            pitch: 0.0,
        }
    }

    /// Its lasers, numbered from the lowest beam up.
    #[must_use]
    pub fn lasers(&self) -> Vec<Laser> {
        let laser = |elevation: &f64| Laser { elevation: *elevation, is_enabled: true, ..Laser::default() };
        self.elevations.iter().map(laser).collect()
    }

    /// What it sees in the turn that begins at `start`, from a vehicle that is where `truth` says. The head turns clockwise and begins
    /// ahead. None if the truth does not reach so far.
    #[must_use]
    pub fn revolution(
        &self,
        storeys: &Storeys,
        truth: &[Truth],
        start: Time,
        random: &mut Random,
    ) -> Option<Revolution> {
        let attitude = Rotation3::from_euler_angles(self.roll, self.pitch, 0.0);
        let mut points = Vec::with_capacity(self.elevations.len() * self.columns as usize);
        for column in 0..self.columns {
            let share = f64::from(column) / f64::from(self.columns);
            let after = share / self.frequency;
            let sensor = truth_at(truth, start.offset(after))?.compose(&self.mount);
            let (sin, cos) = libm::sincos(-TAU * share);
            let (turn_sin, turn_cos) = libm::sincos(sensor.theta);
            for (laser, elevation) in self.elevations.iter().enumerate() {
                let (up, level) = libm::sincos(*elevation);
                let own = Vector3::new(level * cos, level * sin, up);
                let leaning = attitude * own;
                let direction = [
                    turn_cos * leaning.x - turn_sin * leaning.y,
                    turn_sin * leaning.x + turn_cos * leaning.y,
                    leaning.z,
                ];
                let noise = self.noise * random.normal();
                let Some(hit) = storeys.first_hit([sensor.x, sensor.y, self.height], direction, self.distances[1])
                else {
                    continue;
                };
                let distance = hit.distance + noise;
                if !(self.distances[0]..=self.distances[1]).contains(&distance) {
                    continue;
                }
                let is_foil = matches!(hit.surface, Some(Surface::Reflector(_)));
                points.push(Point {
                    position: (own * distance).map(|value| value as f32).into(),
                    time: (1e9 * after).round() as i32,
                    intensity: if is_foil { FOIL } else { PLAIN },
                    azimuth: (36_000.0 * share) as u16,
                    laser: laser as u8,
                    ring: laser as u8,
                    kind: ReturnKind::Strongest,
                });
            }
        }
        Some(Revolution { start, points, is_whole: true })
    }
}
