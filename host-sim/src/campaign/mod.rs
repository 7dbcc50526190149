//! What is run for long, with many seeds, to find what no example shows.

pub mod event_fuzz;
