//! The localiser on a vehicle's controller.
//!
//! Nothing here is built for a host: `cargo xtask firmware` builds it for the boards.
#![no_std]

#[cfg(target_os = "none")]
pub mod app;
#[cfg(target_os = "none")]
pub mod board;
