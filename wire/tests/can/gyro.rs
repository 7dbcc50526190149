//! Rates of a gyro, as literal bytes.

use agv_core::measurement::{GyroSample, Time};
use agv_wire::can::frame::{Frame, extended_id, standard_id};
use agv_wire::can::gyro::{Gyro, GyroFrame};

const HEARD: Time = Time::from_micros(7_000);

fn rate(frame: &GyroFrame, id: impl Into<agv_wire::can::frame::Id>, data: &[u8]) -> Option<f64> {
    let GyroSample { time, rate } = Gyro::new(frame).handle(&Frame::new(id, data).unwrap(), HEARD)?;
    assert_eq!(time, HEARD);
    Some(rate)
}

#[test]
fn a_rate_is_read_where_the_settings_have_it() {
    let usual = GyroFrame::USUAL;
    // -300 and 500 hundredths of a degree about the other axes, 1234 about the third.
    let data = [0xD4, 0xFE, 0xF4, 0x01, 0xD2, 0x04, 0, 0];
    let found = rate(&usual, standard_id(0x1A0), &data).unwrap();
    assert!((found.to_degrees() - 12.34).abs() < 1e-12, "{found}");
    let first = rate(&GyroFrame { axis: 1, ..usual }, standard_id(0x1A0), &data).unwrap();
    assert!((first.to_degrees() + 3.0).abs() < 1e-12, "{first}");
    // 32 bits behind two bytes of something else, with 29 bits of identifier.
    let other = GyroFrame { identifier: 0x18F_0123, is_extended: true, first_byte: 2, length: 4, axis: 1, unit: 1e-6 };
    let data = [9, 9, 0xC0, 0xBD, 0xF0, 0xFF, 9, 9];
    let found = rate(&other, extended_id(0x18F_0123), &data).unwrap();
    assert!((found + 1.0).abs() < 1e-12, "{found}");
}

#[test]
fn frames_of_others_and_short_ones_tell_nothing() {
    let usual = GyroFrame::USUAL;
    assert_eq!(rate(&usual, standard_id(0x1A1), &[0; 8]), None);
    assert_eq!(rate(&usual, extended_id(0x1A0), &[0; 8]), None);
    assert_eq!(rate(&usual, standard_id(0x1A0), &[0; 5]), None);
    let remote = Frame::remote(standard_id(0x1A0), 8).unwrap();
    assert_eq!(Gyro::new(&usual).handle(&remote, HEARD), None);
    let nowhere = GyroFrame { first_byte: 7, axis: 3, length: 4, ..usual };
    assert_eq!(rate(&nowhere, standard_id(0x1A0), &[0; 8]), None);
    assert_eq!(nowhere.encode(0.1), None);
}

#[test]
fn a_rate_that_is_encoded_is_read_again() {
    let frames = [GyroFrame::USUAL, GyroFrame { first_byte: 1, length: 4, axis: 1, unit: -1e-7, ..GyroFrame::USUAL }];
    for gyro in frames {
        for rate in [0.0, 1.5, -2.25, 4.3] {
            let frame = gyro.encode(rate).unwrap();
            let again = Gyro::new(&gyro).handle(&frame, HEARD).unwrap().rate;
            assert!((again - rate).abs() <= 0.5 * gyro.unit.abs() + 1e-12, "{rate} became {again}");
        }
    }
    let clipped = Gyro::new(&GyroFrame::USUAL).handle(&GyroFrame::USUAL.encode(100.0).unwrap(), HEARD).unwrap().rate;
    assert!((clipped.to_degrees() - 327.67).abs() < 1e-9);
}
