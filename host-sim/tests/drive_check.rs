//! What `agv check` says of what a log holds: every kind of event with every way in which it can be wrong, planted in a drive that is
//! sound. Each is named, and nothing else is.

use agv_core::geometry::Pose;
use agv_core::measurement::{
    EncoderFault, EncoderFaults, LaserId, PoseFix, PoseIncrement, SpeedSample, Time, WheelReading,
};
use agv_host_sim::drive_check::{Finding, measurements};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::block_storage::{BlockStoragePath, ReflectorPlacement};
use agv_host_sim::simulate::scenario::{MotionReport, Scenario};
use agv_host_sim::simulate::simulate;

/// A sound drive of a vehicle with a gyro, reflectors and scans.
fn drive(reports: MotionReport) -> Recording {
    let mut scenario =
        Scenario::block_storage_with_reflectors(BlockStoragePath::P2, ReflectorPlacement::AisleAndLaneEnd, 3);
    scenario.vehicle.reports = reports;
    scenario.gyro.fitted = true;
    scenario.laser.beams = 90;
    simulate(&scenario).unwrap().recording
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Encoders,
    Speed,
    Increments,
    Wheels,
    Gyro,
    Reflectors,
    Scans,
    GivenPoses,
}

fn is_of(kind: Kind, event: &RecordedEvent) -> bool {
    match kind {
        Kind::Encoders => matches!(event, RecordedEvent::Encoders(_)),
        Kind::Speed => matches!(event, RecordedEvent::Speed(_)),
        Kind::Increments => matches!(event, RecordedEvent::Increment(_)),
        Kind::Wheels => matches!(event, RecordedEvent::Wheels(_)),
        Kind::Gyro => matches!(event, RecordedEvent::Gyro(_)),
        Kind::Reflectors => matches!(event, RecordedEvent::Reflectors(_)),
        Kind::Scans => matches!(event, RecordedEvent::Scan(_)),
        Kind::GivenPoses => matches!(event, RecordedEvent::SetPose(_)),
    }
}

/// The vehicle whose logs hold events of a kind.
const fn reports(kind: Kind) -> MotionReport {
    match kind {
        Kind::Speed => MotionReport::Speed,
        Kind::Increments => MotionReport::Increments,
        Kind::Wheels => MotionReport::Differential,
        _ => MotionReport::Encoders,
    }
}

fn shift(event: &mut RecordedEvent, seconds: f64) {
    let later = |time: &mut Time| *time = time.offset(seconds);
    match event {
        RecordedEvent::Encoders(one) => later(&mut one.time),
        RecordedEvent::Speed(one) => later(&mut one.time),
        RecordedEvent::Increment(one) => later(&mut one.time),
        RecordedEvent::Wheels(one) => later(&mut one.time),
        RecordedEvent::Gyro(one) => later(&mut one.time),
        RecordedEvent::Reflectors(seen) => seen.observations.iter_mut().for_each(|one| later(&mut one.time)),
        RecordedEvent::Scan(one) => later(&mut one.start),
        RecordedEvent::SetPose(one) => later(&mut one.time),
        RecordedEvent::EncoderFaults(one) => later(&mut one.time),
    }
}

/// Changes every event of a kind, by its number among them.
fn each(recording: &mut Recording, kind: Kind, mut change: impl FnMut(usize, &mut RecordedEvent)) {
    let events = recording.events.iter_mut().filter(|event| is_of(kind, event));
    events.enumerate().for_each(|(number, event)| change(number, event));
}

/// Asserts that one finding holds all words, and that there is no other.
fn assert_named(recording: &Recording, words: &[&str], planted: &str) {
    let found = measurements(recording, "drive.agvlog");
    let [Finding { what, next }] = &found[..] else { panic!("{planted}: {found:#?}") };
    assert!(words.iter().all(|word| what.contains(word)), "{planted}: {what}");
    assert!(!next.is_empty(), "{planted}");
}

const MEASURED: [Kind; 7] =
    [Kind::Encoders, Kind::Speed, Kind::Increments, Kind::Wheels, Kind::Gyro, Kind::Reflectors, Kind::Scans];

const NAMES: [(Kind, &str); 7] = [
    (Kind::Encoders, "the encoders"),
    (Kind::Speed, "speed and steering"),
    (Kind::Increments, "the increments"),
    (Kind::Wheels, "the counters of the wheels"),
    (Kind::Gyro, "the gyro"),
    (Kind::Reflectors, "the revolutions with reflectors"),
    (Kind::Scans, "the scans"),
];

