//! Which sensor sends a datagram.

use agv_lidar3d::packet::{self, Filter, PORT, Packet, PacketError, hesai, ouster};

/// A kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A Velodyne.
    Velodyne(packet::Sensor),
    /// A Hesai.
    Hesai(hesai::Sensor),
    /// An Ouster, which its metadata describe.
    Ouster,
    /// Of whatever sensor, as point clouds.
    Cloud,
}

impl Kind {
    /// Name, as the maker writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velodyne(sensor) => sensor.name(),
            Self::Hesai(sensor) => sensor.name(),
            Self::Ouster => "Ouster",
            Self::Cloud => "point clouds",
        }
    }

    /// Distances that are believed if nobody says otherwise.
    #[must_use]
    pub const fn filter(self) -> Filter {
        match self {
            Self::Velodyne(sensor) => sensor.filter(),
            Self::Hesai(sensor) => sensor.filter(),
            Self::Ouster => Filter { near: 0.1, far: 500.0 },
            Self::Cloud => Filter::ALL,
        }
    }
}

/// The packet of a sensor in a datagram.
pub enum Datagram<'a> {
    /// Of a Velodyne.
    Velodyne(Packet<'a>),
    /// Of a Hesai.
    Hesai(hesai::Packet<'a>),
    /// Of the Ouster that was described.
    Ouster(&'a [u8]),
}

impl<'a> Datagram<'a> {
    /// The packet in a datagram to a port. An Ouster is looked for only if it is described, and then nothing else. An
    /// error says what is wrong with a datagram that comes near; None is of something else.
    ///
    /// # Errors
    /// One line.
    pub fn recognise(bytes: &'a [u8], port: u16, ouster: Option<&ouster::Sensor>) -> Result<Option<Self>, String> {
        if let Some(ouster) = ouster {
            return Ok((bytes.len() == ouster.packet_length()).then_some(Self::Ouster(bytes)));
        }
        if let Ok(packet) = hesai::Packet::new(bytes) {
            return Ok(Some(Self::Hesai(packet)));
        }
        match Packet::new(bytes) {
            Ok(packet) => Ok(Some(Self::Velodyne(packet))),
            Err(PacketError::Length { .. }) if port != PORT => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    }
}
