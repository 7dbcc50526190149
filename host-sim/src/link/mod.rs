//! Connections to sensors.

pub mod clock;
pub mod nav350;
