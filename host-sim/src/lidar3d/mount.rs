//! Where a multi-beam lidar is on its vehicle, by the floor and by a drive with an odometry.

use std::f64::consts::TAU;

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::Time;
use agv_lidar3d::cloud::{Cloud, RingOrder};
use agv_lidar3d::mount::{Attitude, FloorStand, HandEye, Known, Motion, attitude, hand_eye};
use nalgebra::{Rotation3, Vector3};

use super::revolution::Revolution;
use super::scan_motion::Target;
use super::wall_points::{WallPoint, wall_points};
use crate::recording::{Truth, truth_at};

/// A revolution is kept once the vehicle has moved so far since the last one, m, or turned so much, rad.
const WAY: f64 = 0.8;
const TURN: f64 = 0.25;
/// Revolutions that are kept at the most, and rings of them.
const KEPT: usize = 400;
const RINGS: usize = 16;
/// Points that are aligned, about.
const POINTS: usize = 6000;
/// How far a surface may be off at the beginning of an alignment, m.
const GATE: f64 = 0.5;
/// Heights above the floor that count, m: below is what the floor's roughness reaches.
const LOWEST: f64 = 0.2;
/// Farthest points that count, m.
const FARTHEST: f64 = 40.0;
/// Points are moved to where they are seen from at the beginning of their revolution, which takes the mount; so often it is
/// found anew.
const ROUNDS: usize = 4;
/// Motions from which the heading is found first, and directions of the way that are tried.
const FIRST: usize = 12;
const DIRECTIONS: u32 = 8;

/// A point, when it was measured after the beginning of its revolution, s.
type Timed = ([f32; 3], f32);

/// A revolution that is kept.
struct Key {
    start: Time,
    pose: Pose,
    rings: Vec<Vec<Timed>>,
    stand: Option<FloorStand>,
}

/// What a drive tells of the mount of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// By the floor; None if none was found.
    pub attitude: Option<Attitude>,
    /// By the drive; None if it is too short.
    pub drive: Option<HandEye>,
    /// Revolutions that were used.
    pub revolutions: usize,
}

/// Collects the revolutions of a drive.
pub struct MountFinder<'a> {
    order: RingOrder,
    odometry: &'a [Truth],
    height: Option<f64>,
    keys: Vec<Key>,
}

impl<'a> MountFinder<'a> {
    /// Of a sensor with such rings, on a vehicle that was there by its odometry. `height` is that of the sensor above the
    /// floor, m, if somebody knows it.
    #[must_use]
    pub fn new(order: RingOrder, odometry: &'a [Truth], height: Option<f64>) -> Self {
        Self { order, odometry, height, keys: Vec::new() }
    }

    /// Takes a revolution, with its beginning in the time of the odometry; whether it was kept.
    pub fn add(&mut self, revolution: &Revolution, start: Time) -> bool {
        let Some(pose) = truth_at(self.odometry, start) else { return false };
        let is_far = |last: &Key| {
            let way = last.pose.between(&pose);
            way.x.hypot(way.y) >= WAY || way.theta.abs() >= TURN
        };
        if self.keys.len() >= KEPT || self.keys.last().is_some_and(|last| !is_far(last)) {
            return false;
        }
        // All points as one ring: in an organised cloud the nearer of two stays, which lies above the floor more often than below.
        let points: Vec<Option<[f32; 3]>> = revolution.points.iter().map(|point| Some(point.position)).collect();
        let stand = Cloud::new(&points, 1).and_then(|cloud| FloorStand::find(&cloud, self.height));
        self.keys.push(Key { start, pose, rings: rings(revolution, self.order.rings()), stand });
        true
    }

