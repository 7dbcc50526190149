//! Calibration: on a real tricycle, and in simulation.

pub mod course;
pub mod optiodom;
pub mod sapienza;
pub mod simulated;
pub mod thesis;
