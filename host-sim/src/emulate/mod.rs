//! Devices that are not there.

pub mod encoder;
