//! Which sensor it is, and with which parameters its packets are decoded.

use std::path::{Path, PathBuf};

use agv_lidar3d::calibration::{Calibration, CalibrationError, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{Filter, Sensor, ouster};

use super::kind::Kind;
use super::survey::Survey;
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

/// A sensor with its parameters.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Kind of sensor.
    pub kind: Kind,
    /// Its lasers.
    pub lasers: Vec<Laser>,
    /// Length of one count of distance of a Velodyne, m; other packets state it.
    pub resolution: f64,
    /// How the offsets of the beams are measured.
    pub offsets: Offsets,
    /// Whether the maker's two-point correction is used.
    pub two_points: bool,
    /// Returns outside are false.
    pub filter: Filter,
    /// What an Ouster states about itself.
    pub ouster: Option<Box<ouster::Sensor>>,
    /// What is strange about the calibration file, one line.
    pub warning: Option<String>,
}

/// Reads a calibration file of any kind.
///
/// # Errors
/// See [`SetupError`].
pub fn read_calibration(path: &Path) -> Result<Calibration, SetupError> {
    let text = text_file::read(path, "a calibration file (db.xml, YAML or CSV)")?;
    Calibration::read(&text).map_err(|problem| SetupError::Calibration { path: path.to_owned(), problem })
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

    /// The kind of sensor, which must be that of the packets where they state it.
    fn kind(&self, survey: &Survey) -> Result<Kind, SetupError> {
        match (self.sensor, survey.kind) {
            (Some(stated), Some(found)) if found != Kind::Velodyne(stated) => {
                Err(SetupError::OtherSensor { stated, found })
            }
            (Some(stated), _) => Ok(Kind::Velodyne(stated)),
            (None, found) => found.ok_or(SetupError::UnknownSensor),
        }
    }
}

impl Setup {
    /// From what is stated and what the packets say: an HDL-64E brings its calibration in its packets, a Hesai and an
    /// Ouster need theirs, and the others are all alike.
    ///
    /// # Errors
    /// See [`SetupError`].
    pub fn new(options: &SetupOptions, survey: &Survey) -> Result<Self, SetupError> {
        if let Some(sensor) = options.ouster()? {
            let lasers = sensor.lasers().collect();
            return Ok(Self { ouster: Some(Box::new(sensor)), ..Self::bare(options, Kind::Ouster, lasers) });
        }
        let kind = options.kind(survey)?;
        match kind {
            Kind::Velodyne(sensor) => Self::of_velodyne(options, survey, sensor),
            Kind::Hesai(sensor) => {
                let path = options.calibration.as_ref();
                let path = path.ok_or(SetupError::NoCalibration { kind, packets: survey.packets })?;
                let lasers = read_calibration(path)?.lasers;
                let (found, wanted) = (lasers.len(), sensor.lasers());
                if found != wanted {
                    let problem = CalibrationError::Count { found, wanted };
                    return Err(SetupError::Calibration { path: path.clone(), problem });
                }
                Ok(Self::bare(options, kind, lasers))
            }
            Kind::Ouster | Kind::Cloud => Err(SetupError::NoCalibration { kind, packets: survey.packets }),
        }
    }

    /// Of point clouds with such rings.
    #[must_use]
    pub fn of_clouds(options: &SetupOptions, lasers: Vec<Laser>) -> Self {
        Self::bare(options, Kind::Cloud, lasers)
    }

    fn of_velodyne(options: &SetupOptions, survey: &Survey, sensor: Sensor) -> Result<Self, SetupError> {
        let kind = Kind::Velodyne(sensor);
        let no_calibration = SetupError::NoCalibration { kind, packets: survey.packets };
        let mut warning = None;
        let calibration = match &options.calibration {
            Some(path) => {
                let calibration = read_calibration(path)?;
                warning = calibration.other_resolution(sensor).map(|stated| {
                    let used = if sensor == Sensor::Hdl64e { stated } else { sensor.distance_resolution() };
                    format!(
                        "{}: states {:.1} mm a count, a {} has {:.1} mm by its manual; {:.1} mm is used",
                        path.display(),
                        1e3 * stated,
                        sensor.name(),
                        1e3 * sensor.distance_resolution(),
                        1e3 * used
                    )
                });
                let calibration = calibration.for_sensor(sensor);
                calibration.map_err(|problem| SetupError::Calibration { path: path.clone(), problem })?
            }
            None => Calibration::of_maker(sensor).or(survey.calibration.clone()).ok_or(no_calibration)?,
        };
        let resolution = calibration.distance_resolution.unwrap_or(sensor.distance_resolution());
        Ok(Self { resolution, warning, ..Self::bare(options, kind, calibration.lasers) })
    }

    /// With what does not hang on the kind of file.
    fn bare(options: &SetupOptions, kind: Kind, lasers: Vec<Laser>) -> Self {
        let filter = kind.filter();
        Self {
            kind,
            lasers,
            resolution: Sensor::Hdl64e.distance_resolution(),
            offsets: options.offsets,
            two_points: options.two_points,
            filter: Filter { near: options.near.unwrap_or(filter.near), far: options.far.unwrap_or(filter.far) },
            ouster: None,
            warning: None,
        }
    }
}
