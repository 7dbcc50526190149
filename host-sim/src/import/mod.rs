//! Recordings of others.

pub mod carpark;
pub mod sapienza;
mod table;

pub use table::ImportError;
