//! Calibration from a log: windows of motion, encoder faults, the closed forms of the core and a joint nonlinear fit.

pub mod closed_form;
pub mod counted;
pub mod joint;
mod least_squares;
pub mod model;
pub mod noise;
pub mod window;
pub mod windows;
