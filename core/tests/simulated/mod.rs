//! Drives of every kind of vehicle at every rate, with ticks of every size, in every way of driving: the truth is kept apart.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

mod holonomic;
mod kind;
mod matrix;
mod odometry;
mod outages;
mod run;
mod simulator;
mod stored_state;
mod turning;
