//! Devices that are not there.

pub mod board;
pub mod encoder;
mod encoder_objects;
pub mod encoder_pair;
pub mod foreign_traffic;
pub mod gyro;
pub mod vehicle;
