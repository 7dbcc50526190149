//! Bytes of a packet and what they say.

mod decode;
mod sensor;
mod status;
mod view;

pub use decode::{Decoder, Filter, Point, Tally};
pub use sensor::Sensor;
#[cfg(feature = "std")]
pub use status::calibration_from_stream;
pub use status::{STATUS_CYCLE, Tail};
pub use view::{BLOCKS, Block, LENGTH, PORT, Packet, PacketError, RETURNS, Return, counts_between};
