//! Which sensor it is, and with which parameters its packets are decoded.

use std::path::{Path, PathBuf};

use agv_lidar3d::calibration::{Calibration, CalibrationError, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{Decoder, Filter, Sensor};

use super::survey::Survey;
use crate::text_file::{self, TextFileError};

/// What somebody states about a sensor.
#[derive(Clone, Debug, Default)]
pub struct SetupOptions {
    /// Its kind; None to take it from the packets.
    pub sensor: Option<Sensor>,
    /// Its calibration file.
    pub calibration: Option<PathBuf>,
    /// How the offsets of its beams are measured.
    pub offsets: Offsets,
    /// Whether the maker's two-point correction is used where a laser states it.
    pub two_points: bool,
    /// Returns outside are false.
    pub filter: Filter,
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
    /// The packets do not state what sends them.
    #[error("the packets do not state which sensor sends them; name it with --sensor")]
    UnknownSensor,
    /// An HDL-64E whose calibration is nowhere.
    #[error(
        "an HDL-64E needs its calibration, and the {packets} packets do not carry a whole one; name a file with --calibration"
    )]
    NoCalibration {
        /// Packets that there are.
        packets: usize,
    },
}

/// A sensor with its parameters.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Kind of sensor.
    pub sensor: Sensor,
    /// Its lasers.
    pub lasers: Vec<Laser>,
    /// How their offsets are measured.
    pub offsets: Offsets,
    /// Whether the maker's two-point correction is used.
    pub two_points: bool,
    /// Returns outside are false.
    pub filter: Filter,
}

/// Reads a calibration file of any kind.
///
/// # Errors
/// See [`SetupError`].
pub fn read_calibration(path: &Path) -> Result<Calibration, SetupError> {
    let text = text_file::read(path, "a calibration file (db.xml or YAML)")?;
    Calibration::read(&text).map_err(|problem| SetupError::Calibration { path: path.to_owned(), problem })
}

impl Setup {
    /// From what is stated and what the packets say: an HDL-64E brings its calibration in its packets, the others are all
    /// alike.
    ///
    /// # Errors
    /// See [`SetupError`].
    pub fn new(options: &SetupOptions, survey: &Survey) -> Result<Self, SetupError> {
        let sensor = options.sensor.or(survey.sensor).ok_or(SetupError::UnknownSensor)?;
        let lasers = match (&options.calibration, sensor.elevations()) {
            (Some(path), _) => {
                let calibration = read_calibration(path)?.for_lasers(sensor.lasers());
                calibration.map_err(|problem| SetupError::Calibration { path: path.clone(), problem })?.lasers
            }
            (None, Some(elevations)) => {
                let laser =
                    |elevation: &f64| Laser { elevation: elevation.to_radians(), is_enabled: true, ..Laser::default() };
                elevations.iter().map(laser).collect()
            }
            (None, None) => match &survey.calibration {
                Some(calibration) => calibration.lasers.clone(),
                None => return Err(SetupError::NoCalibration { packets: survey.packets }),
            },
        };
        Ok(Self { sensor, lasers, offsets: options.offsets, two_points: options.two_points, filter: options.filter })
    }

    /// A decoder of its packets.
    #[must_use]
    pub fn decoder(&self) -> Decoder {
        Decoder::new(self.sensor, &self.lasers, self.offsets, self.two_points, self.filter)
    }
}
