//! What the vehicle does, on any board.

pub mod announced_flash;
pub mod bus;
pub mod can_port;
pub mod capacities;
pub mod exchange;
pub mod gyro;
pub mod laser;
pub mod localize;
pub mod log_stream;
pub mod service;
pub mod settings;
pub mod shared_settings;
pub mod supervision;
pub mod throttle;
