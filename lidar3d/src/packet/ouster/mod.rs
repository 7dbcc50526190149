//! Packets of Ouster's sensors, which state themselves in a JSON beside the packets.
//!
//! Frame: the sensor's, as the maker defines it: x ahead, away from the plug, y left, z up, from the middle of the base.

mod decode;
#[cfg(feature = "std")]
mod metadata;
mod profile;
mod sensor;

pub use decode::{Decoder, PacketError};
#[cfg(feature = "std")]
pub use metadata::MetadataError;
pub use profile::Profile;
pub use sensor::{PIXELS, Sensor};
