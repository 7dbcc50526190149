//! How well the intrinsic calibration finds disturbed parameters back, on simulated scans of a wall.
//!
//! Truth is a real calibration file. The start is disturbed by 2 cm, 0.1 and 0.3 degrees (standard deviations); 45 scans
//! of a wall from 3 to 22 m at five tilts, range noise 2 cm. The mean of alpha is a yaw of the sensor and is given.

use std::time::Instant;

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::{Offsets, point};
use agv_lidar3d::intrinsic::{Return, SolveError, fit, solve};
use nalgebra::{Rotation3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use serde::Serialize;

const DISTANCES: [f64; 9] = [3.0, 4.0, 6.0, 8.0, 10.0, 13.0, 16.0, 19.0, 22.0];
const TILTS: [f64; 5] = [-12.0, -4.0, 4.0, 12.0, 20.0];
/// Width and height of the wall, m; it is seen obliquely, by 30 degrees to either side in turn.
const WALL: [f64; 2] = [16.0, 8.0];
const YAW: f64 = 30.0;
const COLUMNS: usize = 1800;
const NOISE: f64 = 0.02;

/// What came of one calibration file.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Name of the file.
    pub file: String,
    /// Greatest error of D_corr of any laser, m.
    pub max_distance_m: f64,
    /// Greatest error of theta, degrees.
    pub max_elevation_deg: f64,
    /// Greatest error of alpha, degrees.
    pub max_rotation_deg: f64,
    /// Standard deviation of the distances to a wall at 26 m that was not used, before, m.
    pub thickness_before_m: f64,
    /// The same after, m.
    pub thickness_after_m: f64,
    /// Sum of squares before by that after.
    pub sum_of_squares_ratio: f64,
    /// Time for the solution, s.
    pub seconds: f64,
}

/// Disturbs the lasers of a file, simulates and solves.
///
/// # Errors
/// See [`SolveError`].
pub fn run(file: &str, truth: &[Laser], seed: u64) -> Result<Outcome, SolveError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut disturbance = |deviation: f64| Normal::new(0.0, deviation).map_or(0.0, |of| of.sample(&mut random));
    let mut start: Vec<Laser> = truth.to_vec();
    for laser in &mut start {
        laser.distance += disturbance(0.02);
        laser.elevation += disturbance(0.1f64.to_radians());
        laser.rotation += disturbance(0.3f64.to_radians());
    }
    let shift = truth.iter().zip(&start).map(|(a, b)| a.rotation - b.rotation).sum::<f64>() / truth.len() as f64;
    for laser in &mut start {
        laser.rotation += shift;
    }
    let mut scans = Vec::new();
    for distance in DISTANCES {
        for (index, tilt) in TILTS.into_iter().enumerate() {
            let yaw = if index % 2 == 0 { YAW } else { -YAW };
            scans.push(wall(truth, distance, tilt, yaw, &mut disturbance));
        }
    }
    let held_out = wall(truth, 26.0, -4.0, 0.0, &mut disturbance);
    let begin = Instant::now();
    let found = solve(&start, Offsets::Orthogonal, &scans)?;
    let seconds = begin.elapsed().as_secs_f64();
    let worst =
        |of: fn(&Laser) -> f64| truth.iter().zip(&found.lasers).map(|(a, b)| (of(a) - of(b)).abs()).fold(0.0, f64::max);
    Ok(Outcome {
        file: file.to_owned(),
        max_distance_m: worst(|laser| laser.distance),
        max_elevation_deg: worst(|laser| laser.elevation).to_degrees(),
        max_rotation_deg: worst(|laser| laser.rotation).to_degrees(),
        thickness_before_m: thickness(&start, &held_out),
        thickness_after_m: thickness(&found.lasers, &held_out),
        sum_of_squares_ratio: found.sums_of_squares[0] / found.sums_of_squares[1],
        seconds,
    })
}

/// A scan of the wall, `distance` m ahead; angles in degrees.
fn wall(truth: &[Laser], distance: f64, tilt: f64, yaw: f64, noise: &mut impl FnMut(f64) -> f64) -> Vec<Return> {
    let turn = Rotation3::from_euler_angles(0.0, tilt.to_radians(), yaw.to_radians());
    let (normal, across, up) = (turn * Vector3::x(), turn * Vector3::y(), turn * Vector3::z());
    let centre = Vector3::new(distance, 0.0, 0.0);
    let mut returns = Vec::new();
    for (number, laser) in truth.iter().enumerate() {
        for column in 0..COLUMNS {
            let azimuth = std::f64::consts::TAU * column as f64 / COLUMNS as f64;
            let origin = Vector3::from(point(laser, Offsets::Orthogonal, azimuth, 0.0));
            let direction = Vector3::from(point(laser, Offsets::Orthogonal, azimuth, 1.0)) - origin;
            let far = normal.dot(&(centre - origin)) / normal.dot(&direction);
            let from_centre = origin + far * direction - centre;
            let is_on_wall =
                across.dot(&from_centre).abs() < 0.5 * WALL[0] && up.dot(&from_centre).abs() < 0.5 * WALL[1];
            if far + laser.distance > 0.9 && is_on_wall {
                returns.push(Return { laser: number, azimuth, distance: far + noise(NOISE) });
            }
        }
    }
    returns
}

fn thickness(lasers: &[Laser], scan: &[Return]) -> f64 {
    let points = scan.iter().map(|seen| point(&lasers[seen.laser], Offsets::Orthogonal, seen.azimuth, seen.distance));
    let Some(plane) = fit(points.clone()) else { return f64::NAN };
    let sum: f64 = points.map(|at| plane.residual(Vector3::from(at)).powi(2)).sum();
    (sum / scan.len() as f64).sqrt()
}
