//! A gyro on SPI or I2C: what the driver asks of it, byte by byte, and what becomes of its registers as the data sheet has them.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use agv_controller::{Bus, BusOutput, ControllerIdentity, GyroChip, GyroChipError, SettingObjects, Troubles};
use agv_core::localizer::Event;
use agv_core::measurement::{GyroSample, Time};
use agv_core::odometry::GyroTurns;
use agv_settings::Settings;
use bmi160::interface::I2cInterface;
use embedded_hal::{i2c, spi};
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use proptest::prelude::*;

const ADDRESS: u8 = 0x68;

fn at(milliseconds: u64) -> Time {
    Time::from_micros(1_000_000 + milliseconds * 1000)
}

/// A vehicle that has a gyro.
fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.parameters.gyro.is_fitted = true;
    settings.parameters.sources.gyro = true;
    settings
}

/// Registers of the chip as its data sheet has them (BST-BMI160-DS000, 2.11), and time.
#[derive(Debug)]
struct Registers {
    now: u64,
    identity: u8,
    /// PMU_STATUS: bits 2 and 3 are those of the gyro.
    power: u8,
    /// When the gyro measures, ms.
    ready_at: Option<u64>,
    range: u8,
    rates: [i16; 3],
    /// When it has last told a reading.
    read: u64,
    /// The bus is broken.
    is_cut: bool,
}

const GYRO_NORMAL: u8 = 0b0100;

impl Registers {
    fn new() -> Self {
        Self { now: 0, identity: 0xD1, power: 0, ready_at: None, range: 0, rates: [0; 3], read: 0, is_cut: false }
    }

    /// GYR_CONF has 28h, 100 readings a second, when power comes.
    fn is_ready(&self) -> bool {
        self.ready_at.is_some_and(|ready| self.now >= ready && self.now / 10 > self.read / 10)
    }

    fn register(&mut self, address: u8) -> u8 {
        match address {
            0x00 => self.identity,
            0x03 => self.power,
            0x0C..=0x11 => {
                self.read = self.now;
                let place = usize::from(address - 0x0C);
                self.rates[place / 2].to_le_bytes()[place % 2]
            }
            0x1B => u8::from(self.is_ready()) << 6,
            0x43 => self.range,
            _ => panic!("nobody needs {address:02X}h"),
        }
    }

    fn set(&mut self, address: u8, value: u8) {
        match (address, value) {
            (0x7E, 0x15) => (self.power, self.ready_at) = (GYRO_NORMAL, Some(self.now + 80)),
            (0x43, _) => self.range = value,
            _ => panic!("nobody needs {value:02X}h at {address:02X}h"),
        }
    }

    /// The supply was away.
    fn reset(&mut self) {
        (self.power, self.ready_at, self.range) = (0, None, 0);
    }
}

/// The chip on either bus.
#[derive(Clone, Debug)]
struct Chip(Rc<RefCell<Registers>>);

impl Chip {
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Registers::new())))
    }

    fn fill(&self, from: u8, bytes: &mut [u8]) {
        let mut registers = self.0.borrow_mut();
        (from..).zip(bytes).for_each(|(address, byte)| *byte = registers.register(address));
    }
}

impl i2c::ErrorType for Chip {
    type Error = i2c::ErrorKind;
}

impl i2c::I2c for Chip {
    fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation]) -> Result<(), i2c::ErrorKind> {
        assert_eq!(address, ADDRESS);
        if self.0.borrow().is_cut {
            return Err(i2c::ErrorKind::NoAcknowledge(i2c::NoAcknowledgeSource::Address));
        }
        match operations {
            [i2c::Operation::Write([register, value])] => self.0.borrow_mut().set(*register, *value),
            [i2c::Operation::Write([register]), i2c::Operation::Read(bytes)] => self.fill(*register, bytes),
            other => panic!("{other:?}"),
        }
        Ok(())
    }
}

/// The same on SPI: bit 7 of the first byte says that it is read.
#[derive(Debug)]
struct OnSpi(Chip);

impl spi::ErrorType for OnSpi {
    type Error = Infallible;
}

impl spi::SpiDevice for OnSpi {
    fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Infallible> {
        match operations {
            [spi::Operation::Write([register, value])] => self.0.0.borrow_mut().set(*register, *value),
            [spi::Operation::TransferInPlace([first, bytes @ ..])] if *first & 0x80 != 0 => {
                self.0.fill(*first & 0x7F, bytes);
            }
            other => panic!("{other:?}"),
        }
        Ok(())
    }
}

