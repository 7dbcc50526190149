//! Devices that are not there.

pub mod board;
pub mod encoder;
pub mod encoder_pair;
pub mod foreign_traffic;
pub mod vehicle;
