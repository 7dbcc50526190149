//! Bytes in and values out, and back: what the vehicle's devices say on their wires. No sockets, no drivers, no clock.

pub mod can;
pub mod cola;
pub mod nav350;
