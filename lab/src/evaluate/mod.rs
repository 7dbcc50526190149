//! Experiments: how good it is, one file an experiment.

pub mod arbitrary_events;
pub mod calibration;
pub mod carpark;
pub mod carpark_starts;
pub mod cloud_drive;
pub mod contour_map;
pub mod contour_worlds;
mod contours;
pub mod demonstration;
pub mod drives;
pub mod falko;
pub mod features;
pub mod gyro;
pub mod halting_points;
pub mod kidnapping;
pub mod levels;
pub mod lidar3d_calibration;
pub mod lidar3d_places;
pub mod lidar3d_sharpness;
mod office_recording;
pub mod places;
pub mod repeatability;
pub mod slam;
pub mod warehouse;
pub mod warehouse_disturbance;
pub mod warehouse_page;
pub mod windows;
