//! Frames of a vehicle's own controller, as literal bytes.

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::drive_402;
use agv_wire::can::frame::Id;
use agv_wire::can::motion_frames::{IncrementReports, MotionFrames, Place, SpeedReports};

use super::frames::frame;

fn at(milliseconds: u64) -> Time {
    Time::from_micros(milliseconds * 1000)
}

#[test]
fn speed_and_angle_are_read_where_the_settings_have_them() {
    let mut reports = SpeedReports::new(&MotionFrames::USUAL, 0.010);
    // -1.5 m/s and 0.1 rad in one frame, lowest byte first.
    let sample = reports.handle(&frame("1A1#24FAE803"), at(10)).unwrap();
    assert!((sample.speed + 1.5).abs() < 1e-12 && (sample.steering - 0.1).abs() < 1e-12, "{sample:?}");
    assert_eq!(sample.time, at(10));
    // A frame that is late by 3 ms was made when it was due.
    let late = reports.handle(&frame("1A1#00000000"), at(23)).unwrap();
    assert!(late.time < at(21), "{late:?}");
    // Highest byte first, unsigned about an offset, in two frames with 29 bits.
    let split = MotionFrames {
        speed: Place { identifier: 0x18FF_0001, first_byte: 1, length: 2, unit: 0.01, offset: -320.0 },
        angle: Place { identifier: 0x18FF_0002, first_byte: 0, length: 1, unit: 0.02, offset: -2.56 },
        are_extended: true,
        are_big_endian: true,
        are_signed: false,
        ..MotionFrames::USUAL
    };
    let mut reports = SpeedReports::new(&split, 0.010);
    assert_eq!(reports.handle(&frame("18FF0002#A0"), at(10)), None);
    let sample = reports.handle(&frame("18FF0001#FF7D64"), at(11)).unwrap();
    // 7D64h is 32100, A0h is 160.
    assert!((sample.speed - 1.0).abs() < 1e-9 && (sample.steering - 0.64).abs() < 1e-9, "{sample:?}");
}

#[test]
fn an_increment_is_three_numbers_of_a_frame() {
    let mut reports = IncrementReports::new(&MotionFrames::USUAL, 0.010);
    // 10 mm forward, 1 mm to the right, 2 mrad to the left.
    let increment = reports.handle(&frame("1A2#6400F6FF1400"), at(10)).unwrap();
    let Pose { x, y, theta } = increment.displacement;
    assert!((x - 0.01).abs() < 1e-12 && (y + 0.001).abs() < 1e-12 && (theta - 0.002).abs() < 1e-12, "{increment:?}");
    assert_eq!(reports.handle(&frame("1A2#6400F6FF14"), at(20)), None, "the frame is too short");
    assert_eq!(reports.handle(&frame("1A1#6400F6FF1400"), at(20)), None, "it is another's");
}

#[test]
fn what_is_encoded_is_read_again() {
    let usual = MotionFrames::USUAL;
    let apart = MotionFrames { angle: Place { identifier: 0x2A1, first_byte: 6, ..usual.angle }, ..usual };
    let unsigned = MotionFrames {
        speed: Place { offset: -30.0, ..usual.speed },
        angle: Place { offset: -3.0, ..usual.angle },
        are_signed: false,
        are_big_endian: true,
        ..usual
    };
    for frames in [usual, apart, unsigned] {
        let mut reports = SpeedReports::new(&frames, 0.010);
        for (step, (speed, angle)) in (1..).zip([(0.0, 0.0), (1.234, -1.1), (-2.5, 0.7)]) {
            let sent = frames.encode_speed(speed, angle).unwrap();
            let sample = sent.iter().flatten().find_map(|frame| reports.handle(frame, at(10 * step))).unwrap();
            assert!((sample.speed - speed).abs() < 0.6e-3 && (sample.steering - angle).abs() < 0.6e-4, "{sample:?}");
        }
    }
    let mut reports = IncrementReports::new(&usual, 0.010);
    let moved = Pose { x: 0.0123, y: -0.004, theta: 0.0031 };
    let again = reports.handle(&usual.encode_increment(&moved).unwrap(), at(10)).unwrap().displacement;
    assert!((again.x - 0.0123).abs() < 1e-9 && (again.y + 0.004).abs() < 1e-9 && (again.theta - 0.0031).abs() < 1e-9);
    // What is beyond a number's range is its largest.
    let far = usual.encode_increment(&Pose { x: 100.0, ..moved }).unwrap();
    let clipped = reports.handle(&far, at(20)).unwrap().displacement;
    assert!((clipped.x - 3.2767).abs() < 1e-9, "{clipped:?}");
    let nowhere = MotionFrames { increment: Place { first_byte: 4, ..usual.increment }, ..usual };
    assert_eq!(nowhere.encode_increment(&moved), None);
}

/// The velocity of a CiA 402 drive is a number of a frame like any other.
#[test]
fn the_velocity_of_a_drive_can_be_the_speed() {
    let node = NodeId::new(5).unwrap();
    let velocity = drive_402::velocity(node, 0.5e-3);
    let Id::Standard(id) = velocity.id else { panic!("eleven bits") };
    let speed = Place {
        identifier: id.as_raw().into(),
        first_byte: velocity.signal.first_byte,
        length: velocity.signal.length,
        unit: velocity.signal.scale,
        offset: 0.0,
    };
    let mut reports = SpeedReports::new(&MotionFrames { speed, ..MotionFrames::USUAL }, 0.010);
    assert_eq!(reports.handle(&frame("1A1#0000E803"), at(10)), None);
    let sample = reports.handle(&frame("485#2706D0F8FFFF"), at(11)).unwrap();
    assert!((sample.speed + 0.92).abs() < 1e-12, "{sample:?}");
}
