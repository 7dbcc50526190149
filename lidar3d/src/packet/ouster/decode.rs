//! From packets to points.

use core::f64::consts::TAU;

use super::profile::Place;
use super::{PIXELS, Sensor};
use crate::packet::{Filter, Point, ReturnKind, Tally, rings};

/// Hundredths of a degree in a turn.
const TURN: u32 = 36_000;

/// Why bytes are no packet of this sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "std", derive(thiserror::Error))]
pub enum PacketError {
    /// Not as long as its metadata say.
    #[cfg_attr(feature = "std", error("a packet of this sensor has {wanted} bytes, this one {found}"))]
    Length {
        /// Bytes that were given.
        found: usize,
        /// Bytes of a packet.
        wanted: usize,
    },
    /// A column that the turn does not have.
    #[cfg_attr(feature = "std", error("column {found} of a turn of {columns}"))]
    Column {
        /// What the packet states.
        found: u16,
        /// Columns of a turn.
        columns: u16,
    },
}

/// Where a beam looks in the lidar frame.
#[derive(Clone, Copy, Default)]
struct Beam {
    /// Sine and cosine of the altitude.
    altitude: [f64; 2],
    /// Rotation from the encoder's angle, counter-clockwise, rad.
    rotation: f64,
    ring: u8,
}

/// Decodes the packets of one sensor.
pub struct Decoder {
    sensor: Sensor,
    filter: Filter,
    beams: [Beam; PIXELS],
    /// Distance from the lidar's origin to where the beams begin, m.
    offset: f64,
    /// Angle of the lidar frame in the sensor's, clockwise, 0.01 degrees.
    yaw: u32,
    tally: Tally,
}

/// What the pixels of a column have in common.
#[derive(Clone, Copy)]
struct Column<'a> {
    pixels: &'a [u8],
    /// Encoder's angle, counter-clockwise, rad.
    encoder: f64,
    /// Angle in the sensor's frame, clockwise, 0.01 degrees.
    azimuth: u16,
    /// After the first column of the packet, ns.
    time: i32,
}

impl Decoder {
    /// A decoder.
    #[must_use]
    pub fn new(sensor: Sensor, filter: Filter) -> Self {
        let rings: [u8; PIXELS] = rings(sensor.altitudes.iter().take(sensor.pixels).map(|altitude| Some(*altitude)));
        let mut beams = [Beam::default(); PIXELS];
        for ((beam, laser), ring) in beams.iter_mut().zip(sensor.lasers()).zip(rings) {
            *beam = Beam { altitude: libm::sincos(laser.elevation).into(), rotation: laser.rotation, ring };
        }
        let [ahead, above] = sensor.beam_origin;
        let [[cos, ..], [sin, ..], _] = sensor.lidar_to_sensor;
        let yaw = (-libm::atan2(sin, cos)).to_degrees() * 100.0;
        let yaw = (libm::round(yaw) as i32).rem_euclid(TURN as i32) as u32;
        Self { sensor, filter, beams, offset: libm::hypot(ahead, above), yaw, tally: Tally::default() }
    }

    /// What became of all returns.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// Nanoseconds of the first column of a packet, as the sensor counts them; None for bytes that are too few.
    #[must_use]
    pub fn time(&self, bytes: &[u8]) -> Option<u64> {
        Some(u64::from_le_bytes(*bytes.get(self.sensor.profile.packet_header()..)?.first_chunk()?))
    }

    /// Calls `take` with each point of a packet, column by column; first the strongest return of a pixel, then the second
    /// one.
    ///
    /// # Errors
    /// See [`PacketError`]; nothing of such a packet is decoded.
    pub fn packet(&mut self, bytes: &[u8], mut take: impl FnMut(Point)) -> Result<(), PacketError> {
        let wanted = self.sensor.packet_length();
        if bytes.len() != wanted {
            return Err(PacketError::Length { found: bytes.len(), wanted });
        }
        let header = self.sensor.profile.packet_header();
        let first = self.time(bytes).unwrap_or(0);
        let body = bytes.get(header..).unwrap_or_default();
        let length = self.sensor.column_length();
        let columns = || body.chunks_exact(length).take(self.sensor.columns_per_packet).map(|bytes| self.stated(bytes));
        let columns_per_frame = self.sensor.columns_per_frame;
        if let Some((found, ..)) = columns().flatten().find(|(number, _, _)| *number >= columns_per_frame) {
            return Err(PacketError::Column { found, columns: columns_per_frame });
        }
        for place in 0..self.sensor.columns_per_packet {
            let Some(bytes) = body.get(place * length..(place + 1) * length) else { continue };
            let Some((number, time, pixels)) = self.stated(bytes) else { continue };
            let share = f64::from(number) / f64::from(columns_per_frame);
            let turned = u32::from(number) * TURN / u32::from(columns_per_frame);
            let column = Column {
                pixels,
                encoder: TAU * (1.0 - share),
                azimuth: ((turned + self.yaw) % TURN) as u16,
                time: i32::try_from(time.wrapping_sub(first)).unwrap_or(i32::MAX),
            };
            self.column(column, &mut take);
        }
        Ok(())
    }

