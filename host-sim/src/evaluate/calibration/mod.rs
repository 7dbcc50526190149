//! Calibration: on a real tricycle, and in simulation.

pub mod sapienza;
