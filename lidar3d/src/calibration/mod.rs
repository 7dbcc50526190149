//! Parameters of each laser, and the files that carry them.

#[cfg(feature = "std")]
mod db_xml;
#[cfg(feature = "std")]
mod file;
#[cfg(feature = "std")]
mod hesai_csv;
mod laser;
#[cfg(feature = "std")]
mod ros_yaml;

#[cfg(feature = "std")]
pub use file::{Calibration, CalibrationError};
pub use laser::{Full, Laser};
