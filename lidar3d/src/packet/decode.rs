//! From packets to points.

use super::{Packet, RETURNS, Sensor};
use crate::calibration::Laser;
use crate::geometry::{self, FAR_POINT, Offsets, near_corrections};

/// Most lasers of a sensor.
const LASERS: usize = 64;
/// Hundredths of a degree in a turn.
const TURN: u32 = 36_000;
/// A hundredth of a degree, rad.
const COUNT: f32 = core::f32::consts::TAU / TURN as f32;

/// Returns outside of these distances are false (M 2.3.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// Least corrected distance, m.
    pub near: f32,
    /// Greatest corrected distance, m.
    pub far: f32,
}

impl Default for Filter {
    fn default() -> Self {
        Self { near: 0.9, far: 120.0 }
    }
}

/// One point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// x, y, z, m.
    pub position: [f32; 3],
    /// Angle of the head, 0.01 degrees.
    pub azimuth: u16,
    /// Number of the laser.
    pub laser: u8,
    /// Intensity.
    pub intensity: u8,
}

/// What became of the returns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Points.
    pub points: u64,
    /// Returns in which nothing was seen.
    pub empty: u64,
    /// Nearer than the filter allows.
    pub near: u64,
    /// Farther than the filter allows.
    pub far: u64,
    /// Of a laser that the sensor does not have, or that is not in use.
    pub unused: u64,
}

/// The constants of a laser, as decoding needs them. Without its turn, a point is linear in its distance.
#[derive(Clone, Copy, Default)]
struct Beam {
    distance: f32,
    /// Distance from the axis, and its change with the distance.
    forward: [f32; 2],
    /// Height, and its change with the distance.
    height: [f32; 2],
    horizontal_offset: f32,
    rotation: f32,
    is_enabled: bool,
    /// Corrections at the two near points.
    near: Option<[f64; 2]>,
}

/// An angle by its sine and cosine.
#[derive(Clone, Copy, Default)]
struct Direction {
    sin: f32,
    cos: f32,
}

impl Direction {
    fn of(angle: f32) -> Self {
        let (sin, cos) = libm::sincosf(angle);
        Self { sin, cos }
    }

    /// The sum of two angles.
    fn plus(self, other: Self) -> Self {
        Self { sin: self.sin * other.cos + self.cos * other.sin, cos: self.cos * other.cos - self.sin * other.sin }
    }
}

/// How far the head has turned since the angle of the block when a return is measured.
#[derive(Clone, Copy, Default)]
struct Turned {
    /// 0.01 degrees.
    counts: u32,
    /// With the rotation of the laser in the head, for a block of the upper and one of the lower lasers.
    directions: [Direction; 2],
}

/// Decodes the packets of one sensor.
pub struct Decoder {
    sensor: Sensor,
    filter: Filter,
    resolution: f32,
    beams: [Beam; LASERS],
    tally: Tally,
    /// By the place in the block.
    turned: [Turned; RETURNS],
    /// Hundredths of a degree that the head turns in `step.1` blocks; `turned` is for these.
    step: (u32, u32),
}

impl Decoder {
    /// A decoder; `lasers` are as many as the sensor has. `two_points`: whether the maker's two-point correction is used
    /// where a laser states it.
    #[must_use]
    pub fn new(sensor: Sensor, lasers: &[Laser], offsets: Offsets, two_points: bool, filter: Filter) -> Self {
        let mut beams = [Beam::default(); LASERS];
        for (beam, laser) in beams.iter_mut().zip(lasers) {
            // Both coordinates are linear in the distance.
            let still = Laser { distance: 0.0, rotation: 0.0, horizontal_offset: 0.0, ..*laser };
            let ([forward, _, height], [end, _, top]) =
                (geometry::point(&still, offsets, 0.0, 0.0), geometry::point(&still, offsets, 0.0, 1.0));
            let full = laser.full.filter(|full| two_points && full.has_two_points);
            *beam = Beam {
                distance: laser.distance as f32,
                forward: [forward as f32, (end - forward) as f32],
                height: [height as f32, (top - height) as f32],
                horizontal_offset: laser.horizontal_offset as f32,
                rotation: laser.rotation as f32,
                is_enabled: laser.is_enabled,
                near: full.map(|full| [full.distance_x, full.distance_y]),
            };
        }
        let mut decoder = Self {
            sensor,
            filter,
            resolution: sensor.distance_resolution(),
            beams,
            tally: Tally::default(),
            turned: [Turned::default(); RETURNS],
            step: (0, 1),
        };
        decoder.set_step(0, 1);
        decoder
    }

