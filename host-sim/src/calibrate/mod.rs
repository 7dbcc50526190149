//! Calibration from a log: windows of motion, encoder faults, the closed forms of the core and a joint nonlinear fit.

pub mod causes;
pub mod closed_form;
pub mod counted;
mod counting_direction;
pub mod design;
pub mod drive;
pub mod found;
pub mod innovation_noise;
pub mod joint;
mod least_squares;
pub mod log_input;
pub mod model;
pub mod noise;
pub mod odometry_path;
pub mod plan;
mod propagation;
pub mod reflector_noise;
pub mod refusal;
pub mod report;
pub mod standstill;
pub mod stops;
pub mod surveyed_map;
pub mod tracking;
pub mod vehicle_file;
mod whitening;
pub mod window;
pub mod windows;
