//! The CAN bus: encoders, orders and the published pose.

use core::hint::black_box;

use agv_controller::{
    Bus as ControllerBus, ChangeableSettings, ControllerIdentity, DiscreteLines, Estimate, GyroChip, LineSet, Troubles,
};
use agv_core::localizer::PredictionState;
use agv_core::measurement::{GyroSample, Time};
use agv_core::state::{LaserHealth, Relocalization};
use agv_settings::Settings;
use agv_wire::can::controller_node::ErrorKind;
use agv_wire::can::frame::{Frame, extended_id, standard_id};
use agv_wire::can::slcan;
use embedded_hal::digital::{ErrorKind as PinError, ErrorType, InputPin, OutputPin};
use embedded_hal::i2c;

use super::any;

/// A pin that does anything.
struct AnyPin;

impl ErrorType for AnyPin {
    type Error = PinError;
}

impl OutputPin for AnyPin {
    fn set_low(&mut self) -> Result<(), PinError> {
        any(Ok(()))
    }

    fn set_high(&mut self) -> Result<(), PinError> {
        any(Ok(()))
    }
}

impl InputPin for AnyPin {
    fn is_high(&mut self) -> Result<bool, PinError> {
        any(Ok(true))
    }

    fn is_low(&mut self) -> Result<bool, PinError> {
        any(Ok(true))
    }
}

/// Wires of I2C on which anything is read.
struct AnyWires;

impl i2c::ErrorType for AnyWires {
    type Error = i2c::ErrorKind;
}

impl i2c::I2c for AnyWires {
    fn transaction(&mut self, _: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        for operation in operations {
            if let i2c::Operation::Read(bytes) = operation {
                bytes.fill_with(|| any(0));
            }
        }
        any(Ok(()))
    }
}

/// What takes part in the bus.
pub struct Bus {
    bus: ControllerBus,
    settings: Settings,
    slcan: slcan::Decoder,
    lines: DiscreteLines<AnyPin, AnyPin>,
}

impl Bus {
    pub fn new() -> Self {
        let settings: Settings = any(Settings::default());
        let troubles = Troubles { damaged_parts: any(0), has_panicked: any(false), are_settings_lost: any(false) };
        Self {
            bus: ControllerBus::new(&settings, any(ControllerIdentity::default()), troubles, any(Time::default())),
            settings,
            slcan: slcan::Decoder::new(),
            lines: DiscreteLines::new(LineSet {
                pose_valid: any(Some(AnyPin)),
                within_docking_limits: any(Some(AnyPin)),
                fault: any(Some(AnyPin)),
                standstill: any(Some(AnyPin)),
                reset: any(Some(AnyPin)),
            }),
        }
    }

    /// A frame, a byte of a serial adapter, and what is due.
    pub fn step(&mut self) {
        let time = any(Time::default());
        let id = if any(true) { standard_id(any(0)) } else { extended_id(any(0)) };
        let bytes = any([0; 8]);
        let data = bytes.get(..any(8)).unwrap_or_default();
        let frame = if any(true) { Frame::new(id, data) } else { Frame::remote(id, any(8)) };
        if let Some(frame) = frame {
            self.take(&frame, time);
        }
        if let Some(Ok(message)) = self.slcan.push(any(0)) {
            black_box(message.encode());
            if let slcan::Message::Frame { frame, .. } = message
                && let Some(frame) = frame.classic()
            {
                self.take(frame, time);
            }
        }
        self.bus.poll(time, any(LaserHealth::Unknown), |output| {
            black_box(output);
        });
        let mut gyro = GyroChip::on_i2c(AnyWires, any(false), &self.settings);
        let sample = black_box(&mut gyro).poll(time).ok().flatten().unwrap_or(GyroSample { time, rate: any(0.0) });
        black_box(self.bus.hear_gyro(&sample));
        let inputs = self.lines.poll(any(Some(self.bus.discrete_report(time))).as_ref(), any(time));
        self.bus.hear_lines(&inputs, time);
        black_box(self.lines.make_safe());
        black_box((self.bus.is_standing(time), self.bus.saved(any(true))));
        self.bus.report(any(ErrorKind::Overload), time);
        black_box((self.bus.nodes(), self.bus.other_frames()));
        if let Some(pose) = self.bus.output() {
            let (prediction, relocalization) = (any(PredictionState::default()), any(Relocalization::Idle));
            self.bus.update(&Estimate { answered: any(0), pose: any(pose), prediction, relocalization });
        }
    }

    fn take(&mut self, frame: &Frame, time: Time) {
        self.bus.hear(frame, time, &mut ChangeableSettings::new(&mut self.settings), |output| {
            black_box(output);
        });
    }
}
