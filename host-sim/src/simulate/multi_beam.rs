//! What a multi-beam lidar sees of a wall on level ground.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::{Offsets, point};
use agv_lidar3d::intrinsic::Return;
use agv_lidar3d::packet::LENGTH;
use nalgebra::{Rotation3, Vector3};

use super::random::Random;
use crate::hdl64e_packets::hdl64e_packets;

/// Lasers of an HDL-64E.
const LASERS: usize = 64;
/// Width and height of the wall, m.
pub const WALL: [f64; 2] = [30.0, 8.0];
/// Height of the sensor above the ground, m.
const SENSOR_HEIGHT: f64 = 1.7;
/// Step of the head between two firings at 10 revolutions a second, and resolution of its angle, rad.
const STEP: f64 = 0.1728 * TAU / 360.0;
const AZIMUTH_COUNT: f64 = 0.01 * TAU / 360.0;
/// Distances outside are reported false (M 2.3.2) and therefore absent, m.
const DISTANCES: [f64; 2] = [0.9, 120.0];
/// Part of the returns that are false, at a distance of their own.
const FALSE_RETURNS: f64 = 0.005;
/// Farthest point of ground that sends light back, m.
const GROUND_REACH: f64 = 40.0;

/// Where the sensor stands before the wall.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    /// From the wall, m.
    pub distance: f64,
    /// Upwards turn of the sensor, rad.
    pub pitch: f64,
    /// Turn of the sensor about its own forward axis, rad.
    pub roll: f64,
    /// Turn of the sensor to the left of the wall's normal, rad.
    pub heading: f64,
}

/// The sensor that looks.
#[derive(Clone, Copy, Debug)]
pub struct Sensor<'a> {
    /// Its true parameters.
    pub lasers: &'a [Laser],
    /// How its offsets are measured.
    pub offsets: Offsets,
    /// Length of a count of distance, m.
    pub resolution: f64,
    /// Standard deviation of a distance, m.
    pub noise: f64,
}

/// One revolution, as the returns that are seen.
pub fn scan(sensor: Sensor<'_>, stand: Stand, random: &mut Random) -> Vec<Return> {
    let attitude = Rotation3::from_euler_angles(stand.roll, -stand.pitch, stand.heading);
    let mut returns = Vec::new();
    let start = random.between(0.0, STEP);
    for firing in 0..(TAU / STEP) as usize {
        let azimuth = start + STEP * firing as f64;
        let reported = (azimuth / AZIMUTH_COUNT).round() * AZIMUTH_COUNT;
        for (number, laser) in sensor.lasers.iter().enumerate().filter(|(_, laser)| laser.is_enabled) {
            // A point is linear in its distance: two of them are the beam.
            let at = |distance: f64| Vector3::from(point(laser, sensor.offsets, azimuth, distance - laser.distance));
            let origin = attitude * at(0.0) + Vector3::new(0.0, 0.0, SENSOR_HEIGHT);
            let direction = attitude * (at(1.0) - at(0.0));
            let Some(mut distance) = seen(origin, direction, stand.distance) else { continue };
            distance += sensor.noise * random.normal();
            if random.happens(FALSE_RETURNS) {
                distance = random.between(DISTANCES[0], DISTANCES[1]);
            }
            let measured = ((distance - laser.distance) / sensor.resolution).round() * sensor.resolution;
            if (DISTANCES[0]..=DISTANCES[1]).contains(&distance) && measured > 0.0 {
                returns.push(Return { laser: number, azimuth: reported, distance: measured });
            }
        }
    }
    returns
}

/// One revolution and the beginning of the next, as the packets of an HDL-64E.
pub fn packets(sensor: Sensor<'_>, stand: Stand, random: &mut Random) -> Vec<[u8; LENGTH]> {
    let mut counts: BTreeMap<u16, [u16; LASERS]> = BTreeMap::new();
    for seen in scan(sensor, stand, random) {
        let azimuth = (seen.azimuth / AZIMUTH_COUNT).round().rem_euclid(TAU / AZIMUTH_COUNT) as u16;
        if let Some(count) = counts.entry(azimuth).or_insert([0; LASERS]).get_mut(seen.laser) {
            *count = (seen.distance / sensor.resolution).round() as u16;
        }
    }
    let mut azimuths: Vec<u16> = counts.keys().copied().collect();
    // A revolution is known to be whole when the next one begins, and the one before has ended.
    azimuths.rotate_right(1);
    azimuths.extend(azimuths.get(1).copied());
    let firings: Vec<&[u16; LASERS]> = azimuths.iter().filter_map(|azimuth| counts.get(azimuth)).collect();
    hdl64e_packets(&azimuths, |firing, laser| firings.get(firing).map_or(0, |counts| counts[laser]))
}

/// Distance to the nearer of wall and ground, m.
fn seen(origin: Vector3<f64>, direction: Vector3<f64>, wall: f64) -> Option<f64> {
    let to_wall = (wall - origin.x) / direction.x;
    let on_wall = origin + direction * to_wall;
    let is_wall = to_wall > 0.0 && on_wall.y.abs() < WALL[0] / 2.0 && (0.0..WALL[1]).contains(&on_wall.z);
    let to_ground = -origin.z / direction.z;
    let is_ground = to_ground > 0.0 && to_ground < GROUND_REACH && (origin + direction * to_ground).x < wall;
    match (is_wall, is_ground) {
        (true, _) => Some(to_wall),
        (false, true) => Some(to_ground),
        (false, false) => None,
    }
}
