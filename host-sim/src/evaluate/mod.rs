//! Experiments: how good it is, one file an experiment.

pub mod accuracy;
pub mod carpark;
pub mod demonstration;
pub mod drive;
pub mod falko;
pub mod lidar3d_calibration;
pub mod lidar3d_places;
pub mod repeatability;
pub mod warehouse;
