//! Drive units whose numbers stand anywhere in their frames.

use agv_core::measurement::{SpeedSample, Time};
use agv_wire::can::drive_unit::{DriveUnit, FrameSignal};
use agv_wire::can::frame::standard_id;
use agv_wire::can::signal::{ByteOrder, Signal};
use proptest::prelude::*;

use super::frames::frame;

fn signal(first_byte: u8, length: u8, order: ByteOrder, is_signed: bool, scale: f64) -> Signal {
    Signal { first_byte, length, order, is_signed, scale, offset: 0.0 }
}

#[test]
fn literal_numbers() {
    use ByteOrder::{BigEndian, LittleEndian};
    let data = [0x12, 0xFE, 0xFF, 0x80, 0x01, 0xFF, 0xFF, 0xFF];
    for (signal, raw) in [
        (signal(1, 2, LittleEndian, true, 1.0), Some(-2)),
        (signal(1, 2, LittleEndian, false, 1.0), Some(0xFFFE)),
        (signal(3, 2, BigEndian, true, 1.0), Some(-32767)),
        (signal(3, 2, BigEndian, false, 1.0), Some(0x8001)),
        (signal(0, 3, BigEndian, false, 1.0), Some(0x12_FEFF)),
        (signal(0, 3, LittleEndian, true, 1.0), Some(-0x1EE)),
        (signal(7, 2, LittleEndian, true, 1.0), None),
        (signal(0, 0, LittleEndian, true, 1.0), None),
        (signal(0, 9, LittleEndian, true, 1.0), None),
    ] {
        assert_eq!(signal.raw(&data), raw, "{signal:?}");
    }
    let scaled = Signal { offset: -40.0, ..signal(0, 1, LittleEndian, false, 0.5) };
    assert_eq!(scaled.value(&data), Some(-31.0));
    assert_eq!(signal(0, 8, LittleEndian, false, 1.0).value(&[0xFF; 8]), Some(u64::MAX as f64));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn both_orders_read_what_the_language_writes(value: i32, first in 0..=4u8) {
        let mut data = [0xA5; 8];
        let place = usize::from(first)..usize::from(first) + 4;
        data[place.clone()].copy_from_slice(&value.to_le_bytes());
        prop_assert_eq!(signal(first, 4, ByteOrder::LittleEndian, true, 1.0).raw(&data), Some(i64::from(value)));
        data[place].copy_from_slice(&value.to_be_bytes());
        prop_assert_eq!(signal(first, 4, ByteOrder::BigEndian, true, 1.0).raw(&data), Some(i64::from(value)));
    }
}

#[test]
fn speed_and_angle_become_a_sample() {
    let speed = FrameSignal { id: standard_id(0x1A5), signal: signal(0, 2, ByteOrder::LittleEndian, true, 1e-3) };
    let same = FrameSignal { id: standard_id(0x1A5), signal: signal(2, 2, ByteOrder::LittleEndian, true, 1e-4) };
    let time = Time::from_seconds;
    let mut unit = DriveUnit::new(speed, same, 0.02);
    let sample = unit.handle(&frame("1A5#DC05 18FC"), time(1.0)).unwrap();
    assert_eq!(sample, SpeedSample { time: time(1.0), speed: 1.5, steering: -1000.0 * 1e-4 });

    let other = FrameSignal { id: standard_id(0x2A5), ..same };
    let mut unit = DriveUnit::new(speed, other, 0.02);
    assert_eq!(unit.handle(&frame("1A5#DC05 0000"), time(1.0)), None, "the angle is not known yet");
    assert_eq!(unit.handle(&frame("2A5#0000 E803"), time(1.005)), None);
    assert_eq!(unit.handle(&frame("1A5#0000"), time(1.01)).unwrap().steering, 0.1);
    assert_eq!(unit.handle(&frame("1A5#00"), time(1.015)), None, "the frame is too short");
    assert_eq!(unit.handle(&frame("1A5#0000"), time(1.026)), None, "the angle is too old");
}