    /// Number, time, and the bytes of the pixels of a column; None if the sensor did not fill it.
    fn stated<'a>(&self, bytes: &'a [u8]) -> Option<(u16, u64, &'a [u8])> {
        let profile = self.sensor.profile;
        let time = u64::from_le_bytes(*bytes.first_chunk()?);
        let number = u16::from_le_bytes(*bytes.get(8..)?.first_chunk()?);
        let pixels = bytes.get(profile.column_header()..)?;
        let is_valid =
            if profile.column_footer() > 0 { *bytes.last_chunk()? == [0xFF; 4] } else { bytes.get(10)? & 1 == 1 };
        is_valid.then_some((number, time, pixels))
    }

    fn column(&mut self, column: Column<'_>, take: &mut impl FnMut(Point)) {
        let profile = self.sensor.profile;
        let (first, second) = profile.places();
        let (mask, millimetres) = profile.range();
        let axis = libm::sincos(column.encoder).into();
        let is_legacy = profile.column_footer() > 0;
        let value = |pixel: &[u8], place: Place| {
            let range = u32::from_le_bytes(*pixel.get(place.range..)?.first_chunk()?) & mask;
            let [low, high] = *pixel.get(place.reflectivity..)?.first_chunk()?;
            Some((range * millimetres, u16::from_le_bytes([low, if is_legacy { high } else { 0 }])))
        };
        for row in 0..self.sensor.pixels {
            let at = row * profile.pixel();
            let Some(pixel) = column.pixels.get(at..at + profile.pixel()) else { continue };
            let Some(one) = value(pixel, first) else { continue };
            let other = second.and_then(|place| value(pixel, place));
            let is_same = other.is_some_and(|other| other.0 == one.0);
            let kind = if is_same { ReturnKind::Both } else { ReturnKind::Strongest };
            self.pixel(column, axis, row, (one, kind), take);
            match other {
                Some((range, _)) if is_same && range > 0 => self.tally.equal += 1,
                Some(other) => self.pixel(column, axis, row, (other, ReturnKind::SecondStrongest), take),
                None => {}
            }
        }
    }

    /// One return: its range, mm, and its reflectivity.
    fn pixel(
        &mut self,
        column: Column<'_>,
        axis: [f64; 2],
        row: usize,
        ((range, intensity), kind): ((u32, u16), ReturnKind),
        take: &mut impl FnMut(Point),
    ) {
        let Self { filter, offset, ref beams, ref sensor, ref mut tally, .. } = *self;
        let Some(beam) = beams.get(row) else { return };
        let distance = 0.001 * f64::from(range);
        if range == 0 {
            tally.empty += 1;
        } else if (distance as f32) < filter.near {
            tally.near += 1;
        } else if distance as f32 > filter.far {
            tally.far += 1;
        } else {
            tally.points += 1;
            take(Point {
                position: placed(sensor, beam.point(sensor.beam_origin, (column.encoder, axis), distance - offset)),
                time: column.time,
                intensity,
                azimuth: column.azimuth,
                laser: row as u8,
                ring: beam.ring,
                kind,
            });
        }
    }
}

impl Beam {
    /// The point at a distance from where the beam begins, in the lidar frame, m. `axis` has sine and cosine of the
    /// encoder's angle.
    fn point(&self, [ahead, above]: [f64; 2], (encoder, axis): (f64, [f64; 2]), distance: f64) -> [f64; 3] {
        let [sin_altitude, cos_altitude] = self.altitude;
        let (sin, cos) = libm::sincos(encoder + self.rotation);
        let level = distance * cos_altitude;
        [level * cos + ahead * axis[1], level * sin + ahead * axis[0], distance * sin_altitude + above]
    }
}

/// A point of the lidar frame in the sensor's.
fn placed(sensor: &Sensor, [x, y, z]: [f64; 3]) -> [f32; 3] {
    sensor.lidar_to_sensor.map(|[a, b, c, place]| (a * x + b * y + c * z + place) as f32)
}
