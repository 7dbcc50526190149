//! Intrinsic calibration in simulation: a real calibration file is the truth, and 45 scans of a wall bring disturbed
//! values back to it.

use std::path::Path;
use std::time::Instant;

use agv_lidar3d::calibration::{Calibration, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::intrinsic::{self, Deviation, Residual, Return, Target};
use agv_lidar3d::packet::Sensor as Model;
use anyhow::Context;
use serde::Serialize;

use agv_host_sim::simulate::multi_beam::{self, Sensor, Stand};
use agv_host_sim::simulate::random::{Random, Stream};

/// Distances from the wall that are used, and the one that is kept for the check, m (M 3.2.2).
const DISTANCES: [f64; 9] = [3.0, 5.0, 6.7, 8.5, 10.0, 12.5, 15.0, 18.5, 22.0];
const HELD_OUT: f64 = 26.0;
/// Upwards turn and roll of the sensor at each distance, deg.
const TILTS: [[f64; 2]; 5] = [[0.0, 3.0], [9.0, -6.0], [18.0, 6.0], [27.0, -3.0], [36.0, 0.0]];
/// The sensor's forward axis is within this angle of the wall's normal, deg.
const HEADING: f64 = 15.0;
/// Standard deviation of a distance, m.
const NOISE: f64 = 0.02;
/// Standard deviations of the disturbance: m, deg, deg.
const DISTURBANCE: [f64; 3] = [0.02, 0.1, 0.3];

/// How the walls look before and after.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Walls {
    /// Root mean square distance from the plane of best fit with the values of the start, m.
    pub thickness_before_m: f64,
    /// With the values found, m.
    pub thickness_after_m: f64,
    /// With the true values, m: what noise and false returns leave.
    pub thickness_true_m: f64,
    /// Sum of squares before, divided by the one after.
    pub sum_of_squares_ratio: f64,
    /// Points on the walls.
    pub points: usize,
}

/// What came out for one truth.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// File of the truth.
    pub truth: String,
    /// Lasers calibrated.
    pub lasers: usize,
    /// Greatest error of D_corr over the lasers, m.
    pub worst_distance_m: f64,
    /// Greatest error of theta, deg.
    pub worst_elevation_deg: f64,
    /// Greatest error of alpha after its mean error, which is the gauge, is taken off, deg.
    pub worst_rotation_deg: f64,
    /// The same before: m, deg, deg.
    pub worst_before: [f64; 3],
    /// Greatest stated standard deviation: m, deg, deg.
    pub worst_deviation: [f64; 3],
    /// Root mean square of error over stated standard deviation, of D_corr, theta and alpha; 1 is honest.
    pub normalised_errors: [f64; 3],
    /// Whether every laser is back to 2 mm, 0.01 deg and 0.02 deg.
    pub is_within_limits: bool,
    /// The 45 scans used.
    pub used: Walls,
    /// Five scans at 26 m, not used.
    pub held_out: Walls,
    /// Rounds of the adjustment.
    pub rounds: usize,
    /// Segmentation and adjustment, s.
    pub seconds: f64,
}

