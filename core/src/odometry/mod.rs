//! The vehicle's own account of its motion.

mod ackermann;
mod bias;
mod coasting;
mod counter;
mod increments;
mod integration;
mod kinematics;
mod motion;
mod noise;
mod odometer;
mod recent_motion;
mod tricycle;
mod vehicle;

pub use ackermann::Ackermann;
pub use bias::{BiasJacobian, OdometryBias};
pub use coasting::Coasting;
pub use counter::{CounterRange, CounterRangeError};
pub use increments::Increments;
pub use integration::{Control, Integration};
pub use kinematics::{Believed, Kinematics, Step};
pub use motion::Motion;
pub use noise::OdometryNoise;
pub use odometer::{Odometer, OdometerParameters, OdometryError, VehicleOdometer};
pub use recent_motion::RecentMotion;
pub use tricycle::Tricycle;
pub use vehicle::Vehicle;