    /// The mount, by all that was taken.
    #[must_use]
    pub fn find(&self) -> Mount {
        let stands: Vec<FloorStand> = self.keys.iter().filter_map(|key| key.stand).collect();
        let found = attitude(&stands);
        let (levelling, height) = found.map_or((Rotation3::identity(), self.height), |found| {
            (Rotation3::from_euler_angles(found.roll, found.pitch, 0.0), Some(found.height))
        });
        let mut drive = None;
        let mut mount = Pose::new(0.0, 0.0, 0.0);
        for round in 0..ROUNDS {
            let walls: Vec<Vec<WallPoint>> =
                self.keys.iter().map(|key| self.walls(key, &levelling, height, &mount)).collect();
            let motions = if round == 0 { self.first_motions(&walls) } else { self.motions(&walls, &mount) };
            drive = hand_eye(&motions);
            let Some(found) = drive else { break };
            let value = |known: Option<Known>, before: f64| known.map_or(before, |known| known.value);
            mount = Pose::new(value(found.x, mount.x), value(found.y, mount.y), value(found.yaw, mount.theta));
        }
        Mount { attitude: found, drive, revolutions: self.keys.len() }
    }

    /// The upright surfaces of a revolution, levelled, as they are seen from where it began.
    fn walls(&self, key: &Key, levelling: &Rotation3<f64>, height: Option<f64>, mount: &Pose) -> Vec<WallPoint> {
        let place = |(position, time): &Timed| {
            let [x, y, z] = (levelling * Vector3::from(position.map(f64::from))).into();
            if *time == 0.0 {
                return [x, y, z];
            }
            // Beyond the last pose of the odometry the vehicle is taken to stand.
            let then = truth_at(self.odometry, key.start.offset(f64::from(*time))).unwrap_or(key.pose);
            let moved = mount.between(&key.pose.between(&then).compose(mount));
            let seen = moved.transform(&Point::new(x, y));
            [seen.x, seen.y, z]
        };
        let rings: Vec<Vec<[f64; 3]>> = key.rings.iter().map(|ring| ring.iter().map(place).collect()).collect();
        let least = height.map_or(f64::MIN, |height| LOWEST - height);
        wall_points(&rings, POINTS, |[x, y, z]| *z > least && x.hypot(*y) < FARTHEST)
    }

    /// Motions from each revolution to the next one, where the mount is known nearly.
    fn motions(&self, walls: &[Vec<WallPoint>], mount: &Pose) -> Vec<Motion> {
        let pairs = self.keys.windows(2).zip(walls.windows(2));
        let motion = |(keys, points): (&[Key], &[Vec<WallPoint>])| {
            let way = keys[0].pose.between(&keys[1].pose);
            let start = mount.between(&way.compose(mount));
            let seen = Target::new(points[0].clone())?.align(&points[1], &start, GATE)?;
            Some(motion(&seen.pose, &way))
        };
        pairs.filter_map(motion).collect()
    }

    /// The same of some of them where nothing is known of the mount: the way may lie in any direction.
    fn first_motions(&self, walls: &[Vec<WallPoint>]) -> Vec<Motion> {
        let step = self.keys.len().div_ceil(FIRST).max(1);
        let pairs = self.keys.windows(2).zip(walls.windows(2)).step_by(step);
        let motion = |(keys, points): (&[Key], &[Vec<WallPoint>])| {
            let way = keys[0].pose.between(&keys[1].pose);
            let (target, length) = (Target::new(points[0].clone())?, way.x.hypot(way.y));
            let start = |number: u32| {
                let (sin, cos) = libm::sincos(TAU * f64::from(number) / f64::from(DIRECTIONS));
                Pose::new(length * cos, length * sin, way.theta)
            };
            let ends = (0..DIRECTIONS).filter_map(|number| target.align(&points[1], &start(number), GATE));
            Some(motion(&ends.max_by_key(|end| end.agreeing)?.pose, &way))
        };
        pairs.filter_map(motion).collect()
    }
}

fn motion(seen: &Pose, way: &Pose) -> Motion {
    Motion { sensor: [seen.x, seen.y], vehicle: [way.x, way.y], turn: seen.theta, odometry_turn: way.theta }
}

/// The points of some rings, each in the order in which it was measured.
fn rings(revolution: &Revolution, count: usize) -> Vec<Vec<Timed>> {
    let step = count.div_ceil(RINGS).max(1);
    let mut rings = vec![Vec::new(); count.div_ceil(step)];
    for point in revolution.points.iter().filter(|point| usize::from(point.ring).is_multiple_of(step)) {
        if let Some(ring) = rings.get_mut(usize::from(point.ring) / step) {
            ring.push((point.position, 1e-9 * point.time as f32));
        }
    }
    rings
}
