//! What the controller says and hears.

use agv_core::geometry::Pose;
use agv_core::integrity::{Alarm, AlertLimit, AlertLimits, ProtectionLevel};
use agv_core::localizer::{Mode, PoseFix, PoseOutput, Reason};
use agv_core::measurement::EncoderFault;
use agv_core::measurement::Time;
use agv_core::state::{LaserHealth, Relocalization};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::{Content, ControllerError, Health, OrderReceiver, contents};
use agv_wire::can::frame::{Frame, standard_id};
use proptest::prelude::*;

use super::frames::{any_classic, frame};

fn node() -> NodeId {
    NodeId::new(16).unwrap()
}

fn pose() -> PoseOutput {
    PoseOutput {
        time: Time::from_micros(70_123_456),
        pose: Pose { x: 12.3456, y: -7.0001, theta: -1.234_567 },
        covariance: [1e-4, 3e-5, 4e-4, 2e-6, -4e-6, 1e-6],
        mode: Mode::Mixed,
        reason: Reason::None,
        dead_reckoning_distance: 1.234,
        correction: 0.002,
        smooth: Pose { x: 12.3, y: -7.1, theta: -1.23 },
        level: ProtectionLevel { position: 0.0412, heading: 0.0061 },
        acceptance: 0.87,
        normalised_square: 2.15,
        resets: 0xA7,
        last_reset: 0.125,
        overflows: 6,
    }
}

fn health() -> Health {
    Health {
        drive: None,
        steering: Some(EncoderFault::Frozen),
        laser: LaserHealth::Sound,
        start_search: Relocalization::TooFew,
    }
}

#[test]
fn literal_frames() {
    // By hand: x 123456 and y -70001 in 30 bits each, counter 5.
    let payload = 123_456u64 | ((-70_001i64 as u64) & 0x3FFF_FFFF) << 30 | 5 << 60;
    let limits = AlertLimits::default();
    let [position, heading, covariance, status, integrity] =
        contents(&pose(), &health(), &limits).map(|content| content.encode(node(), 5));
    assert_eq!(position, Frame::of(standard_id(0x190), payload.to_le_bytes()));
    // Heading -1234567 (0xED2979), time 70123 modulo 65536 (0x11EB), distance 124 cm rounded up (0x7C).
    assert_eq!(heading, frame("290#7929EDEB117C0050"));
    // 10 mm is 40 steps, 20 mm 80, 1 mrad 10; correlations 0.15, 0.2, -0.2 are 8, 10, -10.
    let payload = 40 | 80 << 13 | 10 << 26 | 8 << 39 | 10 << 46 | (-10i64 as u64 & 0x7F) << 53 | 5 << 60;
    assert_eq!(covariance, Frame::of(standard_id(0x390), u64::to_le_bytes(payload)));
    // Mode 3, reason 0, 87 %, 43 steps, steering frozen (3), laser sound (1), the 167th reset of 125 mm (7 steps, rounded
    // up), too few reflectors (3), six scans that were too large (6 modulo 4).
    let payload = 3 | 87 << 10 | 43 << 17 | 3 << 31 | 1 << 35 | 0xA7 << 37 | 7 << 45 | 3 << 53 | 2 << 58 | 5u64 << 60;
    assert_eq!(status, Frame::of(standard_id(0x490), payload.to_le_bytes()));
    assert_eq!(integrity.id(), standard_id(0x690));
    // Sure to 5 mm and 0.03 deg, and corrected by 2 cm: one bit each.
    let sure = PoseOutput { covariance: [2e-5, 0.0, 1e-5, 0.0, 0.0, 2e-7], correction: 0.02, ..pose() };
    let [.., status, _] = contents(&sure, &health(), &limits).map(|content| content.encode(node(), 5));
    assert_eq!(status, Frame::of(standard_id(0x490), (payload | 3 << 56).to_le_bytes()));
    // Sure along the axes only.
    let slanted = PoseOutput { covariance: [2e-5, 1.9e-5, 2e-5, 0.0, 0.0, 2e-7], ..sure };
    assert!(sure.is_good() && !slanted.is_good() && !PoseOutput { mode: Mode::Lost, ..sure }.is_good());
}

