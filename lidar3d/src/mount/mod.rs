//! Where a multi-beam lidar is on a vehicle: height, roll and pitch by the floor, heading and place by a drive.

mod attitude;
mod hand_eye;

pub use attitude::{Attitude, FloorStand, attitude};
pub use hand_eye::{HandEye, Known, Motion, hand_eye};
