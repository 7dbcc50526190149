//! From packets to points.

use super::{Packet, Sensor};
use crate::calibration::Laser;
use crate::geometry::{self, Offsets};

/// Most lasers of a sensor.
const LASERS: usize = 64;
/// Hundredths of a degree in a turn.
const TURN: u32 = 36_000;

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

/// The constants of a laser, as decoding needs them.
#[derive(Clone, Copy, Default)]
struct Beam {
    distance: f32,
    forward: [f32; 2],
    height: [f32; 2],
    sin_rotation: f32,
    cos_rotation: f32,
    horizontal_offset: f32,
    is_enabled: bool,
    has_two_points: bool,
}

/// Decodes the packets of one sensor.
pub struct Decoder<'a> {
    sensor: Sensor,
    lasers: &'a [Laser],
    offsets: Offsets,
    filter: Filter,
    resolution: f32,
    beams: [Beam; LASERS],
    tally: Tally,
    last_step: u32,
}

impl<'a> Decoder<'a> {
    /// A decoder; `lasers` are as many as the sensor has. `two_points`: whether the maker's two-point correction is used
    /// where a laser states it.
    #[must_use]
    pub fn new(sensor: Sensor, lasers: &'a [Laser], offsets: Offsets, two_points: bool, filter: Filter) -> Self {
        let mut beams = [Beam::default(); LASERS];
        for (beam, laser) in beams.iter_mut().zip(lasers) {
            // Both coordinates are linear in the distance.
            let still = Laser { distance: 0.0, rotation: 0.0, horizontal_offset: 0.0, ..*laser };
            let ([forward, _, height], [end, _, top]) =
                (geometry::point(&still, offsets, 0.0, 0.0), geometry::point(&still, offsets, 0.0, 1.0));
            let (sin, cos) = libm::sincos(laser.rotation);
            *beam = Beam {
                distance: laser.distance as f32,
                forward: [forward as f32, (end - forward) as f32],
                height: [height as f32, (top - height) as f32],
                sin_rotation: sin as f32,
                cos_rotation: cos as f32,
                horizontal_offset: laser.horizontal_offset as f32,
                is_enabled: laser.is_enabled,
                has_two_points: two_points && laser.full.is_some_and(|full| full.has_two_points),
            };
        }
        let resolution = sensor.distance_resolution();
        Self { sensor, lasers, offsets, filter, resolution, beams, tally: Tally::default(), last_step: 0 }
    }

    /// What became of all returns.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Calls `take` with each point of a packet, in the order of the returns.
    pub fn packet(&mut self, packet: &Packet<'_>, mut take: impl FnMut(Point)) {
        for (index, block) in packet.blocks().enumerate() {
            let azimuth = u32::from(block.azimuth());
            if let Some(next) = packet.azimuth(index + 1) {
                self.last_step = (u32::from(next) + TURN - azimuth) % TURN;
            }
            let first = if self.sensor == Sensor::Hdl64e && block.is_lower() { 32 } else { 0 };
            let mut turned = u32::MAX;
            let (mut sin_head, mut cos_head) = (0.0, 1.0);
            for (position, value) in block.returns().enumerate() {
                let laser = if self.sensor == Sensor::Vlp16 { position % 16 } else { first + position };
                let Some(beam) = self.beams.get(laser).filter(|beam| beam.is_enabled) else {
                    self.tally.unused += 1;
                    continue;
                };
                if value.distance == 0 {
                    self.tally.empty += 1;
                    continue;
                }
                let measured = f32::from(value.distance) * self.resolution;
                let distance = measured + beam.distance;
                if distance < self.filter.near {
                    self.tally.near += 1;
                    continue;
                }
                if distance > self.filter.far {
                    self.tally.far += 1;
                    continue;
                }
                let step = self.last_step * self.sensor.firing_permille(position) / 1000;
                let at = (azimuth + step) % TURN;
                if at != turned {
                    turned = at;
                    (sin_head, cos_head) = head(at);
                }
                let position = if beam.has_two_points
                    && let Some(laser) = self.lasers.get(laser)
                {
                    let angle = f64::from(at) * (core::f64::consts::TAU / f64::from(TURN));
                    geometry::point_with_two_points(laser, self.offsets, angle, f64::from(measured))
                        .map(|value| value as f32)
                } else {
                    let forward = beam.forward[0] + beam.forward[1] * distance;
                    let sin = sin_head * beam.cos_rotation - cos_head * beam.sin_rotation;
                    let cos = cos_head * beam.cos_rotation + sin_head * beam.sin_rotation;
                    let offset = beam.horizontal_offset;
                    let height = beam.height[0] + beam.height[1] * distance;
                    [forward * cos + offset * sin, offset * cos - forward * sin, height]
                };
                self.tally.points += 1;
                take(Point { position, azimuth: at as u16, laser: laser as u8, intensity: value.intensity });
            }
        }
    }
}

/// Sine and cosine of an angle of the head, 0.01 degrees.
fn head(azimuth: u32) -> (f32, f32) {
    libm::sincosf(azimuth as f32 * (core::f32::consts::TAU / TURN as f32))
}
