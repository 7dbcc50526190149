//! What tells the motion of a vehicle of each kind on the bus, and what becomes of it.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::FRAC_PI_2;

use agv_controller::{Bus, BusEvent, ControllerIdentity, EncoderNodes, EncoderOutput, Encoders, Troubles, counted};
use agv_core::geometry::Pose;
use agv_core::measurement::{EncoderFault, EncoderFaults, Time, WheelReading};
use agv_core::state::LaserHealth;
use agv_settings::leaf::{Leaf, Value};
use agv_settings::{Settings, VehicleKind};
use agv_wire::can::controller_node::WithoutSettings;
use agv_wire::can::encoder_group::Counts;
use agv_wire::can::frame::{Frame, standard_id};
use agv_wire::can::motion_frames::MotionFrames;

fn at(milliseconds: u64) -> Time {
    Time::from_micros(milliseconds * 1000)
}

fn of_kind(kind: VehicleKind) -> Settings {
    let mut settings = Settings::default();
    Leaf::named("vehicle.kind").unwrap().set(&mut settings, Value::Whole(kind as u64)).unwrap();
    settings
}

/// Which counter is which of which wheel, as the book has it.
#[test]
fn counters_are_those_of_the_wheels_in_their_order() {
    let counts = Counts { time: at(7), counts: [11, 22, 33, 44] };
    let wheel = |count, steering| WheelReading { count, steering };
    let none = WheelReading::default();
    let cases = [
        (VehicleKind::Differential, [wheel(11, 0), wheel(22, 0), none, none]),
        (VehicleKind::BiSteerable, [wheel(11, 22), wheel(33, 44), none, none]),
        (VehicleKind::Ackermann, [wheel(11, 0), wheel(22, 0), wheel(0, 33), none]),
        (VehicleKind::Omni3, [wheel(11, 0), wheel(22, 0), wheel(33, 0), none]),
        (VehicleKind::Omni4, [wheel(11, 0), wheel(22, 0), wheel(33, 0), wheel(44, 0)]),
        (VehicleKind::Mecanum, [wheel(11, 0), wheel(22, 0), wheel(33, 0), wheel(44, 0)]),
    ];
    for (kind, wheels) in cases {
        let event = counted(&of_kind(kind).parameters.vehicle, &counts);
        let BusEvent::Wheels(sample) = event else { panic!("{kind:?}: {event:?}") };
        assert_eq!((sample.time, sample.wheels), (at(7), wheels), "{kind:?}");
    }
    let event = counted(&of_kind(VehicleKind::Tricycle).parameters.vehicle, &counts);
    let BusEvent::Encoders(sample) = event else { panic!("{event:?}") };
    assert_eq!((sample.drive, sample.steering), (11, 22));
}

/// The board listens to those frames alone.
#[test]
fn the_bus_listens_to_what_tells_the_motion() {
    for (kind, nodes, others) in [
        (VehicleKind::Tricycle, &[16, 1, 2][..], &[][..]),
        (VehicleKind::Omni3, &[16, 1, 2, 3], &[]),
        (VehicleKind::BiSteerable, &[16, 1, 2, 3, 4], &[]),
        (VehicleKind::TricycleSpeed, &[16], &[0x1A1, 0x1A1]),
        (VehicleKind::CarSpeed, &[16], &[0x1A1, 0x1A1]),
        (VehicleKind::Increments, &[16], &[0x1A2]),
    ] {
        let bus = Bus::new(&of_kind(kind), ControllerIdentity::default(), Troubles::default(), at(0));
        assert_eq!(bus.nodes().iter().map(|node| node.number()).collect::<Vec<_>>(), nodes, "{kind:?}");
        let ids: Vec<_> = others.iter().map(|id| standard_id(*id)).collect();
        assert_eq!(bus.other_frames(), ids[..], "{kind:?}");
    }
}

fn frames_of(kind: VehicleKind, is_moving: bool) -> Vec<Frame> {
    let frames = MotionFrames::USUAL;
    let step = if is_moving { 1.0 } else { 0.0 };
    match kind {
        VehicleKind::Increments => {
            frames.encode_increment(&Pose { x: 0.01 * step, y: 0.0, theta: 0.0 }).into_iter().collect()
        }
        _ => frames.encode_speed(step, 0.1).unwrap().into_iter().flatten().collect(),
    }
}

#[test]
fn reports_of_the_own_controller_are_events_and_their_silence_is_a_fault() {
    for kind in [VehicleKind::TricycleSpeed, VehicleKind::CarSpeed, VehicleKind::Increments] {
        let settings = of_kind(kind);
        let mut encoders = Encoders::new(&EncoderNodes::of(&settings), &settings.parameters, at(0));
        let (mut samples, mut faults): (usize, Vec<EncoderFaults>) = (0, Vec::new());
        for millisecond in 1..400u64 {
            let is_silent = (100..200).contains(&millisecond);
            for frame in frames_of(kind, true).iter().filter(|_| millisecond % 10 == 0 && !is_silent) {
                encoders.hear(frame, at(millisecond), |event| match event {
                    BusEvent::Speed(sample) => {
                        assert!((sample.speed - 1.0).abs() < 1e-9 && (sample.steering - 0.1).abs() < 1e-9);
                        samples += 1;
                    }
                    BusEvent::Increment(increment) => {
                        assert!((increment.displacement.x - 0.01).abs() < 1e-9);
                        samples += 1;
                    }
                    other => panic!("{other:?}"),
                });
            }
            encoders.poll(at(millisecond), |output| match output {
                EncoderOutput::Event(BusEvent::EncoderFaults(found)) => faults.push(found),
                other => panic!("nothing is sent: {other:?}"),
            });
        }
        assert_eq!(samples, 29, "{kind:?}");
        // Silent from 90 ms on: late after 25 ms, missing after 45 ms, and told every 10 ms until the report at 200 ms.
        let first = |fault: EncoderFault| faults.iter().find(|told| told.drive == Some(fault)).map(|told| told.time);
        assert_eq!(
            (first(EncoderFault::Late), first(EncoderFault::Missing)),
            (Some(at(116)), Some(at(136))),
            "{kind:?}"
        );
        let last = faults.last().unwrap();
        assert_eq!((last.time, last.any()), (at(200), false), "{kind:?}");
        assert!(faults.windows(2).all(|pair| pair[1].time.since(pair[0].time) <= 0.0201), "{kind:?}");
        assert!(faults.iter().all(|told| told.steering.is_none()), "{kind:?}");
    }
}

