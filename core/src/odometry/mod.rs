//! The vehicle's own account of its motion.

mod bias;
mod coasting;
mod counter;
mod integration;
mod motion;
mod noise;
mod odometer;
mod recent_motion;
mod vehicle;

pub use bias::{BiasJacobian, OdometryBias};
pub use coasting::Coasting;
pub use counter::{CounterRange, CounterRangeError};
pub use integration::{Control, Integration};
pub use motion::Motion;
pub use noise::OdometryNoise;
pub use odometer::{Odometer, OdometryError};
pub use recent_motion::RecentMotion;
pub use vehicle::{Ackermann, Tricycle, Vehicle};
