//! Points of a file as those of a sensor: rings, and the angle of the head.

use std::vec;
use std::vec::Vec;

use super::FilePoint;
use crate::calibration::Laser;
use crate::packet::Point;

/// Rings that a cloud without numbers of rings is cut into, by elevation.
const RINGS: usize = 64;
/// Most rings that a file may number.
const MOST: usize = 128;
/// Hundredths of a degree in a turn.
const TURN: f64 = 36_000.0;

/// A cloud as a sensor would have seen it.
#[derive(Clone, Debug)]
pub struct Ringed {
    /// What was seen, in the order of the file; the lasers are numbered as the rings, from the lowest up.
    pub points: Vec<Point>,
    /// Elevation of each ring: the mean of its points.
    pub lasers: Vec<Laser>,
}

/// Numbers the rings of a cloud: those of the file, the lowest first, or bands of elevation where it states none or more
/// than 128.
#[must_use]
pub fn ringed(cloud: &[FilePoint]) -> Ringed {
    let seen: Vec<&FilePoint> = cloud.iter().filter(|point| point.is_seen()).collect();
    let elevations: Vec<f64> = seen.iter().map(|point| elevation(point.position)).collect();
    let stated: Option<Vec<usize>> = seen.iter().map(|point| point.ring.map(usize::from)).collect();
    let numbers = stated.filter(|rings| rings.iter().all(|ring| *ring < MOST)).unwrap_or_else(|| bands(&elevations));
    let mut sums = vec![(0.0, 0_usize); numbers.iter().max().map_or(0, |most| most + 1)];
    for (number, elevation) in numbers.iter().zip(&elevations) {
        sums[*number] = (sums[*number].0 + elevation, sums[*number].1 + 1);
    }
    let mut order: Vec<(usize, f64)> = sums
        .iter()
        .enumerate()
        .filter(|(_, (_, count))| *count > 0)
        .map(|(number, (sum, count))| (number, sum / *count as f64))
        .collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut ring_of = vec![0; sums.len()];
    for (ring, (number, _)) in order.iter().enumerate() {
        ring_of[*number] = ring as u8;
    }
    let factor = intensity_factor(&seen);
    let point = |(point, number): (&&FilePoint, &usize)| {
        let [x, y, _] = point.position;
        let azimuth = (TURN - y.atan2(x).to_degrees() * 100.0).round().rem_euclid(TURN);
        let ring = ring_of[*number];
        Point {
            position: point.position.map(|value| value as f32),
            intensity: (factor * point.intensity).clamp(0.0, f64::from(u16::MAX)).round() as u16,
            azimuth: azimuth as u16,
            laser: ring,
            ring,
            ..Point::default()
        }
    };
    let laser = |(_, elevation): &(usize, f64)| Laser { elevation: *elevation, is_enabled: true, ..Laser::default() };
    Ringed { points: seen.iter().zip(&numbers).map(point).collect(), lasers: order.iter().map(laser).collect() }
}

/// From the unit of a file to whole numbers: shares of the largest intensity, as KITTI has them, become those of 255, and what is larger
/// than 65,535 is scaled down.
fn intensity_factor(points: &[&FilePoint]) -> f64 {
    let intensities = || points.iter().map(|point| point.intensity).filter(|value| value.is_finite());
    let largest = intensities().fold(0.0, f64::max);
    if largest > f64::from(u16::MAX) {
        f64::from(u16::MAX) / largest
    } else if largest > 0.0 && largest <= 1.0 && intensities().any(|value| value.fract() != 0.0) {
        255.0
    } else {
        1.0
    }
}

fn elevation([x, y, z]: [f64; 3]) -> f64 {
    z.atan2(x.hypot(y))
}

/// Equal bands between the lowest and the highest point.
fn bands(elevations: &[f64]) -> Vec<usize> {
    let least = elevations.iter().copied().fold(f64::MAX, f64::min);
    let most = elevations.iter().copied().fold(f64::MIN, f64::max);
    let height = ((most - least) / RINGS as f64).max(f64::MIN_POSITIVE);
    elevations.iter().map(|elevation| (((elevation - least) / height) as usize).min(RINGS - 1)).collect()
}
