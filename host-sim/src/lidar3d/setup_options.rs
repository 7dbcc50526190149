//! What somebody states about a sensor, and why that does not do.

use std::net::IpAddr;
use std::path::PathBuf;

use agv_lidar3d::calibration::CalibrationError;
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{Sensor, ouster};

use super::kind::Kind;
use crate::text_file::{self, TextFileError};

/// What somebody states about a sensor.
#[derive(Clone, Debug, Default)]
pub struct SetupOptions {
    /// Its kind, where the packets do not state it.
    pub sensor: Option<Sensor>,
    /// Its calibration file; of an Ouster, its metadata.
    pub calibration: Option<PathBuf>,
    /// UDP port of a capture; None for that of the first packet of a sensor.
    pub port: Option<u16>,
    /// Address from which the sensor sends, of a capture; None for that of the first packet of a sensor.
    pub address: Option<IpAddr>,
    /// How the offsets of its beams are measured.
    pub offsets: Offsets,
    /// Whether the maker's two-point correction is used where a laser states it.
    pub two_points: bool,
    /// Returns nearer than this are false, m; None for what the kind of sensor needs.
    pub near: Option<f32>,
    /// Returns farther than this are false, m; None for what the kind of sensor needs.
    pub far: Option<f32>,
}

/// Why packets cannot be decoded.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The calibration file cannot be read.
    #[error(transparent)]
    File(#[from] TextFileError),
    /// The calibration file is none, or is of another sensor.
    #[error("{}: {problem}", path.display())]
    Calibration {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: CalibrationError,
    },
    /// The metadata of an Ouster are none.
    #[error("{}: {problem}", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: ouster::MetadataError,
    },
    /// The packets do not state what sends them.
    #[error("the packets do not state which sensor sends them; name it with --sensor")]
    UnknownSensor,
    /// The packets state another sensor than somebody did.
    #[error("the packets are of a {}, not of a {}", found.name(), stated.name())]
    OtherSensor {
        /// What somebody stated.
        stated: Sensor,
        /// What the packets state.
        found: Kind,
    },
    /// A sensor whose calibration is nowhere.
    #[error(
        "a {} needs its calibration, and the {packets} packets do not carry a whole one; name a file with --calibration",
        kind.name()
    )]
    NoCalibration {
        /// The sensor.
        kind: Kind,
        /// Packets that there are.
        packets: usize,
    },
}

impl SetupOptions {
    /// What an Ouster states about itself, if the calibration file is that: its name ends in .json.
    ///
    /// # Errors
    /// See [`SetupError`].
    pub fn ouster(&self) -> Result<Option<ouster::Sensor>, SetupError> {
        let is_json = |path: &&PathBuf| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        let Some(path) = self.calibration.as_ref().filter(is_json) else { return Ok(None) };
        let text = text_file::read(path, "the metadata of an Ouster (JSON)")?;
        let sensor = ouster::Sensor::read(&text);
        sensor.map(Some).map_err(|problem| SetupError::Metadata { path: path.clone(), problem })
    }
}
