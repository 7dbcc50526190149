//! Drives of the profile CiA 402 as sources of odometry: what of their process data tells how far and how fast they turn.
//!
//! A drive belongs to the controller of the vehicle. So it is only listened to: it is neither set up nor started here.

use super::canopen::{NodeId, transmit_pdo_id};
use super::drive_unit::FrameSignal;
use super::pdo::{MappingEntry, PdoMapping};
use super::sdo::Object;
use super::signal::{ByteOrder, Signal};

/// Status word, 16 bits.
pub const STATUS_WORD: Object = Object::new(0x6041, 0);
/// Position actual value, 32 bits in two's complement, in position units of the drive.
pub const POSITION: Object = Object::new(0x6064, 0);
/// Velocity actual value, 32 bits in two's complement, in velocity units of the drive.
pub const VELOCITY: Object = Object::new(0x606C, 0);

/// The transmit PDOs in which a drive tells position and velocity unless it was told otherwise, each behind its status word
/// (CiA 402-3, "Transmit PDOs").
pub const POSITION_PDO: u8 = 3;
/// The same for the velocity.
pub const VELOCITY_PDO: u8 = 4;
/// Bytes of the status word.
const STATUS_BYTES: u8 = 2;

/// What stands in the PDO of the position.
#[must_use]
pub fn position_mapping() -> PdoMapping {
    let mut mapping = PdoMapping::new();
    mapping.push(MappingEntry { object: STATUS_WORD, bits: 8 * STATUS_BYTES });
    mapping.push(MappingEntry { object: POSITION, bits: 32 });
    mapping
}

/// The velocity of a drive in m/s, of which one unit of the drive is `scale`.
#[must_use]
pub fn velocity(node: NodeId, scale: f64) -> FrameSignal {
    let signal = Signal {
        first_byte: STATUS_BYTES,
        length: 4,
        order: ByteOrder::LittleEndian,
        is_signed: true,
        scale,
        offset: 0.0,
    };
    FrameSignal { id: transmit_pdo_id(node, VELOCITY_PDO), signal }
}
