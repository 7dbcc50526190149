//! Experiments: how good it is, one file an experiment.

pub mod accuracy;
pub mod calibration;
pub mod carpark;
pub mod demonstration;
pub mod drive;
pub mod falko;
pub mod halting_points;
pub mod repeatability;
pub mod warehouse;
