//! What a vehicle is told on commissioning.
//!
//! [`Settings`] is a tree of named leaves ([`leaf`]), kept in flash one item a leaf ([`store`]) and spoken of over the
//! service port ([`service`]). The firmware and the commands of a desktop share this crate.
#![no_std]
#![forbid(unsafe_code)]

mod bus_load;
mod checksum;
pub mod contour_store;
mod contradiction;
mod gyro_connection;
mod laser;
pub mod leaf;
mod leaves;
mod map_identity;
pub mod patient_flash;
pub mod service;
mod settings;
pub mod store;
mod vehicle;

pub use bus_load::bus_load;
pub use contradiction::{Cause, Contradiction};
/// For whoever has nothing else to do until a store has done its work.
pub use embassy_futures::block_on;
pub use gyro_connection::GyroConnection;
pub use laser::{LaserMode, LaserOrientation, LaserSettings};
pub use leaves::LEAVES;
pub use map_identity::map_identity;
pub use settings::{EncoderNode, Network, Nodes, Settings};
pub use vehicle::{VehicleKind, VehicleSettings, WheelSettings};