#[test]
fn a_protection_level_is_never_told_smaller_than_it_is() {
    let limit = AlertLimit { position: 0.15, heading: 0.035 };
    let told = |position, heading| {
        let content = Content::Integrity { level: ProtectionLevel { position, heading }, limit, alarm: Alarm::Travel };
        let frame = content.encode(node(), 5);
        let (Content::Integrity { level, limit, alarm }, 5) = Content::decode(&frame, node()).unwrap() else {
            panic!()
        };
        assert!(alarm == Alarm::Travel && (limit.position - 0.15).abs() < 1e-9 && (limit.heading - 0.035).abs() < 1e-9);
        (frame, level)
    };
    // 38 mm rounded up, 26 steps of 0.25 mrad rounded up, limits of 150 mm and 140 steps, alarm 2.
    let payload = 38 | 26 << 14 | 150 << 27 | 140 << 37 | 2 << 47 | 5u64 << 60;
    assert_eq!(told(0.0371, 0.0063).0, Frame::of(standard_id(0x690), payload.to_le_bytes()));
    for level in [0.0, 1e-9, 0.001, 0.0409, 0.15, 2.0, 16.38] {
        let (_, found) = told(level, level * 0.1);
        assert!((-1e-8..=1.001e-3).contains(&(found.position - level)), "{level}: {found:?}");
        assert!((-1e-8..=0.251e-3).contains(&(found.heading - level * 0.1)), "{level}: {found:?}");
    }
    for level in [16.39, 1e9, f64::INFINITY, f64::NAN, -1.0] {
        let (_, found) = told(level, level);
        assert!(found.position.is_infinite() && found.heading.is_infinite(), "{level}: {found:?}");
    }
}

