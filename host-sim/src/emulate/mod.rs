//! Devices that are not there.

pub mod encoder;
pub mod encoder_pair;
