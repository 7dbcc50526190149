//! A calibration and its file formats.

use std::string::String;
use std::vec::Vec;

use super::{Laser, db_xml, hesai_csv, ros_yaml};
use crate::packet::Sensor;

/// Parameters of all lasers of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Length of one count of distance, m; None if the file does not state it.
    pub distance_resolution: Option<f64>,
    /// By the number of the laser.
    pub lasers: Vec<Laser>,
}

/// Why a text is no calibration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CalibrationError {
    /// None of the formats.
    #[error("this is no calibration file: {reason}")]
    Foreign {
        /// What the parser says, one line.
        reason: String,
    },
    /// A value is absent or no number.
    #[error("laser {laser}: {name} is absent or no number")]
    Value {
        /// Place in the file, from 0.
        laser: usize,
        /// Name of the value.
        name: &'static str,
    },
    /// The lasers are not numbered from 0 without a gap.
    #[error("the lasers are not numbered from 0 without a gap: {found} stands at place {place}")]
    Numbers {
        /// Place in the file, from 0.
        place: usize,
        /// The number that stands there.
        found: i64,
    },
    /// A sensor with another number of lasers.
    #[error("the calibration is of {found} lasers, the sensor has {wanted}")]
    Count {
        /// Lasers in the file.
        found: usize,
        /// Lasers of the sensor.
        wanted: usize,
    },
    /// A sensor whose lasers point elsewhere, where all sensors of the kind are alike.
    #[error(
        "laser {laser} points {found} hundredths of a degree up by the calibration, {wanted} by the sensor's manual"
    )]
    Elevation {
        /// Number of the laser.
        laser: usize,
        /// Elevation in the file, 0.01 degrees.
        found: i32,
        /// Elevation by the manual, 0.01 degrees.
        wanted: i32,
    },
}

/// By how much a laser may point elsewhere than the manual says, deg: makers adjust to some tenths.
const ELEVATION_TOLERANCE: f64 = 2.0;
/// Two lengths of a count that are one, m.
const RESOLUTION_TOLERANCE: f64 = 1e-6;

impl Calibration {
    /// Reads `db.xml` (degrees, centimetres), ROS YAML (radians, metres) or Hesai's table of angles (degrees), whichever
    /// the text is.
    ///
    /// # Errors
    /// See [`CalibrationError`].
    pub fn read(text: &str) -> Result<Self, CalibrationError> {
        let calibration = if text.trim_start().starts_with('<') {
            db_xml::read(text)
        } else if hesai_csv::is_one(text) {
            hesai_csv::read(text)
        } else {
            ros_yaml::read(text)
        }?;
        let values = calibration.lasers.iter().flat_map(|laser| {
            [laser.distance, laser.elevation, laser.rotation, laser.vertical_offset, laser.horizontal_offset]
        });
        if !values.chain(calibration.distance_resolution).all(f64::is_finite) {
            return Err(CalibrationError::Foreign { reason: "a value is not finite".into() });
        }
        if calibration.distance_resolution.is_some_and(|resolution| resolution <= 0.0) {
            return Err(CalibrationError::Foreign { reason: "a count of distance has no length".into() });
        }
        Ok(calibration)
    }

    /// As `db.xml`.
    #[must_use]
    pub fn to_db_xml(&self) -> String {
        db_xml::write(self)
    }

    /// As ROS YAML. Whether a laser is in use is stated only if one is not.
    #[must_use]
    pub fn to_ros_yaml(&self) -> String {
        ros_yaml::write(self)
    }

    /// Refuses a calibration of another sensor, and states the resolution of this one: that of the manual, and for an
    /// HDL-64E, whose packets do not state what it is, that of the file where it has one.
    ///
    /// # Errors
    /// [`CalibrationError::Count`] and [`CalibrationError::Elevation`]. A `db.xml` of 64 places serves a smaller sensor if
    /// only its lasers are in use.
    pub fn for_sensor(mut self, sensor: Sensor) -> Result<Self, CalibrationError> {
        let found = self.lasers.iter().rposition(|laser| laser.is_enabled).map_or(0, |last| last + 1);
        let wanted = sensor.lasers();
        if found != wanted {
            return Err(CalibrationError::Count { found, wanted });
        }
        let makers = sensor.elevations().unwrap_or_default();
        for (number, (laser, makers)) in self.lasers.iter().zip(makers).enumerate() {
            let elevation = laser.elevation.to_degrees();
            if (elevation - makers).abs() > ELEVATION_TOLERANCE {
                let hundredths = |degrees: f64| (degrees * 100.0).round() as i32;
                let (found, wanted) = (hundredths(elevation), hundredths(*makers));
                return Err(CalibrationError::Elevation { laser: number, found, wanted });
            }
        }
        let stated = self.distance_resolution.filter(|_| sensor == Sensor::Hdl64e);
        self.distance_resolution = Some(stated.unwrap_or(sensor.distance_resolution()));
        self.lasers.truncate(wanted);
        Ok(self)
    }

    /// The resolution that the file states, m, if it is not that of the sensor's manual. Some files are wrong about it.
    #[must_use]
    pub fn other_resolution(&self, sensor: Sensor) -> Option<f64> {
        self.distance_resolution.filter(|stated| (stated - sensor.distance_resolution()).abs() > RESOLUTION_TOLERANCE)
    }

    /// The calibration that all sensors of a kind have, from the maker's papers; None for an HDL-64E. All beams meet in one
    /// point before the axis, and the distance counts from where a beam crosses the axis; both are expressed by offset
    /// and correction as [`Offsets::Orthogonal`](crate::geometry::Offsets) has them.
    #[must_use]
    pub fn of_maker(sensor: Sensor) -> Option<Self> {
        let before = sensor.focal_point()?;
        let laser = |(number, elevation): (usize, &f64)| {
            let elevation = elevation.to_radians();
            Laser {
                distance: -before * elevation.tan() * elevation.sin(),
                elevation,
                rotation: sensor.rotation(number).to_radians(),
                vertical_offset: -before * elevation.sin(),
                is_enabled: true,
                ..Laser::default()
            }
        };
        let lasers = sensor.elevations()?.iter().enumerate().map(laser).collect();
        Some(Self { distance_resolution: Some(sensor.distance_resolution()), lasers })
    }
}
