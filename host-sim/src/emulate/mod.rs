//! Devices that are not there.

pub mod board;
pub mod drive;
pub mod encoder;
mod encoder_objects;
pub mod foreign_traffic;
pub mod gyro;
pub mod motion;
pub mod own_controller;
pub mod run_delay;
pub mod vehicle;