    /// What became of all returns.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The head turns by `counts` hundredths of a degree in so many blocks.
    fn set_step(&mut self, counts: u32, blocks: u32) {
        self.step = (counts, blocks);
        for (place, turned) in self.turned.iter_mut().enumerate() {
            turned.counts = (counts * self.sensor.firing_permille(place) + 500 * blocks) / (1000 * blocks);
            let angle = turned.counts as f32 * COUNT;
            for (direction, first) in turned.directions.iter_mut().zip([0, RETURNS]) {
                let laser = self.sensor.laser(first > 0, place);
                let rotation = self.beams.get(laser).map_or(0.0, |beam| beam.rotation);
                *direction = Direction::of(angle - rotation);
            }
        }
    }

    /// Calls `take` with each point of a packet, in the order of the returns. The head's speed is the mean one of the
    /// packet.
    pub fn packet(&mut self, packet: &Packet<'_>, mut take: impl FnMut(Point)) {
        if let Some(step) = self.sensor.step(packet).filter(|step| *step != self.step) {
            self.set_step(step.0, step.1);
        }
        let Self { sensor, filter, resolution, ref beams, ref turned, ref mut tally, .. } = *self;
        for block in packet.blocks() {
            let azimuth = u32::from(block.azimuth());
            let head = Direction::of(azimuth as f32 * COUNT);
            let is_lower = block.is_lower();
            for (place, (value, turned)) in block.returns().zip(turned).enumerate() {
                let laser = sensor.laser(is_lower, place);
                let Some(beam) = beams.get(laser).filter(|beam| beam.is_enabled) else {
                    tally.unused += 1;
                    continue;
                };
                if value.distance == 0 {
                    tally.empty += 1;
                    continue;
                }
                let distance = f32::from(value.distance) * resolution + beam.distance;
                if distance < filter.near {
                    tally.near += 1;
                    continue;
                }
                if distance > filter.far {
                    tally.far += 1;
                    continue;
                }
                let at = azimuth + turned.counts;
                let direction = head.plus(turned.directions[usize::from(is_lower)]);
                tally.points += 1;
                take(Point {
                    position: beam.point(direction, distance),
                    azimuth: (if at >= TURN { at - TURN } else { at }) as u16,
                    laser: laser as u8,
                    intensity: value.intensity,
                });
            }
        }
    }
}

impl Beam {
    /// The point at a corrected distance, where the beam looks in a direction.
    fn point(&self, Direction { sin, cos }: Direction, distance: f32) -> [f32; 3] {
        let forward = self.forward[0] + self.forward[1] * distance;
        let offset = self.horizontal_offset;
        let height = self.height[0] + self.height[1] * distance;
        let [x, y, z] = [forward * cos + offset * sin, offset * cos - forward * sin, height];
        let Some(near) = self.near.filter(|_| f64::from(distance) < FAR_POINT) else { return [x, y, z] };
        let far = f64::from(self.distance);
        let [along_x, along_y] =
            near_corrections(far, near, [x, y].map(f64::from)).map(|correction| (correction - far) as f32);
        [x + along_y * self.forward[1] * cos, y - along_x * self.forward[1] * sin, z + along_y * self.height[1]]
    }
}
