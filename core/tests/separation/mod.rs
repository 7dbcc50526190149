//! The solutions that bound the error of a pose, against dense algebra with numerical derivatives, and the level in drives whose
//! truth is known.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

mod creep;
mod drive;
mod envelope;
mod late_clock;
mod level;
mod sensor_information;
mod solution;