fn name(kind: Kind) -> &'static str {
    NAMES.iter().find(|(known, _)| *known == kind).unwrap().1
}

#[test]
fn sound_drives_of_every_vehicle_hold_nothing_wrong() {
    use MotionReport::{
        Ackermann, BiSteerable, Differential, Encoders, Increments, Mecanum, Omnidirectional, Speed,
        ThreeOmnidirectional, TricycleSpeed,
    };
    let all = [
        Encoders,
        TricycleSpeed,
        Speed,
        Increments,
        Differential,
        BiSteerable,
        Ackermann,
        ThreeOmnidirectional,
        Omnidirectional,
        Mecanum,
    ];
    for reports in all {
        assert_eq!(measurements(&drive(reports), "drive.agvlog"), [], "{reports:?}");
    }
}

#[test]
fn wrong_times_of_every_kind_are_named() {
    for kind in MEASURED {
        let sound = drive(reports(kind));
        let planted = |what: &str, words: &[&str], change: &dyn Fn(&mut Recording)| {
            let mut wrong = sound.clone();
            change(&mut wrong);
            assert_named(&wrong, &[&[name(kind)], words].concat(), &format!("{kind:?}, {what}"));
        };
        planted("one goes back", &["go back in time once"], &|wrong| {
            each(wrong, kind, |number, event| shift(event, if number == 40 { -1.5 } else { 0.0 }));
        });
        planted("a gap", &["gap"], &|wrong| {
            let mut number = 0;
            let mut is_left_out = |event: &RecordedEvent| {
                number += usize::from(is_of(kind, event));
                let step = if matches!(kind, Kind::Reflectors | Kind::Scans) { 60..75 } else { 500..620 };
                is_of(kind, event) && step.contains(&number)
            };
            wrong.events.retain(|event| !is_left_out(event));
        });
        planted("each twice", &["come twice"], &|wrong| {
            let twice = |event: &RecordedEvent| vec![event.clone(); 1 + usize::from(is_of(kind, event))];
            wrong.events = wrong.events.iter().flat_map(twice).collect();
        });
        if matches!(kind, Kind::Gyro | Kind::Reflectors | Kind::Scans) {
            for apart in [1.7e9, 40.0, -8.0] {
                planted("of another clock", &["another clock"], &|wrong| {
                    // No time is before the beginning of all times.
                    wrong.events.iter_mut().for_each(|event| shift(event, 100.0));
                    each(wrong, kind, |_, event| shift(event, apart));
                });
            }
        }
    }
}

#[test]
fn what_is_missing_is_named() {
    let planted: [(MotionReport, Kind, &str); 6] = [
        (MotionReport::Encoders, Kind::Encoders, "no odometry"),
        (MotionReport::Speed, Kind::Speed, "no odometry"),
        (MotionReport::Increments, Kind::Increments, "no odometry"),
        (MotionReport::Omnidirectional, Kind::Wheels, "no odometry"),
        (MotionReport::Encoders, Kind::Gyro, "has a gyro, and it says nothing"),
        (MotionReport::Encoders, Kind::GivenPoses, "nobody has told the vehicle where it starts"),
    ];
    for (reports, kind, words) in planted {
        let mut wrong = drive(reports);
        wrong.events.retain(|event| !is_of(kind, event));
        assert_named(&wrong, &[words], &format!("{kind:?}"));
    }
    let mut wrong = drive(MotionReport::Encoders);
    wrong.events.retain(|event| event.laser().is_none());
    assert_named(&wrong, &["the laser says nothing"], "no laser");
    let mut wrong = drive(MotionReport::Differential);
    wrong.parameters.vehicle = drive(MotionReport::Encoders).parameters.vehicle;
    assert_named(&wrong, &["the counters of the wheels", "the encoders are wanted"], "another vehicle");
}

/// A way in which the values of a kind are wrong.
struct Values {
    kind: Kind,
    words: &'static str,
    change: fn(usize, &mut RecordedEvent),
}

const fn values(kind: Kind, words: &'static str, change: fn(usize, &mut RecordedEvent)) -> Values {
    Values { kind, words, change }
}

