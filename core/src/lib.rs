//! Localisation of automated guided vehicles.
//!
//! Everything that the vehicle computes and nothing that it touches: events go in, outputs come out. The crate has no
//! allocator, no clock and no input or output, and every loop in it is bounded, so the same code gives the same bits on
//! a desktop and on a controller.
//!
//! Rooms, floor by floor; a room imports only from floors below its own:
//!
//! | floor | rooms |
//! |---|---|
//! | 7 | [`record`] |
//! | 6 | [`localizer`] |
//! | 5 | [`integrity`] |
//! | 4 | [`calibration`], [`filter`], [`relocalization`], [`state`] |
//! | 3 | [`maps`], [`odometry`], [`sensing`] |
//! | 2 | [`measurement`] |
//! | 1 | [`geometry`], [`order`] |
//!
//! Frames: W world, R robot (logical point: the projection of the driving wheel's centre on the rear axle), S sensor.
//! Units: SI and radians. Poses and covariances are f64, scans and features f32.
//!
//! Equation numbers with `K` are those of F. Kallasi, "FALKO features and AGV localisation" (thesis, Parma, 2016).
#![no_std]
#![forbid(unsafe_code)]

pub mod calibration;
pub mod filter;
pub mod geometry;
pub mod integrity;
pub mod localizer;
pub mod maps;
pub mod measurement;
pub mod odometry;
pub mod order;
pub mod record;
pub mod relocalization;
pub mod sensing;
pub mod state;
