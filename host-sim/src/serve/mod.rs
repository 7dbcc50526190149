//! Emulated sensors.

pub mod nav350;
