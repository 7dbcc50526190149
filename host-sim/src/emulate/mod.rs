//! Devices that are not there.

pub mod board;
pub mod encoder;
mod encoder_objects;
pub mod encoder_pair;
pub mod foreign_traffic;
mod sdo_server;
pub mod vehicle;
