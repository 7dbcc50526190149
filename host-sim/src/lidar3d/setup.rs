//! Which sensor it is, and with which parameters its packets are decoded.

use std::path::Path;

use agv_lidar3d::calibration::{Calibration, CalibrationError, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{Filter, Sensor, ouster};

use super::kind::Kind;
use super::setup_options::{SetupError, SetupOptions};
use super::survey::Survey;
use crate::text_file;

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

/// The kind of sensor, which must be that of the packets where they state it.
fn kind(options: &SetupOptions, survey: &Survey) -> Result<Kind, SetupError> {
    match (options.sensor, survey.kind) {
        (Some(stated), Some(found)) if found != Kind::Velodyne(stated) => {
            Err(SetupError::OtherSensor { stated, found })
        }
        (Some(stated), _) => Ok(Kind::Velodyne(stated)),
        (None, found) => found.ok_or(SetupError::UnknownSensor),
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
        let kind = kind(options, survey)?;
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