fn encoders(event: &mut RecordedEvent) -> &mut agv_core::measurement::EncoderSample {
    if let RecordedEvent::Encoders(one) = event { one } else { panic!() }
}
fn speed(event: &mut RecordedEvent) -> &mut SpeedSample {
    if let RecordedEvent::Speed(one) = event { one } else { panic!() }
}
fn increment(event: &mut RecordedEvent) -> &mut PoseIncrement {
    if let RecordedEvent::Increment(one) = event { one } else { panic!() }
}
fn wheels(event: &mut RecordedEvent) -> &mut [WheelReading] {
    if let RecordedEvent::Wheels(one) = event { &mut one.wheels } else { panic!() }
}
fn rate(event: &mut RecordedEvent) -> &mut f64 {
    if let RecordedEvent::Gyro(one) = event { &mut one.rate } else { panic!() }
}
fn seen(event: &mut RecordedEvent) -> &mut Vec<agv_core::measurement::ReflectorObservation> {
    if let RecordedEvent::Reflectors(one) = event { &mut one.observations } else { panic!() }
}
fn scan(event: &mut RecordedEvent) -> &mut agv_host_sim::recording::RecordedScan {
    if let RecordedEvent::Scan(one) = event { one } else { panic!() }
}

const VALUES: [Values; 31] = [
    values(Kind::Encoders, "the driving wheel beyond its range", |_, event| encoders(event).drive |= 1 << 31),
    values(Kind::Encoders, "the steering beyond its range", |_, event| encoders(event).steering |= 1 << 31),
    values(Kind::Encoders, "jump at the driving wheel", |number, event| {
        encoders(event).drive = (encoders(event).drive + [0, 1 << 15][number % 2]) % (1 << 16);
    }),
    values(Kind::Encoders, "the driving wheel that stands still", |_, event| encoders(event).drive = 77),
    values(Kind::Wheels, "wheel 1 beyond its range", |_, event| wheels(event)[0].count |= 1 << 31),
    values(Kind::Wheels, "wheel 2 beyond its range", |_, event| wheels(event)[1].count |= 1 << 31),
    values(Kind::Wheels, "jump at wheel 2", |number, event| {
        wheels(event)[1].count = (wheels(event)[1].count + [0, 1 << 15][number % 2]) % (1 << 16);
    }),
    values(Kind::Wheels, "wheel 1 that stands still", |_, event| wheels(event)[0].count = 77),
    values(Kind::Wheels, "wheel 2 that stands still", |_, event| wheels(event)[1].count = 77),
    values(Kind::Speed, "are no numbers", |number, event| {
        if number % 20 == 0 {
            speed(event).speed = f64::NAN;
        }
    }),
    values(Kind::Speed, "are no numbers", |_, event| speed(event).steering = f64::INFINITY),
    values(Kind::Speed, "are faster than", |_, event| speed(event).speed *= 1000.0),
    values(Kind::Speed, "more than half a turn", |_, event| speed(event).steering = 20.0),
    values(Kind::Speed, "stands while the laser", |_, event| speed(event).speed = 0.0),
    values(Kind::Increments, "are no numbers", |_, event| increment(event).displacement.theta = f64::NAN),
    values(Kind::Increments, "are faster than", |_, event| increment(event).displacement.x *= 1000.0),
    values(Kind::Increments, "stands while the laser", |_, event| increment(event).displacement = Pose::default()),
    values(Kind::Gyro, "are no numbers", |_, event| *rate(event) = f64::NAN),
    values(Kind::Gyro, "are beyond the gyro's range", |_, event| *rate(event) += 10.0),
    values(Kind::Gyro, "are one value again and again", |_, event| *rate(event) = 0.01),
    values(Kind::Reflectors, "no numbers", |_, event| seen(event).iter_mut().for_each(|one| one.range = f32::NAN)),
    values(Kind::Reflectors, "no numbers", |_, event| seen(event).iter_mut().for_each(|one| one.range *= -1.0)),
    values(Kind::Reflectors, "ranges of more than", |_, event| {
        seen(event).iter_mut().for_each(|one| one.range *= 1000.0);
    }),
    values(Kind::Reflectors, "not in order of time", |_, event| {
        let seen = seen(event);
        if let (Some(first), Some(last)) = (seen.first().map(|one| one.time), seen.last().map(|one| one.time)) {
            let count = seen.len();
            seen[0].time = last;
            seen[count - 1].time = first;
        }
    }),
    values(Kind::Reflectors, "are empty", |_, event| seen(event).clear()),
    values(Kind::Scans, "no return at all", |_, event| scan(event).ranges.fill(f32::NAN)),
    values(Kind::Scans, "ranges of more than", |_, event| scan(event).ranges.iter_mut().for_each(|one| *one *= 1000.0)),
    values(Kind::Scans, "in no turn", |_, event| scan(event).bearing_step *= 57.3),
    values(Kind::Scans, "in no turn", |_, event| scan(event).bearing_step = 0.0),
    values(Kind::Scans, "last longer than", |_, event| scan(event).beam_interval *= 10.0),
    values(Kind::Scans, "another number of strengths", |_, event| scan(event).intensities = vec![7; 5]),
];

