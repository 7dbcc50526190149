//! Bytes of a packet and what they say.

mod decode;
pub mod hesai;
pub mod ouster;
mod point;
mod sensor;
mod status;
mod view;

pub use decode::{Decoder, Model};
pub(crate) use point::rings;
pub use point::{Filter, Point, ReturnKind, Tally};
pub use sensor::{OtherSensor, Sensor};
pub use status::{ReturnMode, STATUS_CYCLE, Tail};
pub use view::{BLOCKS, Block, LENGTH, PORT, Packet, PacketError, RETURNS, Return, counts_between};
