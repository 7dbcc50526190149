//! The vehicle's controller without its hardware: frames of the bus and bytes of the laser go in; frames, bytes and poses
//! come out. Times are passed in.
//!
//! | part | what it does | on a vehicle |
//! |---|---|---|
//! | [`Encoders`] | sets the encoders up, watches them, and makes events of what they, or the vehicle's own controller, and other controllers say | in the bus's task |
//! | [`Gyro`] | makes events of what a gyro says | in the bus's task |
//! | [`GyroChip`] | makes the same of what a gyro on SPI or I2C says | in a task of its own |
//! | [`Bus`] | all that the bus hears and says: [`Encoders`], [`Gyro`], the controller's own node, the pose for now | the bus's task |
//! | [`DiscreteLines`] | wires that say whether the pose may be used, and that tell of standstill and reset | in the bus's task, or beside it |
//! | [`Laser`] | the session with the laser, and whether it can be used | the network's task |
//! | [`Localization`] | the localiser, and the search for a pose that it does not have | the main loop |
//! | [`Controller`] | all of them as one value, one after the other | a desktop, in simulated time |
//!
//! A board runs the parts at three priorities and passes events of the bus ([`Told`]), revolutions,
//! [`Estimate`]s and what was published ([`SentPose`]) between them.
#![no_std]
#![forbid(unsafe_code)]

mod bus;
mod carried_map;
mod controller;
mod discrete;
mod encoders;
mod gyro;
mod gyro_chip;
mod laser;
mod localization;
mod progress;
mod setting_objects;
mod standstill;

pub use bus::{Bus, BusOutput, ControllerIdentity, MOTIONS, Troubles};
pub use carried_map::carried_map;
pub use controller::{Controller, LaserOrder, TELEGRAM};
pub use discrete::{DEBOUNCE, DiscreteInputs, DiscreteLines, DiscreteOutputs, DiscreteReport, Line, LineSet};
pub use encoders::{BusEvent, EncoderNodes, EncoderOutput, Encoders, channels, counted};
pub use gyro::Gyro;
pub use gyro_chip::{GyroChip, GyroChipError};
pub use laser::Laser;
pub use localization::{Estimate, Localization};
pub use progress::{Progress, SentPose, Told};
pub use setting_objects::{ChangeableSettings, SettingObjects, data_type, object_of};
pub use standstill::Standstill;
