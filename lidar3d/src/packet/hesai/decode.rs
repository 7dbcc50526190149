//! From packets to points.

use super::{Packet, Sensor};
use crate::laser::Laser;
use crate::packet::{Filter, Point, ReturnKind, Tally, rings};

/// Most lasers of a sensor.
const LASERS: usize = 64;
/// A hundredth of a degree, rad.
const COUNT: f32 = core::f32::consts::TAU / 36_000.0;

/// Where a laser looks.
#[derive(Clone, Copy, Default)]
struct Beam {
    /// Sine and cosine of the elevation.
    elevation: [f32; 2],
    /// Sine and cosine of the rotation in the head, clockwise.
    rotation: [f32; 2],
    is_enabled: bool,
    ring: u8,
}

/// Decodes the packets of one sensor.
pub struct Decoder {
    sensor: Sensor,
    filter: Filter,
    beams: [Beam; LASERS],
    tally: Tally,
}

impl Decoder {
    /// A decoder; `lasers` are as many as the sensor has, of which elevation and rotation are used.
    #[must_use]
    pub fn new(sensor: Sensor, lasers: &[Laser], filter: Filter) -> Self {
        let rings: [u8; LASERS] = rings(lasers.iter().map(|laser| laser.is_enabled.then_some(laser.elevation)));
        let mut beams = [Beam::default(); LASERS];
        for ((beam, laser), ring) in beams.iter_mut().zip(lasers).zip(rings) {
            let direction = |angle: f64| <[f64; 2]>::from(libm::sincos(angle)).map(|value| value as f32);
            let (elevation, rotation) = (direction(laser.elevation), direction(-laser.rotation));
            *beam = Beam { elevation, rotation, is_enabled: laser.is_enabled, ring };
        }
        Self { sensor, filter, beams, tally: Tally::default() }
    }

    /// What became of all returns.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Calls `take` with each point of a packet, in the order of the returns. Whether the packet is of this sensor;
    /// nothing of another's is decoded.
    pub fn packet(&mut self, packet: &Packet<'_>, mut take: impl FnMut(Point)) -> bool {
        if packet.sensor() != self.sensor {
            return false;
        }
        let (_, second) = packet.kinds();
        let returns = if second.is_some() { 2 } else { 1 };
        let resolution = packet.distance_resolution();
        let Self { sensor, filter, ref beams, ref mut tally } = *self;
        for block in 0..packet.blocks() {
            let Some(azimuth) = packet.azimuth(block) else { continue };
            let (sin, cos) = libm::sincosf(f32::from(azimuth) * COUNT);
            for (laser, beam) in beams.iter().enumerate().take(sensor.lasers()) {
                let Some(value) = packet.one(block, laser) else { continue };
                let distance = f32::from(value.distance) * resolution;
                let kind = kind(packet, block, laser);
                match (kind, beam.is_enabled) {
                    (_, false) => tally.unused += 1,
                    _ if value.distance == 0 => tally.empty += 1,
                    (None, _) => tally.equal += 1,
                    _ if distance < filter.near => tally.near += 1,
                    _ if distance > filter.far => tally.far += 1,
                    (Some(kind), true) => {
                        tally.points += 1;
                        take(Point {
                            position: beam.point([sin, cos], distance),
                            time: sensor.time(block, laser, returns),
                            intensity: u16::from(value.intensity),
                            azimuth,
                            laser: laser as u8,
                            ring: beam.ring,
                            kind,
                        });
                    }
                }
            }
        }
        true
    }
}

/// Which of the returns of its firing a return is; None if it is the one before again.
fn kind(packet: &Packet<'_>, block: usize, laser: usize) -> Option<ReturnKind> {
    let (first, second) = packet.kinds();
    let Some(second) = second else { return Some(first) };
    let own = packet.one(block, laser)?;
    let is_second = !block.is_multiple_of(2);
    let other = packet.one(if is_second { block - 1 } else { block + 1 }, laser)?;
    match (is_second, other.distance == own.distance) {
        (true, true) => None,
        (true, false) => Some(second),
        (false, is_equal) => Some(if is_equal || other.distance == 0 { ReturnKind::Both } else { first }),
    }
}

impl Beam {
    /// The point at a distance, where the head looks in a direction given by sine and cosine.
    fn point(&self, [sin, cos]: [f32; 2], distance: f32) -> [f32; 3] {
        let ([sin_rotation, cos_rotation], [sin_elevation, cos_elevation]) = (self.rotation, self.elevation);
        let level = distance * cos_elevation;
        let (right, ahead) = (sin * cos_rotation + cos * sin_rotation, cos * cos_rotation - sin * sin_rotation);
        [level * right, level * ahead, distance * sin_elevation]
    }
}
