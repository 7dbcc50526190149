//! Points from the datagrams of any sensor.

use agv_lidar3d::packet::{Decoder, Model, Point, Tally, hesai, ouster};

use super::kind::{Datagram, Kind};
use super::setup::Setup;

/// Decodes the datagrams of one sensor.
pub enum AnyDecoder {
    /// Of a Velodyne.
    Velodyne(Box<Decoder>),
    /// Of a Hesai.
    Hesai(Box<hesai::Decoder>),
    /// Of an Ouster.
    Ouster(Box<ouster::Decoder>),
}

impl AnyDecoder {
    /// Of a sensor.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        match (setup.kind, &setup.ouster) {
            (_, Some(sensor)) => Self::Ouster(Box::new(ouster::Decoder::new((**sensor).clone(), setup.filter))),
            (Kind::Hesai(sensor), _) => Self::Hesai(Box::new(hesai::Decoder::new(sensor, &setup.lasers, setup.filter))),
            (kind, _) => {
                // An Ouster is described, or it is no setup; point clouds need no decoder.
                let sensor = match kind {
                    Kind::Velodyne(sensor) => sensor,
                    Kind::Hesai(_) | Kind::Ouster | Kind::Cloud => agv_lidar3d::packet::Sensor::Hdl64e,
                };
                let model = Model {
                    sensor,
                    lasers: &setup.lasers,
                    distance_resolution: setup.resolution,
                    offsets: setup.offsets,
                    two_points: setup.two_points,
                };
                Self::Velodyne(Box::new(Decoder::new(&model, setup.filter)))
            }
        }
    }

    /// Calls `take` with each point of a datagram; one of another sensor has none. Whether it was of this one.
    pub fn datagram(&mut self, datagram: &Datagram<'_>, take: impl FnMut(Point)) -> bool {
        match (self, datagram) {
            (Self::Velodyne(decoder), Datagram::Velodyne(packet)) => decoder.packet(packet, take).is_ok(),
            (Self::Hesai(decoder), Datagram::Hesai(packet)) => decoder.packet(packet, take),
            (Self::Ouster(decoder), Datagram::Ouster(bytes)) => decoder.packet(bytes, take).is_ok(),
            _ => false,
        }
    }

    /// What became of all returns.
    #[must_use]
    pub fn tally(&self) -> Tally {
        match self {
            Self::Velodyne(decoder) => decoder.tally(),
            Self::Hesai(decoder) => decoder.tally(),
            Self::Ouster(decoder) => decoder.tally(),
        }
    }
}
