//! Bytes in and values out, and back: what the vehicle's devices say on their wires. No sockets, no drivers, no clock.
//!
//! | protocol | module |
//! |---|---|
//! | CAN, CANopen, the controller's own frames, serial line adapters | [`can`] |
//! | telegrams of SICK's sensors in two dialects: framing, elements, text | [`cola`] |
//! | the NAV350's telegrams, and a session with it | [`nav350`] |
//!
//! What a value means is said by the crate `agv-core`, which knows no wire.
#![no_std]
#![forbid(unsafe_code)]

pub mod can;
pub mod cola;
pub mod nav350;
