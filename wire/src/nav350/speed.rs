//! What the host says of the vehicle's motion.

use super::{DeviceTime, RotationSpeed, SensorClock, SensorFrame, Velocity};
use crate::cola::{ReadError, Reader, WriteError, Writer};
use agv_core::measurement::Time;

/// Speed of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpeedReport {
    /// Speed along the first axis.
    pub x: Velocity,
    /// Speed along the second axis.
    pub y: Velocity,
    /// Speed of rotation.
    pub rotation: RotationSpeed,
    /// When the speeds were true.
    pub time: DeviceTime,
    /// Whether the axes are those of the layout instead of the sensor's.
    pub is_absolute: bool,
}

impl SpeedReport {
    pub(super) fn read(reader: &mut Reader) -> Result<Self, ReadError> {
        Ok(Self {
            x: Velocity(reader.i16()?),
            y: Velocity(reader.i16()?),
            rotation: RotationSpeed(reader.i32()?),
            time: DeviceTime(reader.u32()?),
            is_absolute: match reader.u8()? {
                0 => false,
                1 => true,
                _ => return Err(ReadError::Value),
            },
        })
    }

    pub(super) fn write(&self, writer: &mut Writer) -> Result<(), WriteError> {
        writer.i16(self.x.0)?;
        writer.i16(self.y.0)?;
        writer.i32(self.rotation.0)?;
        writer.u32_decimal(self.time.0)?;
        writer.u8(self.is_absolute.into())
    }
}

/// Speed of S, along its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSpeed {
    /// When it was true.
    pub time: Time,
    /// Along the first axis, m/s.
    pub x: f64,
    /// Along the second axis, m/s.
    pub y: f64,
    /// Speed of rotation, rad/s, counter-clockwise.
    pub rotation: f64,
}

impl SensorSpeed {
    /// The speed as the sensor is told; None while its clock is not known.
    #[must_use]
    pub fn report(&self, clock: &SensorClock, frame: &SensorFrame) -> Option<SpeedReport> {
        let [x, y, rotation] = frame.speed([self.x, self.y, self.rotation]);
        Some(SpeedReport {
            x: Velocity::from_metres_per_second(x),
            y: Velocity::from_metres_per_second(y),
            rotation: RotationSpeed::from_radians_per_second(rotation),
            time: clock.to_device(self.time)?,
            is_absolute: false,
        })
    }
}
