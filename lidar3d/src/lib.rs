//! Multi-beam lidars: packets, geometry, intrinsic calibration, and qualitative localisation by signatures.
//!
//! After thesis M. Sensor frame everywhere: x forward (rotation angle 0), y left, z up; M's x is `-y` and M's y is `x`. The
//! points of a Hesai are in its own frame, with y at rotation angle 0 and x to the right, as its drivers have them.
//! Metres and radians. Without the feature `std` the crate needs neither an operating system nor an allocator; the
//! calibration files and the intrinsic calibration are then absent.
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

pub mod calibration;
pub mod cloud;
#[cfg(feature = "clouds")]
pub mod cloud_file;
pub mod geometry;
#[cfg(feature = "std")]
pub mod intrinsic;
mod laser;
#[cfg(feature = "std")]
pub mod mount;
pub mod packet;
pub mod place;