#[test]
fn what_cannot_be_told_is_told_as_unknown() {
    for value in [f64::NAN, f64::INFINITY, -f64::INFINITY, 53_687.1, -53_687.1, 1e300] {
        let (content, _) = Content::decode(&Content::Position { x: value, y: 1.0 }.encode(node(), 0), node()).unwrap();
        let Content::Position { x, y } = content else { panic!() };
        assert!(x.is_nan() && y == 1.0, "{value}: {x}");
    }
    // A deviation that is not known is large, never small.
    for value in [f64::NAN, f64::INFINITY, -1.0, 5.0] {
        let content = Content::Covariance { deviations: [value, 0.0, 0.1], correlations: [0.0; 3] };
        let (Content::Covariance { deviations, .. }, _) = Content::decode(&content.encode(node(), 0), node()).unwrap()
        else {
            panic!()
        };
        let expected = if value < 0.0 { 0.0..2.1 } else { 2.0..2.1 };
        assert!(expected.contains(&deviations[0]), "{value}: {deviations:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn numbers_survive_within_half_a_step(x in -53_000.0..53_000.0f64, y in -53_000.0..53_000.0f64, turn in -3.2..3.2f64, sigma in 0.0..2.0f64, counter in 0..=15u8) {
        let (content, count) = Content::decode(&Content::Position { x, y }.encode(node(), counter), node()).unwrap();
        let Content::Position { x: x_back, y: y_back } = content else { panic!() };
        prop_assert!((x - x_back).abs() <= 0.500_01e-4 && (y - y_back).abs() <= 0.500_01e-4);
        prop_assert_eq!(count, counter);
        let heading = Content::InitialHeading { heading: turn, position_deviation: sigma, heading_deviation: sigma };
        let (content, _) = Content::decode(&heading.encode(node(), counter), node()).unwrap();
        let Content::InitialHeading { heading, position_deviation, heading_deviation } = content else { panic!() };
        prop_assert!((heading - turn).abs() <= 0.500_01e-6);
        // A deviation is never told smaller than it is, but for what rounding numbers does.
        prop_assert!((-1e-8..=1.000_01e-3).contains(&(position_deviation - sigma)));
        prop_assert!((-1e-8..=1.000_01e-4).contains(&(heading_deviation - sigma)));
    }

    #[test]
    fn what_was_decoded_is_encoded_again(frame in any_classic()) {
        for id in [0x190, 0x290, 0x390, 0x490, 0x690, 0x210, 0x310, 0x410] {
            let frame = Frame::new(standard_id(id), frame.data()).unwrap();
            match Content::decode(&frame, node()) {
                Ok((content, counter)) => {
                    let again = content.encode(node(), counter);
                    // NaN is no equal of itself, so the frames are compared; reserved bits come back as zero.
                    prop_assert_eq!(Content::decode(&again, node()).map(|(content, _)| content.encode(node(), counter)), Ok(again));
                }
                Err(error) => prop_assert!(frame.data().len() != 8 || error == ControllerError::Value),
            }
        }
        if !matches!(frame.id(), embedded_can::Id::Standard(_)) {
            prop_assert_eq!(Content::decode(&frame, node()), Err(ControllerError::Foreign));
        }
    }
}

#[test]
fn an_initial_pose_needs_both_halves() {
    let at = Time::from_seconds;
    let position = Content::InitialPosition { x: 1.5, y: -2.0 };
    let heading = Content::InitialHeading { heading: 0.5, position_deviation: 0.1, heading_deviation: 0.02 };
    let expected = |time| {
        let pose = Pose { x: 1.5, y: -2.0, theta: 0.5 };
        PoseFix { time, pose, position_deviation: 0.1, heading_deviation: 0.02 }
    };
    let close = |order: Option<PoseFix>, expected: PoseFix| {
        order.is_some_and(|found| {
            found.time == expected.time
                && (found.pose.x - expected.pose.x).abs() < 1e-9
                && (found.pose.theta - expected.pose.theta).abs() < 1e-9
                && (found.position_deviation - expected.position_deviation).abs() < 1e-9
        })
    };
    let mut receiver = OrderReceiver::new(node());
    assert_eq!(receiver.handle(&position.encode(node(), 1), at(1.0)), None);
    assert!(close(receiver.handle(&heading.encode(node(), 1), at(1.01)), expected(at(1.01))));
    // The same again is a repetition; a new count is a new order, in either order of frames.
    assert_eq!(receiver.handle(&position.encode(node(), 1), at(1.02)), None);
    assert_eq!(receiver.handle(&heading.encode(node(), 1), at(1.03)), None);
    assert_eq!(receiver.handle(&heading.encode(node(), 2), at(1.04)), None);
    assert!(close(receiver.handle(&position.encode(node(), 2), at(1.05)), expected(at(1.05))));
    // Halves of different orders, halves too far apart, and numbers that make no pose.
    assert_eq!(receiver.handle(&position.encode(node(), 3), at(2.0)), None);
    assert_eq!(receiver.handle(&heading.encode(node(), 4), at(2.01)), None);
    assert_eq!(receiver.handle(&heading.encode(node(), 3), at(2.2)), None);
    let nowhere = Content::InitialPosition { x: f64::NAN, y: 0.0 };
    assert_eq!(receiver.handle(&nowhere.encode(node(), 5), at(3.0)), None);
    assert_eq!(receiver.handle(&heading.encode(node(), 5), at(3.0)), None);
}

#[test]
fn standstill_must_be_repeated() {
    let at = Time::from_seconds;
    let command = |is_standstill| Content::Command { is_standstill };
    let mut receiver = OrderReceiver::new(node());
    assert_eq!(receiver.handle(&command(true).encode(node(), 0), at(1.0)), None);
    assert!(receiver.is_standstill(at(1.2)) && !receiver.is_standstill(at(1.21)));
    receiver.handle(&command(true).encode(node(), 1), at(2.0));
    receiver.handle(&command(false).encode(node(), 2), at(2.1));
    assert!(!receiver.is_standstill(at(2.11)));
}

#[test]
fn nothing_but_standstill_is_heard_in_a_command() {
    // Every bit but the one of standstill and the counter.
    for others in [0u64, 0x0000_0000_0000_0009, 0x0FFF_FFFF_FFEF_FFFF] {
        for is_standstill in [false, true] {
            let payload = others | u64::from(is_standstill) << 20;
            let frame = Frame::of(standard_id(0x410), payload.to_le_bytes());
            assert_eq!(Content::decode(&frame, node()), Ok((Content::Command { is_standstill }, 0)), "{payload:x}");
        }
    }
}