/// Runs the experiment with the calibration of `path` as the truth.
///
/// # Errors
/// If the file cannot be read, or its lasers cannot be calibrated.
pub fn run(path: &Path, offsets: Offsets, residual: Residual, seed: u64) -> anyhow::Result<Outcome> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {name}"))?;
    let calibration = Calibration::read(&text).with_context(|| format!("{name}"))?;
    let resolution = calibration.distance_resolution.unwrap_or(Model::Hdl64e.distance_resolution());
    let sensor = Sensor { lasers: &calibration.lasers, offsets, resolution, noise: NOISE };
    let start = disturbed(&calibration.lasers, &mut Random::new(seed, Stream::LaserParameters));
    let mut random = Random::new(seed, Stream::MultiBeam);
    let used: Vec<Vec<Return>> =
        DISTANCES.into_iter().flat_map(|distance| scans(sensor, distance, &mut random)).collect();
    let held_out = scans(sensor, HELD_OUT, &mut random);

    let began = Instant::now();
    let used = targets(&start, offsets, &used)?;
    let found = intrinsic::calibrate(&start, offsets, residual, &used).with_context(|| format!("{name}"))?;
    let seconds = began.elapsed().as_secs_f64();
    let held_out = targets(&start, offsets, &held_out)?;

    let observed: Vec<(&Laser, &Laser, &Laser, Deviation)> = calibration
        .lasers
        .iter()
        .zip(&start)
        .zip(&found.lasers)
        .zip(&found.deviations)
        .filter_map(|(((truth, start), found), deviation)| Some((truth, start, found, (*deviation)?)))
        .collect();
    let before = errors(observed.iter().map(|(truth, start, ..)| (*truth, *start)));
    let after = errors(observed.iter().map(|(truth, _, found, _)| (*truth, *found)));
    let stated: Vec<[f64; 3]> = observed
        .iter()
        .map(|(.., deviation)| [deviation.distance, deviation.elevation.to_degrees(), deviation.rotation.to_degrees()])
        .collect();
    let [worst_distance_m, worst_elevation_deg, worst_rotation_deg] = worst(&after);
    let normalised = [0, 1, 2].map(|parameter| {
        let squares = after.iter().zip(&stated).map(|(error, stated)| (error[parameter] / stated[parameter]).powi(2));
        (squares.sum::<f64>() / after.len() as f64).sqrt()
    });
    let walls = |targets: &[Target]| walls(targets, offsets, [&start, &found.lasers, &calibration.lasers]);
    Ok(Outcome {
        truth: path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        lasers: observed.len(),
        worst_distance_m,
        worst_elevation_deg,
        worst_rotation_deg,
        worst_before: worst(&before),
        worst_deviation: worst(&stated),
        normalised_errors: normalised,
        is_within_limits: worst_distance_m <= 0.002 && worst_elevation_deg <= 0.01 && worst_rotation_deg <= 0.02,
        used: walls(&used),
        held_out: walls(&held_out),
        rounds: found.rounds,
        seconds,
    })
}

fn disturbed(truth: &[Laser], random: &mut Random) -> Vec<Laser> {
    let [distance, elevation, rotation] = DISTURBANCE;
    let mut disturb = |laser: &Laser| Laser {
        distance: laser.distance + distance * random.normal(),
        elevation: laser.elevation + elevation.to_radians() * random.normal(),
        rotation: laser.rotation + rotation.to_radians() * random.normal(),
        ..*laser
    };
    truth.iter().map(&mut disturb).collect()
}

fn scans(sensor: Sensor<'_>, distance: f64, random: &mut Random) -> Vec<Vec<Return>> {
    let mut scan = |[pitch, roll]: [f64; 2]| {
        let heading = random.between(-HEADING, HEADING).to_radians();
        let stand = Stand { distance, pitch: pitch.to_radians(), roll: roll.to_radians(), heading };
        multi_beam::scan(sensor, stand, random)
    };
    TILTS.into_iter().map(&mut scan).collect()
}

fn targets(lasers: &[Laser], offsets: Offsets, scans: &[Vec<Return>]) -> anyhow::Result<Vec<Target>> {
    let segment = |(number, scan): (usize, &Vec<Return>)| {
        intrinsic::segment(lasers, offsets, scan, number as u64).with_context(|| format!("scan {number}"))
    };
    scans.iter().enumerate().map(segment).collect()
}

/// Errors of D_corr, m, theta and alpha, deg; the mean error of alpha, the gauge, is taken off.
fn errors<'a>(pairs: impl Iterator<Item = (&'a Laser, &'a Laser)>) -> Vec<[f64; 3]> {
    let mut errors: Vec<[f64; 3]> = pairs
        .map(|(truth, found)| {
            let elevation = (found.elevation - truth.elevation).to_degrees();
            [found.distance - truth.distance, elevation, (found.rotation - truth.rotation).to_degrees()]
        })
        .collect();
    let gauge = errors.iter().map(|error| error[2]).sum::<f64>() / errors.len().max(1) as f64;
    for error in &mut errors {
        error[2] -= gauge;
    }
    errors
}

fn worst(rows: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|parameter| rows.iter().map(|row| row[parameter].abs()).fold(0.0, f64::max))
}

/// The points are the same for all three sets of parameters: before, after, true.
fn walls(targets: &[Target], offsets: Offsets, sets: [&[Laser]; 3]) -> Walls {
    let mut points = 0;
    let sums = sets.map(|lasers| {
        let found: Vec<_> =
            targets.iter().filter_map(|target| intrinsic::flatness(lasers, offsets, &target.returns)).collect();
        points = found.iter().map(|flatness| flatness.points).sum();
        found.iter().map(|flatness| flatness.sum_of_squares).sum::<f64>()
    });
    let [before, after, truth] = sums.map(|sum| (sum / points.max(1) as f64).sqrt());
    Walls {
        thickness_before_m: before,
        thickness_after_m: after,
        thickness_true_m: truth,
        sum_of_squares_ratio: sums[0] / sums[1],
        points,
    }
}
