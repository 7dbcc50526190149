//! A sensor as its metadata state it.

use super::Profile;
use crate::laser::Laser;

/// Most pixels of a column.
pub const PIXELS: usize = 128;

/// A sensor as its metadata state it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Profile of its packets.
    pub profile: Profile,
    /// UDP port to which it sends, if it states one.
    pub port: Option<u16>,
    /// Columns of a turn.
    pub columns_per_frame: u16,
    /// Columns of a packet.
    pub columns_per_packet: usize,
    /// Pixels of a column; as many of the angles count.
    pub pixels: usize,
    /// Elevation of each beam, up is positive, deg.
    pub altitudes: [f64; PIXELS],
    /// Rotation of each beam from the encoder's angle, clockwise, deg.
    pub azimuths: [f64; PIXELS],
    /// How far ahead and how far above the origin of the lidar frame the beams begin, m.
    pub beam_origin: [f64; 2],
    /// The lidar frame in the sensor's: three rows of rotation and place, m.
    pub lidar_to_sensor: [[f64; 4]; 3],
}

impl Sensor {
    /// Bytes of a column.
    pub(super) fn column_length(&self) -> usize {
        let profile = self.profile;
        profile.column_header() + self.pixels * profile.pixel() + profile.column_footer()
    }

    /// Bytes of a packet.
    #[must_use]
    pub fn packet_length(&self) -> usize {
        2 * self.profile.packet_header() + self.columns_per_packet * self.column_length()
    }

    /// Where each beam looks, as the calibration of another sensor states it.
    pub fn lasers(&self) -> impl Iterator<Item = Laser> {
        self.altitudes.iter().zip(&self.azimuths).take(self.pixels).map(|(altitude, azimuth)| Laser {
            elevation: altitude.to_radians(),
            rotation: -azimuth.to_radians(),
            is_enabled: true,
            ..Laser::default()
        })
    }
}
