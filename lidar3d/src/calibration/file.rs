//! A calibration and its two file formats.

use std::string::String;
use std::vec::Vec;

use super::{Laser, db_xml, ros_yaml};

/// Parameters of all lasers of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Length of one count of distance, m.
    pub distance_resolution: f64,
    /// By the number of the laser.
    pub lasers: Vec<Laser>,
}

/// Why a text is no calibration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CalibrationError {
    /// Neither of the formats.
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
}

impl Calibration {
    /// Reads `db.xml` (degrees, centimetres) or ROS YAML (radians, metres), whichever the text is.
    ///
    /// # Errors
    /// See [`CalibrationError`].
    pub fn read(text: &str) -> Result<Self, CalibrationError> {
        let calibration = if text.trim_start().starts_with('<') { db_xml::read(text) } else { ros_yaml::read(text) }?;
        let values = calibration.lasers.iter().flat_map(|laser| {
            [laser.distance, laser.elevation, laser.rotation, laser.vertical_offset, laser.horizontal_offset]
        });
        if !values.chain([calibration.distance_resolution]).all(f64::is_finite) {
            return Err(CalibrationError::Foreign { reason: "a value is not finite".into() });
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

    /// Refuses a calibration of another sensor.
    ///
    /// # Errors
    /// [`CalibrationError::Count`]. A `db.xml` of 64 places serves a smaller sensor if only its lasers are in use.
    pub fn for_lasers(mut self, wanted: usize) -> Result<Self, CalibrationError> {
        let found = self.lasers.iter().rposition(|laser| laser.is_enabled).map_or(0, |last| last + 1);
        if found != wanted {
            return Err(CalibrationError::Count { found, wanted });
        }
        self.lasers.truncate(wanted);
        Ok(self)
    }
}
