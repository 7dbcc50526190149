//! What a sensor said, and when it was true.

mod encoder;
mod encoder_fault;
mod gyro;
mod laser_id;
mod pose_fix;
mod reflectors;
mod scan;
mod time;
mod wheels;

pub use encoder::{EncoderSample, PoseIncrement, SpeedSample};
pub use encoder_fault::{EncoderFault, EncoderFaults};
pub use gyro::GyroSample;
pub use laser_id::{LASERS, LaserId, LaserIdError};
pub use pose_fix::PoseFix;
pub use reflectors::{ReflectorObservation, Reflectors};
pub use scan::{Scan, ScanHead};
pub use time::Time;
pub use wheels::{MOST_WHEELS, WheelReading, WheelSample};