type OnI2c = GyroChip<I2cInterface<Chip>>;

fn on_i2c(chip: &Chip) -> OnI2c {
    GyroChip::on_i2c(chip.clone(), false, &settings())
}

/// Reads it every millisecond, and gives what came, with its time.
fn run(chip: &Chip, gyro: &mut OnI2c, times: std::ops::Range<u64>) -> Vec<(u64, Result<GyroSample, GyroChipError>)> {
    let read = |now| {
        chip.0.borrow_mut().now = now;
        gyro.poll(at(now)).transpose().map(|outcome| (now, outcome))
    };
    times.filter_map(read).collect()
}

#[test]
fn the_chip_is_asked_as_its_data_sheet_says() {
    let read = |register: u8, bytes: &[u8]| Transaction::write_read(ADDRESS, vec![register], bytes.to_vec());
    let mut i2c = Mock::new(&[
        read(0x00, &[0xD1]),
        Transaction::write(ADDRESS, vec![0x7E, 0x15]),
        Transaction::write(ADDRESS, vec![0x43, 0x03]),
        read(0x1B, &[0]),
        read(0x1B, &[0x40]),
        read(0x0C, &[1, 0, 2, 0, 0x20, 0x05]),
    ]);
    let mut gyro = GyroChip::on_i2c(i2c.clone(), false, &settings());
    assert_eq!(gyro.poll(at(0)), Ok(None));
    assert_eq!(gyro.poll(at(79)), Ok(None), "it wakes");
    assert_eq!(gyro.poll(at(80)), Ok(None));
    assert_eq!(gyro.poll(at(81)), Ok(None), "no reading yet");
    let sample = gyro.poll(at(82)).unwrap().unwrap();
    // 1312 steps of 131.2 a degree a second are 10 deg/s.
    assert!(sample.time == at(82) && (sample.rate - 10_f64.to_radians()).abs() < 1e-12, "{sample:?}");
    i2c.done();
}

#[test]
fn readings_come_as_often_as_there_are_any() {
    let chip = Chip::new();
    chip.0.borrow_mut().rates = [100, 200, -1312];
    let samples = run(&chip, &mut on_i2c(&chip), 0..1100);
    let times: Vec<u64> = samples.iter().map(|(now, _)| *now).collect();
    assert!(times[0] < 95 && times.len() >= 100, "{times:?}");
    assert!(times.windows(2).skip(1).all(|pair| pair[1] - pair[0] == 10), "{times:?}");
    let rates = samples.iter().map(|(_, outcome)| outcome.unwrap().rate);
    rates.for_each(|rate| assert!((rate + 10_f64.to_radians()).abs() < 1e-12, "{rate}"));
}

#[test]
fn on_spi_it_is_the_same() {
    let chip = Chip::new();
    chip.0.borrow_mut().rates = [1312, 0, 0];
    let mut settings = settings();
    settings.gyro_frame.axis = 1;
    let mut gyro = GyroChip::on_spi(OnSpi(chip.clone()), &settings);
    let read = |now| {
        chip.0.borrow_mut().now = now;
        gyro.poll(at(now)).unwrap()
    };
    let samples: Vec<GyroSample> = (0..200).filter_map(read).collect();
    assert!(samples.len() > 8 && samples.iter().all(|sample| (sample.rate - 10_f64.to_radians()).abs() < 1e-12));
}

/// Whether the localiser takes a reading.
fn is_believed(sample: &GyroSample) -> bool {
    GyroTurns::new(&settings().parameters.gyro).sample(sample).is_ok()
}

#[test]
fn at_the_end_of_its_range_it_is_not_believed() {
    for (steps, is_told) in [(0, true), (32_766, true), (-32_767, true), (i16::MAX, false), (i16::MIN, false)] {
        let chip = Chip::new();
        chip.0.borrow_mut().rates = [0, 0, steps];
        let samples = run(&chip, &mut on_i2c(&chip), 0..200);
        assert!(samples.iter().all(|(_, outcome)| is_believed(&outcome.unwrap()) == is_told), "{steps}");
    }
    // A chip whose range is wider than what is believed: the range of the settings counts.
    for (range, register) in [(2.0, 0x04), (4.36, 0x03), (5.0, 0x02), (30.0, 0x00), (50.0, 0x00)] {
        let (chip, mut settings) = (Chip::new(), settings());
        settings.parameters.gyro.range = range;
        let mut gyro = GyroChip::on_i2c(chip.clone(), false, &settings);
        run(&chip, &mut gyro, 0..100);
        assert_eq!(chip.0.borrow().range, register, "{range}");
    }
}

