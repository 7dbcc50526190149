//! The CAN bus: literal bytes, properties, and state machines against a scripted node.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

mod bit_timing;
mod book;
mod canopen;
mod controller;
mod controller_node;
mod drive_unit;
mod encoder;
mod frames;
mod group;
mod gyro;
mod motion_frames;
mod node;
mod plausibility;
mod report_clock;
mod slcan;
mod stored_parameters;
