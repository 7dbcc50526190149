//! A gyro on SPI or I2C, of a vehicle that has one: a BMI160 of Bosch (data sheet BST-BMI160-DS000, 1.0).

use agv_core::measurement::{GyroSample, Time};
use agv_settings::Settings;
use bmi160::interface::{I2cInterface, ReadData, SpiInterface, WriteData};
use bmi160::{Bmi160, GyroscopePowerMode, GyroscopeRange, SensorSelector, SlaveAddr};
use embedded_hal::i2c::I2c;
use embedded_hal::spi::SpiDevice;

/// What the chip says that it is (CHIP_ID, 2.11.1).
const IDENTITY: u8 = 0xD1;
/// From sleep to the first reading, s (table 3, "gyroscope start-up time").
const START_UP: f64 = 0.080;
/// A chip that gives no reading for so long is started again, s: ten of its periods.
const SILENCE: f64 = 0.1;
/// Pause before a chip that has failed is spoken to again, s.
const PAUSE: f64 = 0.1;

/// Its ranges, deg/s, and the steps of a degree a second in each (table 3).
const RANGES: [(f64, GyroscopeRange, f64); 5] = [
    (125.0, GyroscopeRange::Scale125, 262.4),
    (250.0, GyroscopeRange::Scale250, 131.2),
    (500.0, GyroscopeRange::Scale500, 65.6),
    (1000.0, GyroscopeRange::Scale1000, 32.8),
    (2000.0, GyroscopeRange::Scale2000, 16.4),
];

/// Why a chip tells nothing. It is spoken to again by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GyroChipError {
    /// It does not answer.
    Bus,
    /// What answers is another chip, with this identity.
    Foreign(u8),
    /// It has no readings, though it answers: it has lost its supply, or was told to sleep.
    Silent,
}

impl GyroChipError {
    /// What is wrong, in words.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Bus => "it does not answer",
            Self::Foreign(_) => "what answers is no BMI160",
            Self::Silent => "it answers, but has no readings; it is started again",
        }
    }
}

/// How far it is.
#[derive(Clone, Copy, Debug)]
enum State {
    /// It sleeps, and is not spoken to before that time, if there is one.
    Asleep(Option<Time>),
    /// It wakes until that time.
    Waking(Time),
    /// It measures; the last reading came then.
    Measuring(Time),
}

/// A chip behind SPI or I2C, which is woken, read and, if need be, started again. Its readings are those of a gyro on the bus: a silent one, and
/// one at the end of its range, are told by [`agv_core::state::Reason::GyroFault`].
#[derive(Debug)]
pub struct GyroChip<Interface> {
    chip: Bmi160<Interface>,
    state: State,
    /// Which axis points up or down: 1, 2 or 3.
    axis: u8,
    /// The largest rate that is believed, rad/s.
    range: f64,
    chosen: GyroscopeRange,
    /// Rate of one step, rad/s.
    unit: f64,
}

impl<Wires: I2c> GyroChip<I2cInterface<Wires>> {
    /// A chip that sleeps, on I2C: at 68h, or at 69h if its pin SDO is high.
    #[must_use]
    pub fn on_i2c(wires: Wires, is_sdo_high: bool, settings: &Settings) -> Self {
        Self::new(Bmi160::new_with_i2c(wires, SlaveAddr::Alternative(is_sdo_high)), settings)
    }
}

impl<Wires: SpiDevice> GyroChip<SpiInterface<Wires>> {
    /// A chip that sleeps, on SPI in mode 0 or 3, at 10 MHz at the most (data sheet, 3.2.2).
    #[must_use]
    pub fn on_spi(wires: Wires, settings: &Settings) -> Self {
        Self::new(Bmi160::new_with_spi(wires), settings)
    }
}

impl<Interface> GyroChip<Interface> {
    /// Its axis is `can.gyro_axis`; its range is the smallest one in which it can tell `gyro.range`, or its largest.
    fn new(chip: Bmi160<Interface>, settings: &Settings) -> Self {
        let range = settings.parameters.gyro.range;
        let [.., widest] = RANGES;
        let (_, chosen, steps) =
            RANGES.into_iter().find(|(degrees, ..)| degrees.to_radians() >= range).unwrap_or(widest);
        let axis = settings.gyro_frame.axis;
        Self { chip, state: State::Asleep(None), axis, range, chosen, unit: (1.0 / steps).to_radians() }
    }
}

impl<Interface, Fault> GyroChip<Interface>
where
    Interface: ReadData<Error = bmi160::Error<Fault>> + WriteData<Error = bmi160::Error<Fault>>,
{
    /// Reads it, if there is anything new. To be called at least every 5 ms; the time of a reading is that of the call which finds it.
    ///
    /// # Errors
    /// Why it tells nothing; it is spoken to again later.
    pub fn poll(&mut self, now: Time) -> Result<Option<GyroSample>, GyroChipError> {
        let outcome = self.go_on(now);
        if outcome.is_err() {
            self.state = State::Asleep(Some(now.offset(PAUSE)));
        }
        outcome
    }

    fn go_on(&mut self, now: Time) -> Result<Option<GyroSample>, GyroChipError> {
        match self.state {
            State::Asleep(Some(until)) | State::Waking(until) if now < until => {}
            State::Asleep(_) => {
                let identity = self.chip.chip_id().map_err(|_| GyroChipError::Bus)?;
                if identity != IDENTITY {
                    return Err(GyroChipError::Foreign(identity));
                }
                self.chip.set_gyro_power_mode(GyroscopePowerMode::Normal).map_err(|_| GyroChipError::Bus)?;
                self.state = State::Waking(now.offset(START_UP));
            }
            State::Waking(_) => {
                self.chip.set_gyro_range(self.chosen).map_err(|_| GyroChipError::Bus)?;
                self.state = State::Measuring(now);
            }
            State::Measuring(heard) => return self.read(heard, now),
        }
        Ok(None)
    }

    fn read(&mut self, heard: Time, now: Time) -> Result<Option<GyroSample>, GyroChipError> {
        let status = self.chip.status().map_err(|_| GyroChipError::Bus)?;
        if !status.gyro_data_ready {
            return if now.since(heard) > SILENCE { Err(GyroChipError::Silent) } else { Ok(None) };
        }
        let data = self.chip.data(SensorSelector::new().gyro()).map_err(|_| GyroChipError::Bus)?;
        let Some(rates) = data.gyro else { return Err(GyroChipError::Silent) };
        self.state = State::Measuring(now);
        let steps = match self.axis {
            1 => rates.x,
            2 => rates.y,
            _ => rates.z,
        };
        // At the end of its range nobody knows how fast it turns.
        let rate = match steps {
            i16::MIN => -self.range,
            i16::MAX => self.range,
            _ => self.unit * f64::from(steps),
        };
        Ok(Some(GyroSample { time: now, rate }))
    }
}