/// By the velocity of a point of a rigid body, and the turn of its axes.
#[test]
fn a_laser_is_told_how_fast_it_moves() {
    let mut settings = of_kind(VehicleKind::Increments);
    *settings.parameters.lasers.first_mut() = Pose::new(0.9, 0.2, FRAC_PI_2);
    for (tells, stops) in [(false, false), (true, false), (true, true)] {
        settings.laser.tells_speed = tells;
        let mut bus = Bus::new(&settings, ControllerIdentity::default(), Troubles::default(), at(0));
        for step in 1..=40 {
            let moved = Pose { x: 0.01, y: 0.0, theta: 0.005 };
            let frame = MotionFrames::USUAL.encode_increment(&moved).unwrap();
            bus.hear(&frame, at(10 * step), &mut WithoutSettings, |_| ());
        }
        if stops {
            // Nobody says any more how it moves.
            (400..600).for_each(|now| bus.poll(at(now), LaserHealth::Sound, |_| ()));
        }
        let Some(speed) = bus.laser_speed() else {
            assert!(!tells || stops);
            continue;
        };
        assert!(tells && !stops, "{speed:?}");
        // 1 m/s and 0.5 rad/s of R, on the way in the middle of each step.
        assert!((speed.x - 0.45).abs() < 0.005 && (speed.y + 0.9).abs() < 0.005, "{speed:?}");
        assert!((speed.rotation - 0.5).abs() < 1e-6 && speed.time == at(400), "{speed:?}");
    }
}

/// An increment holds the way since the one before it was sent, and a lost one takes its way along.
#[test]
fn a_lost_increment_is_told_and_a_late_one_is_not() {
    for period in [5_u64, 10, 20, 50] {
        for (late, lost, told) in [(0, None, 0), (9, None, 0), (0, Some(40), 1), (9, Some(40), 1)] {
            let mut settings = of_kind(VehicleKind::Increments);
            settings.encoder_period = period as u16;
            let mut encoders = Encoders::new(&EncoderNodes::of(&settings), &settings.parameters, at(0));
            let mut events = Vec::new();
            for millisecond in 1..80 * period {
                // In the bus a report may be held up: each third one.
                let number = millisecond / period;
                let held = if number.is_multiple_of(3) { late * period / 20 } else { 0 };
                let comes = millisecond == number * period + held && number > 0 && Some(number) != lost;
                for frame in frames_of(VehicleKind::Increments, true).iter().filter(|_| comes) {
                    encoders.hear(frame, at(millisecond), |event| events.push(event));
                }
                encoders.poll(at(millisecond), |output| {
                    if let EncoderOutput::Event(event) = output {
                        events.push(event);
                    }
                });
            }
            let faults: Vec<_> = events
                .iter()
                .enumerate()
                .filter_map(|(place, event)| match event {
                    BusEvent::EncoderFaults(found) if found.any() => Some(place),
                    _ => None,
                })
                .collect();
            assert_eq!(faults.len(), told, "{period} ms, {late}, {lost:?}: {faults:?}");
            for place in faults {
                let BusEvent::EncoderFaults(found) = events[place] else { panic!() };
                let BusEvent::Increment(increment) = events[place + 1] else { panic!("{:?}", events[place + 1]) };
                assert_eq!((found.drive, found.time), (Some(EncoderFault::Missing), increment.time));
                let BusEvent::EncoderFaults(ended) = events[place + 2] else { panic!("{:?}", events[place + 2]) };
                assert!(!ended.any());
            }
        }
    }
}

#[test]
fn a_vehicle_whose_own_controller_says_so_stands() {
    for kind in [VehicleKind::TricycleSpeed, VehicleKind::Increments] {
        let mut bus = Bus::new(&of_kind(kind), ControllerIdentity::default(), Troubles::default(), at(0));
        let hear = |bus: &mut Bus, now: u64, is_moving: bool| {
            for frame in frames_of(kind, is_moving) {
                bus.hear(&frame, at(now), &mut WithoutSettings, |_| ());
            }
        };
        for step in 1..=90 {
            hear(&mut bus, 10 * step, false);
        }
        assert!(!bus.is_standing(at(900)), "{kind:?}: not for a second");
        (91..=110).for_each(|step| hear(&mut bus, 10 * step, false));
        assert!(bus.is_standing(at(1100)), "{kind:?}");
        hear(&mut bus, 1110, true);
        assert!(!bus.is_standing(at(1110)), "{kind:?}");
    }
}
