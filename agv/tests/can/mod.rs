//! CAN on a host: buses, recordings, emulated encoders, and what programs of others make of our frames.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod candump;
mod description;
mod encoders;
mod objects;
mod record;
mod sdo_server;
mod slcan;
