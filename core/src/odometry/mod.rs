//! The vehicle's own account of its motion.

mod counter;
mod vehicle;

pub use counter::CounterRange;
pub use vehicle::{Ackermann, Tricycle, Vehicle};
