//! Parameters of each laser, and the files that carry them.

#[cfg(feature = "std")]
mod db_xml;
#[cfg(feature = "std")]
mod file;
#[cfg(feature = "std")]
mod hesai_csv;
#[cfg(feature = "std")]
mod ros_yaml;
#[cfg(feature = "std")]
mod stream;

#[cfg(feature = "std")]
pub use file::{Calibration, CalibrationError};
#[cfg(feature = "std")]
pub use stream::calibration_from_stream;

pub use crate::laser::{Full, Laser};
