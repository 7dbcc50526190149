//! Nothing from outside can hurt it.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, PoseFix};
use agv_core::measurement::{
    EncoderFault, EncoderFaults, EncoderSample, LaserId, ReflectorObservation, Reflectors, Scan, Time,
};
use proptest::prelude::*;

use super::drive::{Small, parameters, reflectors};

/// Any number that a sensor might say, sensible or not.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -50.0f64..50.0,
        1 => any::<f64>(),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(0.0), Just(f64::MAX)],
    ]
}

#[derive(Clone, Debug)]
enum Anything {
    Encoders(u64, u32, u32),
    EncoderFaults(u64, bool, bool),
    Reflectors(Vec<(u64, f32, f32)>),
    Scan(u64, f64, f64, f64, Vec<f32>),
    SetPose(u64, f64, f64, f64, f64, f64),
}

fn any_time() -> impl Strategy<Value = u64> {
    prop_oneof![8 => 0u64..3_000_000, 1 => any::<u64>()]
}

fn anything() -> impl Strategy<Value = Anything> {
    let single = || any_number().prop_map(|number| number as f32);
    prop_oneof![
        6 => (any_time(), any::<u32>(), any::<u32>()).prop_map(|(t, d, s)| Anything::Encoders(t, d, s)),
        4 => (0u64..3_000_000, 0u32..3_000, 0u32..600).prop_map(|(t, d, s)| Anything::Encoders(t, d, s)),
        2 => (any_time(), any::<bool>(), any::<bool>()).prop_map(|(t, d, s)| Anything::EncoderFaults(t, d, s)),
        3 => proptest::collection::vec((any_time(), single(), single()), 0..20)
            .prop_map(Anything::Reflectors),
        2 => (any_time(), any_number(), any_number(), -0.1f64..0.1, proptest::collection::vec(single(), 0..400))
            .prop_map(|(t, interval, first, step, ranges)| Anything::Scan(t, interval, first, step, ranges)),
        1 => (any_time(), any_number(), any_number(), any_number(), any_number(), any_number())
            .prop_map(|(t, x, y, theta, p, h)| Anything::SetPose(t, x, y, theta, p, h)),
    ]
}

proptest! {
    #[test]
    fn no_sequence_of_events_breaks_the_pose(events in proptest::collection::vec(anything(), 1..60)) {
        let mut parameters = parameters();
        parameters.maps.dynamic = true;
        let mut localizer = Box::new(Small::new(parameters));
        localizer.add_landmarks(&reflectors()).unwrap();
        let first = PoseFix {
            time: Time::from_micros(0), pose: Pose::default(), position_deviation: 0.1, heading_deviation: 0.05,
        };
        localizer.handle(&Event::SetPose(first));
        for event in &events {
            let observations: Vec<ReflectorObservation>;
            let event = match event {
                Anything::Encoders(time, drive, steering) => Event::Encoders(EncoderSample {
                    time: Time::from_micros(*time), drive: *drive, steering: *steering,
                }),
                Anything::EncoderFaults(time, drive, steering) => Event::EncoderFaults(EncoderFaults {
                    time: Time::from_micros(*time),
                    drive: drive.then_some(EncoderFault::Missing),
                    steering: steering.then_some(EncoderFault::Frozen),
                }),
                Anything::Reflectors(seen) => {
                    observations = seen.iter().map(|&(time, range, bearing)| ReflectorObservation {
                        time: Time::from_micros(time), range, bearing,
                    }).collect();
                    Event::Reflectors(Reflectors::of_first(&observations))
                }
                Anything::Scan(start, beam_interval, first_bearing, bearing_step, ranges) => Event::Scan(Scan {
laser: LaserId::FIRST,
                    start: Time::from_micros(*start),
                    beam_interval: *beam_interval,
                    first_bearing: *first_bearing,
                    bearing_step: *bearing_step,
                    ranges,
                    intensities: &[],
                }),
                Anything::SetPose(time, x, y, theta, position_deviation, heading_deviation) => {
                    Event::SetPose(PoseFix {
                        time: Time::from_micros(*time),
                        pose: Pose { x: *x, y: *y, theta: *theta },
                        position_deviation: *position_deviation,
                        heading_deviation: *heading_deviation,
                    })
                }
            };
            let output = localizer.handle(&event).pose;
            let [xx, xy, yy, xt, yt, tt] = output.covariance;
            prop_assert!(output.pose.is_finite(), "{:?}", output);
            prop_assert!([xx, xy, yy, xt, yt, tt].iter().all(|entry| entry.is_finite()), "{:?}", output);
            prop_assert!(xx >= 0.0 && yy >= 0.0 && tt >= 0.0);
            // Below the smallest normal number products have no precision left.
            prop_assert!(xx * yy - xy * xy >= -1e-9 * xx * yy - f64::MIN_POSITIVE);
            prop_assert!(localizer.dynamic_landmarks().len() <= 32);
        }
    }
}
