//! Packets of Hesai's Pandar40P, PandarQT64 and XT32.
//!
//! Frame of these sensors, as their manuals and drivers have it: y at rotation angle 0, x to the right, z up.

mod decode;
mod sensor;
mod view;

pub use decode::Decoder;
pub use sensor::Sensor;
pub use view::{Packet, PacketError};
