//! What the vehicle's own controller says of its motion: speed and steering angle, or pose increments.

use agv_core::geometry::Pose;
use agv_core::measurement::{PoseIncrement, SpeedSample, Time};

use super::drive_unit::{DriveUnit, FrameSignal};
use super::frame::{CLASSIC_LENGTH, Frame, Id, extended_id, standard_id};
use super::report_clock::ReportClock;
use super::signal::{ByteOrder, Signal};

/// Where a number is on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Identifier of the frames.
    pub identifier: u32,
    /// Where the number begins, bytes.
    pub first_byte: u8,
    /// How many bytes it has, 1 to 8.
    pub length: u8,
    /// Value of one step.
    pub unit: f64,
    /// Value of zero.
    pub offset: f64,
}

/// Where the frames of the vehicle's own controller say how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionFrames {
    /// Speed, m/s, positive forward.
    pub speed: Place,
    /// Steering angle, rad, positive to the left.
    pub angle: Place,
    /// The displacement since the frame before, in R at the start of the interval: x (m), y (m) and heading (rad), one
    /// behind the other in one frame. Its unit is that of x and y.
    pub increment: Place,
    /// Turn of one step of an increment, rad.
    pub increment_turn: f64,
    /// Whether identifiers have 29 bits.
    pub are_extended: bool,
    /// Whether the highest byte of a number comes first (Motorola).
    pub are_big_endian: bool,
    /// Whether numbers are in two's complement.
    pub are_signed: bool,
}

impl MotionFrames {
    /// Speed and steering angle in the first process data of node 33, increments in those of node 34: 16 bits each, in mm/s,
    /// tenths of a milliradian, and tenths of a millimetre.
    pub const USUAL: Self = {
        let speed = Place { identifier: 0x1A1, first_byte: 0, length: 2, unit: 1e-3, offset: 0.0 };
        Self {
            speed,
            angle: Place { first_byte: 2, unit: 1e-4, ..speed },
            increment: Place { identifier: 0x1A2, unit: 1e-4, ..speed },
            increment_turn: 1e-4,
            are_extended: false,
            are_big_endian: false,
            are_signed: true,
        }
    };

    const fn id(&self, place: &Place) -> Id {
        if self.are_extended { extended_id(place.identifier) } else { standard_id(place.identifier as u16) }
    }

    const fn at(&self, place: &Place) -> FrameSignal {
        let order = if self.are_big_endian { ByteOrder::BigEndian } else { ByteOrder::LittleEndian };
        let Place { first_byte, length, unit: scale, offset, .. } = *place;
        let signal = Signal { first_byte, length, order, is_signed: self.are_signed, scale, offset };
        FrameSignal { id: self.id(place), signal }
    }

    /// Where x, y and heading of an increment are.
    fn increments(&self) -> [FrameSignal; 3] {
        let of = |number: u8, unit: f64| {
            let behind = number.saturating_mul(self.increment.length);
            let first_byte = self.increment.first_byte.saturating_add(behind);
            self.at(&Place { first_byte, unit, offset: 0.0, ..self.increment })
        };
        [of(0, self.increment.unit), of(1, self.increment.unit), of(2, self.increment_turn)]
    }

    /// Identifiers of the frames with speed and angle.
    #[must_use]
    pub const fn speed_ids(&self) -> [Id; 2] {
        [self.id(&self.speed), self.id(&self.angle)]
    }

    /// Identifier of the frames with increments.
    #[must_use]
    pub const fn increment_id(&self) -> Id {
        self.id(&self.increment)
    }

    /// The frames that say a speed (m/s) and a steering angle (rad), the angle first: one if both are in the same. None if a
    /// number has no place in its frame.
    #[must_use]
    pub fn encode_speed(&self, speed: f64, angle: f64) -> Option<[Option<Frame>; 2]> {
        let [speed, angle] = [(self.at(&self.speed), speed), (self.at(&self.angle), angle)];
        if speed.0.id == angle.0.id {
            return Some([frame(&[speed, angle]), None]).filter(|frames| frames.iter().any(Option::is_some));
        }
        Some([Some(frame(&[angle])?), Some(frame(&[speed])?)])
    }

    /// The frame that says an increment. None if a number has no place in it.
    #[must_use]
    pub fn encode_increment(&self, displacement: &Pose) -> Option<Frame> {
        let [x, y, turn] = self.increments();
        frame(&[(x, displacement.x), (y, displacement.y), (turn, displacement.theta)])
    }

    /// An increment as it comes out of a frame, what is less than a step left out.
    #[must_use]
    pub fn rounded(&self, displacement: &Pose) -> Pose {
        let to = |value: f64, unit: f64| libm::round(value / unit) * unit;
        let Place { unit, .. } = self.increment;
        Pose {
            x: to(displacement.x, unit),
            y: to(displacement.y, unit),
            theta: to(displacement.theta, self.increment_turn),
        }
    }
}

/// The frame with those numbers, all of one identifier.
fn frame(numbers: &[(FrameSignal, f64)]) -> Option<Frame> {
    let mut data = [0; CLASSIC_LENGTH];
    for (place, value) in numbers {
        place.signal.put(*value, &mut data)?;
    }
    Frame::new(numbers.first()?.0.id, &data)
}

/// A controller that tells speed and steering angle.
#[derive(Clone, Copy, Debug)]
pub struct SpeedReports {
    unit: DriveUnit,
    clock: ReportClock,
}

/// A steering angle older than so many periods is not used.
const OLDEST_ANGLE: f64 = 2.5;

impl SpeedReports {
    /// Reports in such frames every `period` seconds.
    #[must_use]
    pub const fn new(frames: &MotionFrames, period: f64) -> Self {
        let unit = DriveUnit::new(frames.at(&frames.speed), frames.at(&frames.angle), OLDEST_ANGLE * period);
        Self { unit, clock: ReportClock::new(period) }
    }

    /// Takes a frame that was heard at that time; gives a sample if it holds the speed and the angle is known.
    pub fn handle(&mut self, frame: &Frame, heard: Time) -> Option<SpeedSample> {
        let sample = self.unit.handle(frame, heard)?;
        Some(SpeedSample { time: self.clock.time(heard), ..sample })
    }
}

/// A controller that tells how far the vehicle has moved since its report before.
#[derive(Clone, Copy, Debug)]
pub struct IncrementReports {
    places: [FrameSignal; 3],
    clock: ReportClock,
}

impl IncrementReports {
    /// Reports in such frames every `period` seconds.
    #[must_use]
    pub fn new(frames: &MotionFrames, period: f64) -> Self {
        Self { places: frames.increments(), clock: ReportClock::new(period) }
    }

    /// Takes a frame that was heard at that time; gives an increment if it holds one.
    pub fn handle(&mut self, frame: &Frame, heard: Time) -> Option<PoseIncrement> {
        let [x, y, theta] = &self.places;
        let displacement = Pose { x: x.value(frame)?, y: y.value(frame)?, theta: theta.value(frame)? };
        Some(PoseIncrement { time: self.clock.time(heard), displacement })
    }
}