#[test]
fn a_chip_that_fails_says_nothing_and_comes_back() {
    type Change = fn(&mut Registers);
    let cases: [(Change, Change, GyroChipError); 3] = [
        (|registers| registers.is_cut = true, |registers| registers.is_cut = false, GyroChipError::Bus),
        // It sleeps when its supply is back, and answers.
        (Registers::reset, |_| (), GyroChipError::Silent),
        (
            |registers| (registers.identity, registers.ready_at) = (0x24, None),
            |registers| registers.identity = 0xD1,
            GyroChipError::Foreign(0x24),
        ),
    ];
    for (fail, mend, expected) in cases {
        let chip = Chip::new();
        let mut gyro = on_i2c(&chip);
        assert!(run(&chip, &mut gyro, 0..300).iter().all(|(_, outcome)| outcome.is_ok()));
        fail(&mut chip.0.borrow_mut());
        let failing = run(&chip, &mut gyro, 300..520);
        assert!(failing.iter().any(|(_, outcome)| *outcome == Err(expected)), "{failing:?}");
        // It is spoken to every tenth of a second, not at each look.
        let failures = failing.iter().filter(|(_, outcome)| outcome.is_err()).count();
        assert!((1..=3).contains(&failures), "{failing:?}");
        assert!(failing.iter().all(|(now, outcome)| outcome.is_err() || *now > 320 + 80), "{failing:?}");
        mend(&mut chip.0.borrow_mut());
        let mended = run(&chip, &mut gyro, 520..1000);
        assert!(mended.last().is_some_and(|(now, outcome)| *now > 980 && outcome.is_ok()), "{expected:?}: {mended:?}");
        assert_eq!(chip.0.borrow().range, 3);
    }
}

proptest! {
    /// Whatever a chip says: its rate is that of its registers, and nothing is made up.
    #[test]
    fn a_rate_is_what_the_registers_say(rates in any::<[i16; 3]>(), axis in 1_u8..=3) {
        let (chip, mut settings) = (Chip::new(), settings());
        settings.gyro_frame.axis = axis;
        chip.0.borrow_mut().rates = rates;
        let mut gyro = GyroChip::on_i2c(chip.clone(), false, &settings);
        let steps = rates[usize::from(axis) - 1];
        for (_, outcome) in run(&chip, &mut gyro, 0..150) {
            let rate = outcome.unwrap().rate;
            let told = f64::from(steps) * 250.0 / 32_800.0;
            prop_assert!((rate.to_degrees() - told).abs() < 0.06, "{rate} of {steps}");
            prop_assert_eq!(is_believed(&outcome.unwrap()), ![i16::MIN, i16::MAX].contains(&steps));
        }
    }
}

#[test]
fn a_gyro_of_its_own_goes_before_one_on_the_bus() {
    let sample = GyroSample { time: at(5), rate: 0.25 };
    let mut bus = Bus::new(&Settings::default(), ControllerIdentity::default(), Troubles::default(), at(0));
    assert_eq!(bus.hear_gyro(&sample), None, "the vehicle is said to have none");
    let mut settings = settings();
    let frame = settings.gyro_frame.encode(0.5).unwrap();
    let mut bus = Bus::new(&settings, ControllerIdentity::default(), Troubles::default(), at(0));
    let rates = |bus: &mut Bus, settings: &mut Settings| {
        let mut rates = Vec::new();
        bus.hear(&frame, at(10), &mut SettingObjects::new(settings), |output| {
            if let BusOutput::Event(told) = output
                && let Event::Gyro(sample) = told.event.event()
            {
                rates.push(sample.rate);
            }
        });
        rates.len()
    };
    assert_eq!(rates(&mut bus, &mut settings), 1);
    let Some(BusOutput::Event(told)) = bus.hear_gyro(&sample) else { panic!("it is told") };
    assert_eq!(told.event.event(), Event::Gyro(sample));
    assert_eq!(rates(&mut bus, &mut settings), 0);
}
