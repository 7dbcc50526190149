//! The localiser as a whole: what it says of itself, and that nothing from outside can hurt it.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

mod any_event;
mod carried;
mod doubted_laser;
mod drive;
mod faulty_odometry;
mod pose;
mod repeatable;