#[test]
fn wrong_values_of_every_kind_are_named() {
    for Values { kind, words, change } in &VALUES {
        let mut wrong = drive(reports(*kind));
        each(&mut wrong, *kind, change);
        assert_named(&wrong, &[name(*kind), words], &format!("{kind:?}, {words}"));
    }
}

#[test]
fn what_a_sensor_says_again_and_again_is_named() {
    for kind in [Kind::Reflectors, Kind::Scans] {
        let mut wrong = drive(reports(kind));
        let first = wrong.events.iter().filter(|event| is_of(kind, event)).nth(3).unwrap().clone();
        each(&mut wrong, kind, |_, event| {
            let late = event.time().unwrap().since(first.time().unwrap());
            *event = first.clone();
            shift(event, late);
        });
        assert_named(&wrong, &[name(kind), "the same one again and again"], &format!("{kind:?}"));
    }
}

#[test]
fn a_laser_and_a_gyro_that_the_settings_do_not_have_are_named() {
    let mut wrong = drive(MotionReport::Encoders);
    let second = LaserId::new(1).unwrap();
    each(&mut wrong, Kind::Scans, |_, event| scan(event).laser = second);
    assert_named(&wrong, &["the scans of laser 2 are not used"], "second laser");
    let mut wrong = drive(MotionReport::Encoders);
    wrong.parameters.gyro.is_fitted = false;
    assert_named(&wrong, &["the gyro are not used"], "no gyro");
}

#[test]
fn every_fault_of_the_encoders_is_named_with_its_time() {
    use EncoderFault::{
        Frozen, HeartbeatLost, Jumped, Late, Missing, OutOfRange, Reported, WrongDirection, WrongRange,
    };
    let faults = [
        (Late, "is late"),
        (Missing, "is missing"),
        (Frozen, "stands still"),
        (Jumped, "jumps"),
        (OutOfRange, "beyond its range"),
        (Reported, "an error of its own"),
        (HeartbeatLost, "no heartbeat"),
        (WrongRange, "another number of positions"),
        (WrongDirection, "the other way"),
    ];
    for (fault, words) in faults {
        for encoder in ["drive", "steering"] {
            let mut wrong = drive(MotionReport::Encoders);
            let place = wrong.events.len() / 2;
            let time = wrong.events[..place].iter().filter_map(RecordedEvent::time).max().unwrap();
            let of = |time, fault| match encoder {
                "drive" => EncoderFaults { time, drive: fault, steering: None },
                _ => EncoderFaults { time, drive: None, steering: fault },
            };
            wrong.events.insert(place, RecordedEvent::EncoderFaults(of(time, Some(fault))));
            wrong.events.insert(place + 1, RecordedEvent::EncoderFaults(of(time.offset(1.5), Some(fault))));
            wrong.events.insert(place + 2, RecordedEvent::EncoderFaults(of(time.offset(2.5), None)));
            let encoder = format!("the {encoder} encoder");
            assert_named(&wrong, &[&encoder, words, "2 times, for 2.5 s"], words);
        }
    }
}

/// A way in which a given pose is wrong, and how it is named.
type PlantedPose = (&'static str, fn(&mut PoseFix));

#[test]
fn given_poses_that_cannot_help_are_named() {
    let fix = |event: &mut RecordedEvent, change: fn(&mut PoseFix)| {
        if let RecordedEvent::SetPose(fix) = event {
            change(fix);
        }
    };
    let planted: [PlantedPose; 5] = [
        ("no numbers", |fix| fix.pose.x = f64::NAN),
        ("negative deviations", |fix| fix.heading_deviation = -0.1),
        // What RViz gives to every pose: 0.25 m^2 and 0.0685 rad^2.
        ("RViz", |fix| (fix.position_deviation, fix.heading_deviation) = (0.5, 0.2618)),
        ("good to 3.00 m", |fix| fix.position_deviation = 3.0),
        ("another clock", |fix| fix.time = fix.time.offset(1.7e9)),
    ];
    for (words, change) in planted {
        let mut wrong = drive(MotionReport::Encoders);
        each(&mut wrong, Kind::GivenPoses, |_, event| fix(event, change));
        assert_named(&wrong, &[words], words);
    }
}
