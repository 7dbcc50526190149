//! Bytes and what they mean: protocols of sensors, without sockets and without a clock.

pub mod cola;
pub mod nav350;
