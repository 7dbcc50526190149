//! Rate gyros that send their rates by themselves.

use super::drive_unit::FrameSignal;
use super::frame::{Frame, Id, extended_id, standard_id};
use super::signal::{ByteOrder, Signal};
use agv_core::measurement::{GyroSample, Time};

/// Where a gyro's rates are: whole numbers in two's complement, lowest byte first, one behind the other for its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroFrame {
    /// Identifier of its frames.
    pub identifier: u32,
    /// Whether the identifier has 29 bits.
    pub is_extended: bool,
    /// Where the rate about the first axis begins, bytes.
    pub first_byte: u8,
    /// Bytes of a rate: 2 or 4.
    pub length: u8,
    /// Which axis points up or down: 1, 2 or 3.
    pub axis: u8,
    /// Rate of one step, rad/s.
    pub unit: f64,
}

impl GyroFrame {
    /// Node 32 of a CANopen bus, whose first process data are the rates about x, y and z with 16 bits, in hundredths of a
    /// degree a second.
    pub const USUAL: Self = Self {
        identifier: 0x1A0,
        is_extended: false,
        first_byte: 0,
        length: 2,
        axis: 3,
        unit: 0.01 * core::f64::consts::PI / 180.0,
    };

    /// The identifier.
    #[must_use]
    pub const fn id(&self) -> Id {
        if self.is_extended { extended_id(self.identifier) } else { standard_id(self.identifier as u16) }
    }

    /// Where the rate about the vertical axis is.
    #[must_use]
    pub const fn signal(&self) -> FrameSignal {
        let axes_before = self.axis.saturating_sub(1);
        let first_byte = self.first_byte.saturating_add(axes_before.saturating_mul(self.length));
        let (scale, offset) = (self.unit, 0.0);
        let order = ByteOrder::LittleEndian;
        FrameSignal {
            id: self.id(),
            signal: Signal { first_byte, length: self.length, order, is_signed: true, scale, offset },
        }
    }

    /// The frame of a rate about the vertical axis, rad/s, as nearly as its steps tell it; the largest that they can if it is larger.
    /// The other axes tell nothing. None if the rate has no place in a frame.
    #[must_use]
    pub fn encode(&self, rate: f64) -> Option<Frame> {
        let mut data = [0; super::frame::CLASSIC_LENGTH];
        self.signal().signal.put(rate, &mut data)?;
        Frame::new(self.id(), &data)
    }
}

/// A gyro on the bus.
#[derive(Clone, Copy, Debug)]
pub struct Gyro {
    rate: FrameSignal,
}

impl Gyro {
    /// A gyro with such frames.
    #[must_use]
    pub const fn new(frame: &GyroFrame) -> Self {
        Self { rate: frame.signal() }
    }

    /// Takes a frame that was heard at that time; gives a sample if it holds the rate. One that is not later than the one
    /// before is told as it is: the localiser says so.
    #[must_use]
    pub fn handle(&self, frame: &Frame, heard: Time) -> Option<GyroSample> {
        self.rate.value(frame).map(|rate| GyroSample { time: heard, rate })
    }
}
