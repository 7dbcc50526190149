//! The encoders of a vehicle as one measurement.

use agv_core::geometry::Pose;
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Mode, Parameters, PoseFix, Reason};
use agv_core::measurement::{EncoderFault, EncoderFaults, EncoderSample, Time};
use agv_core::odometry::{Counted, CounterRange, Tricycle, Vehicle};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::encoder::{CodeSequence, EncoderSettings, EncoderState, Reporting};
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup, FAULT_PERIOD};
use agv_wire::can::frame::Frame;
use agv_wire::can::plausibility::PlausibilityLimits;

use super::frames::frame;
use super::node::Node;

fn at(milliseconds: u64) -> Time {
    Time::from_micros(milliseconds * 1000)
}

fn channel(number: u8, reporting: Reporting) -> ChannelSettings {
    ChannelSettings {
        encoder: EncoderSettings { reporting, ..EncoderSettings::new(NodeId::new(number).unwrap()) },
        limits: PlausibilityLimits::every(0.010, 20_000.0, 25_000.0),
        counted: if number == 2 { Counted::Steering } else { Counted::Turn },
    }
}

/// The counters of driving wheel and steering.
fn two(counts: Counts) -> EncoderSample {
    let Counts { time, counts: [drive, steering, ..] } = counts;
    EncoderSample { time, drive, steering }
}

struct Bench {
    group: EncoderGroup,
    nodes: [Node; 2],
    samples: Vec<EncoderSample>,
    syncs: usize,
}

impl Bench {
    fn new(reporting: Reporting) -> Self {
        let group = EncoderGroup::new(&[channel(1, reporting), channel(2, reporting)], 0.010, at(0));
        Self { group, nodes: [Node::new(1), Node::new(2)], samples: Vec::new(), syncs: 0 }
    }

    fn states(&self) -> Vec<EncoderState> {
        self.group.states().collect()
    }

    fn poll(&mut self, now: Time) {
        for _ in 0..8 {
            let Some(sent) = self.group.poll(now) else { continue };
            self.syncs += usize::from(sent == frame("080#"));
            for index in 0..2 {
                for answer in self.nodes[index].handle(&sent) {
                    self.hear(&answer, now);
                }
            }
        }
    }

    fn hear(&mut self, frame: &Frame, now: Time) {
        self.samples.extend(self.group.handle(frame, now).map(two));
    }

    fn start(reporting: Reporting) -> Self {
        let mut bench = Self::new(reporting);
        (0..30).for_each(|millisecond| bench.poll(at(millisecond)));
        assert_eq!(bench.states(), [EncoderState::Reporting; 2]);
        bench
    }

    /// Positions of both, the steering's `lag` ms after the drive's.
    fn report(&mut self, millisecond: u64, drive: u32, steering: u32, lag: u64) {
        self.hear(&self.nodes[0].position(drive), at(millisecond));
        self.hear(&self.nodes[1].position(steering), at(millisecond + lag));
    }
}

#[test]
fn synchronous_encoders_give_exact_samples() {
    let mut bench = Bench::start(Reporting::Synchronous);
    bench.syncs = 0;
    let mut expected = Vec::new();
    for step in 3..20u32 {
        let millisecond = 10 * u64::from(step);
        bench.poll(at(millisecond));
        // The frames come a little later, in either order; the positions are those at the SYNC.
        let (drive, steering) = (1000 + 7 * step, 500 - step);
        let frames = [bench.nodes[0].position(drive), bench.nodes[1].position(steering)];
        let order = if step % 2 == 0 { [0, 1] } else { [1, 0] };
        for (delay, index) in (1..).zip(order) {
            bench.hear(&frames[index], at(millisecond + delay));
        }
        expected.push(EncoderSample { time: at(millisecond), drive, steering });
    }
    assert_eq!(bench.samples, expected);
    assert_eq!(bench.syncs, expected.len());
}

#[test]
fn the_steering_is_taken_where_the_driving_wheel_was_read() {
    let mut bench = Bench::start(Reporting::Timer { period: 10 });
    // The steering crosses zero; its readings come 4 ms after those of the driving wheel.
    for step in 0..5u32 {
        let steering = 20u32.wrapping_sub(10 * step) & 0x00FF_FFFF;
        bench.report(30 + 10 * u64::from(step), 100 * step, steering, 4);
    }
    let sample = |millisecond, drive, steering| EncoderSample { time: at(millisecond), drive, steering };
    // At the first reading of the driving wheel the steering was not known yet.
    assert_eq!(
        bench.samples,
        [sample(40, 100, 14), sample(50, 200, 4), sample(60, 300, 0x00FF_FFFA), sample(70, 400, 0x00FF_FFF0)]
    );
}

#[test]
fn no_sample_while_an_encoder_is_faulty_and_no_false_way_after_a_jump() {
    let mut bench = Bench::start(Reporting::Timer { period: 10 });
    let mut raw = 16_777_000u32;
    let mut millisecond = 30;
    for step in 0..100 {
        raw = if step == 40 { 5_000_000 } else { (raw + 50) % (1 << 24) };
        bench.report(millisecond, raw, 0, 0);
        let faults = bench.group.faults(at(millisecond));
        let expected = (40..=60).contains(&step).then_some(EncoderFault::Jumped);
        assert_eq!((faults.drive, faults.steering), (expected, None), "{step}");
        millisecond += 10;
    }
    assert_eq!(bench.samples.len(), 40 + 39);
    let steps: Vec<i64> = bench
        .samples
        .windows(2)
        .map(|pair| agv_core::odometry::CounterRange::BITS_24.step(pair[0].drive, pair[1].drive))
        .collect();
    // The way between the jump and the withdrawal is there; only that of the jump itself is lost.
    assert_eq!(steps[39], 21 * 50);
    assert!(steps.iter().enumerate().all(|(index, step)| index == 39 || *step == 50), "{steps:?}");
}

#[test]
fn one_missing_encoder_is_told_from_the_other() {
    let mut bench = Bench::start(Reporting::Timer { period: 10 });
    for step in 0..10 {
        bench.report(30 + 10 * step, 0, 0, 0);
    }
    for step in 10..16 {
        bench.hear(&bench.nodes[0].position(0), at(30 + 10 * step));
    }
    let count = bench.samples.len();
    // The steering spoke last at 120 ms.
    assert!(!bench.group.faults(at(145)).any());
    let steering_fault = |faults: EncoderFaults| {
        assert_eq!(faults.drive, None);
        faults.steering
    };
    assert_eq!(steering_fault(bench.group.faults(at(146))), Some(EncoderFault::Late));
    assert_eq!(steering_fault(bench.group.faults(at(166))), Some(EncoderFault::Missing));
    assert_eq!(count, 10);
}

#[test]
fn an_emergency_holds_until_it_is_over() {
    let mut bench = Bench::start(Reporting::Timer { period: 10 });
    for step in 0..200 {
        let millisecond = 30 + 10 * step;
        match step {
            50 => bench.hear(&frame("082#1050050000000000"), at(millisecond)),
            120 => bench.hear(&frame("082#0000000000000000"), at(millisecond)),
            _ => {}
        }
        bench.report(millisecond, 0, 0, 0);
        let expected = (50..=139).contains(&step).then_some(EncoderFault::Reported);
        assert_eq!(bench.group.faults(at(millisecond)).steering, expected, "{step}");
    }
}

#[test]
fn an_encoder_whose_range_is_not_that_of_the_settings_gives_a_fault_and_no_samples() {
    // What 6002h tells (none: it refuses), the number of positions in the settings, and whether both can be true.
    let cases = [
        (Some(0x1FFF), 1 << 16, false),
        (Some(0x1FFF), 1 << 13, true),
        (Some(0x2000), 1 << 13, true),
        (Some(0xFFFF), 1 << 13, false),
        (Some(0x00FF_FFFF), 1 << 32, false),
        (Some(0xFFFF_FFFF), 1 << 32, true),
        (Some(35_999), 36_000, true),
        (Some(36_000), 36_000, true),
        (Some(36_000), 35_999, false),
        (Some(0), 36_000, true),
        (None, 36_000, true),
    ];
    for ((told, set, is_right), is_drive) in cases.iter().flat_map(|case| [(*case, false), (*case, true)]) {
        let range = CounterRange::new(set);
        let given = |number, is_it: bool| {
            let channel = channel(number, Reporting::Timer { period: 10 });
            let range = is_it.then_some(range).flatten();
            ChannelSettings { encoder: EncoderSettings { range, ..channel.encoder }, ..channel }
        };
        let mut bench = Bench::new(Reporting::Timer { period: 10 });
        bench.group = EncoderGroup::new(&[given(1, is_drive), given(2, !is_drive)], 0.010, at(0));
        let node = &mut bench.nodes[usize::from(!is_drive)];
        match told {
            Some(told) => _ = node.objects.insert((0x6002, 0), (told, 4)),
            None => _ = node.objects.remove(&(0x6002, 0)),
        }
        (0..30).for_each(|millisecond| bench.poll(at(millisecond)));
        assert_eq!(bench.states(), [EncoderState::Reporting; 2]);
        for step in 0..100 {
            // Counters just below zero, where a wrong range becomes a wrong angle.
            bench.report(30 + 10 * step, 0x1F00, 0x1F00, 0);
            let faults = bench.group.faults(at(30 + 10 * step));
            let (its, other) = if is_drive { (faults.drive, faults.steering) } else { (faults.steering, faults.drive) };
            let expected = (!is_right).then_some(EncoderFault::WrongRange);
            assert_eq!((its, other), (expected, None), "{told:?} {set} {step}");
        }
        assert_eq!(bench.samples.len(), if is_right { 100 } else { 0 }, "{told:?} {set}");
    }
}

#[test]
fn an_encoder_that_counts_the_other_way_than_set_is_told() {
    use CodeSequence::{FallingClockwise, RisingClockwise};
    let cases = [
        (Some(0), None, true),
        (Some(0), Some(RisingClockwise), true),
        (Some(0), Some(FallingClockwise), false),
        (Some(5), Some(FallingClockwise), true),
        (Some(5), Some(RisingClockwise), false),
        // It does not tell.
        (None, Some(FallingClockwise), true),
    ];
    for (told, set, is_right) in cases {
        let given = |number, code_sequence| {
            let channel = channel(number, Reporting::Timer { period: 10 });
            ChannelSettings { encoder: EncoderSettings { code_sequence, ..channel.encoder }, ..channel }
        };
        let mut bench = Bench::new(Reporting::Timer { period: 10 });
        bench.group = EncoderGroup::new(&[given(1, set), given(2, None)], 0.010, at(0));
        bench.nodes[0].objects.extend(told.map(|told| ((0x6000, 0), (told, 2))));
        (0..30).for_each(|millisecond| bench.poll(at(millisecond)));
        for step in 0..100 {
            bench.report(30 + 10 * step, 7 * step as u32, 0, 0);
            let faults = bench.group.faults(at(30 + 10 * step));
            let expected = (!is_right).then_some(EncoderFault::WrongDirection);
            assert_eq!((faults.drive, faults.steering), (expected, None), "{told:?} {set:?} {step}");
        }
        assert_eq!(bench.samples.len(), if is_right { 100 } else { 0 }, "{told:?} {set:?}");
    }
}

#[test]
fn faults_are_told_when_they_change_and_while_they_last() {
    let mut bench = Bench::start(Reporting::Timer { period: 10 });
    let mut told = Vec::new();
    for millisecond in 30..600 {
        let is_silent = (100..200).contains(&millisecond);
        if millisecond % 10 == 0 && !is_silent {
            bench.report(millisecond, 0, 0, 0);
        }
        told.extend(bench.group.poll_faults(at(millisecond)));
    }
    let reported: Vec<_> = told.iter().map(|faults| (faults.time, faults.drive)).collect();
    // The last reading was at 90 ms.
    assert_eq!(reported[0], (at(116), Some(EncoderFault::Late)));
    assert!(reported.contains(&(at(136), Some(EncoderFault::Missing))));
    assert!(told.windows(2).all(|pair| pair[1].time.since(pair[0].time) <= FAULT_PERIOD + 1e-9), "{reported:?}");
    // The reading at 200 ms ended it; then the recovery time of 200 ms goes by.
    let last = told.last().unwrap();
    assert!(!last.any());
    assert_eq!(last.time, at(400));
}

fn localizer() -> Box<Localizer<CapacitiesOf<16, 16, 16, 16>>> {
    let vehicle = Vehicle::Tricycle(Tricycle {
        wheelbase: 1.5,
        drive_scale: 1e-4,
        drive_range: CounterRange::BITS_24,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_24,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    });
    let mut localizer = Box::new(Localizer::new(Parameters::new(vehicle, Pose::new(0.9, 0.0, 0.0))));
    let fix = PoseFix { time: at(25), pose: Pose::default(), position_deviation: 0.01, heading_deviation: 0.001 };
    localizer.handle(&Event::SetPose(fix));
    localizer
}

/// What befalls the encoders of a vehicle that drives 1 m/s, from 1 s on.
#[derive(Clone, Copy, Debug)]
enum Trouble {
    DriveSilent,
    SteeringSilent,
    DriveFrozen,
    DriveJump,
    SteeringOutOfRange,
    DriveEmergency,
}

#[test]
fn every_trouble_is_a_mode_with_its_reason_within_50_ms() {
    use Trouble::{DriveEmergency, DriveFrozen, DriveJump, DriveSilent, SteeringOutOfRange, SteeringSilent};
    for (trouble, reason) in [
        (DriveSilent, Reason::DriveEncoder),
        (SteeringSilent, Reason::SteeringEncoder),
        (DriveFrozen, Reason::DriveEncoder),
        (DriveJump, Reason::DriveEncoder),
        (SteeringOutOfRange, Reason::SteeringEncoder),
        (DriveEmergency, Reason::DriveEncoder),
    ] {
        let mut bench = Bench::start(Reporting::Timer { period: 10 });
        let mut localizer = localizer();
        let mut changed = None;
        for millisecond in 30..1200u64 {
            let is_troubled = millisecond >= 1000;
            let now = at(millisecond);
            if millisecond % 10 == 0 {
                let ticks = (10 * (millisecond - 30)) as u32;
                let drive = match trouble {
                    DriveFrozen if is_troubled => 9_600,
                    DriveJump if is_troubled => ticks + 1_000_000,
                    _ => ticks,
                };
                // The other encoder's range is 24 bits.
                let steering = if matches!(trouble, SteeringOutOfRange) && is_troubled { u32::MAX } else { 0 };
                if !(matches!(trouble, DriveSilent) && is_troubled) {
                    bench.hear(&bench.nodes[0].position(drive), now);
                }
                if !(matches!(trouble, SteeringSilent) && is_troubled) {
                    bench.hear(&bench.nodes[1].position(steering), now);
                }
            }
            if matches!(trouble, DriveEmergency) && millisecond == 1000 {
                bench.hear(&frame("081#1050050000000000"), now);
            }
            for sample in bench.samples.drain(..) {
                localizer.handle(&Event::Encoders(sample));
            }
            if let Some(faults) = bench.group.poll_faults(now) {
                localizer.handle(&Event::EncoderFaults(faults));
            }
            let output = localizer.outputs().pose;
            if output.mode == Mode::WithoutOdometry && changed.is_none() {
                changed = Some((millisecond, output.reason));
            }
            assert!(is_troubled || output.mode == Mode::DeadReckoning, "{trouble:?} {millisecond} {output:?}");
        }
        let (millisecond, told) = changed.unwrap_or_else(|| panic!("{trouble:?} was not told"));
        assert_eq!(told, reason, "{trouble:?}");
        assert!(millisecond <= 1050, "{trouble:?}: {millisecond}");
    }
}

/// Four encoders that are listened to: two wheels that drive and steer.
fn four() -> (EncoderGroup, [Node; 4]) {
    let channels = [1, 2, 3, 4].map(|number| {
        let settings = channel(number, Reporting::Timer { period: 10 });
        let encoder = EncoderSettings { is_managed: false, heartbeat: 0, ..settings.encoder };
        let encoder = EncoderSettings { range: Some(CounterRange::BITS_24), ..encoder };
        let counted = if number % 2 == 0 { Counted::Steering } else { Counted::Turn };
        ChannelSettings { encoder, counted, ..settings }
    });
    (EncoderGroup::new(&channels, 0.010, at(0)), [1, 2, 3, 4].map(Node::new))
}

#[test]
fn four_encoders_are_one_sample_at_the_time_of_the_first() {
    let (mut group, nodes) = four();
    let mut samples = Vec::new();
    for step in 0..10u32 {
        let counts = [100 * step, 5000 + step, 10 * step + 7, 9000 - step];
        // Each a little later than the one before.
        for (place, node) in nodes.iter().enumerate() {
            let now = at(10 * u64::from(step) + 2 * place as u64);
            samples.extend(group.handle(&node.position(counts[place]), now));
        }
    }
    // At the first reading of the first encoder the others were not known yet; each of them lags by 2 ms more.
    assert_eq!(samples.len(), 9);
    for (step, sample) in (1..).zip(&samples) {
        assert_eq!(sample.time, at(10 * u64::from(step)), "{step}");
        assert_eq!(sample.counts[0], 100 * step);
        let third = 10.0 * (f64::from(step) - 0.4) + 7.0;
        assert!((f64::from(sample.counts[2]) - third).abs() <= 0.5, "{step}: {sample:?}");
        assert!(sample.counts[1].abs_diff(5000 + step) <= 1 && sample.counts[3].abs_diff(9000 - step) <= 1);
    }
}

#[test]
fn a_jump_of_any_wheel_is_a_fault_of_the_drive_and_no_false_way_of_that_wheel() {
    for jumping in 0..4 {
        let (mut group, nodes) = four();
        let (mut samples, mut told) = (Vec::new(), Vec::new());
        for step in 0..100u32 {
            for (place, node) in nodes.iter().enumerate() {
                let jump = if place == jumping && step >= 40 { 3_000_000 } else { 0 };
                samples.extend(group.handle(&node.position(50 * step + jump), at(30 + 10 * u64::from(step))));
            }
            let faults = group.faults(at(30 + 10 * u64::from(step)));
            told.push((faults.drive, faults.steering));
        }
        let is_steering = jumping % 2 == 1;
        let fault = Some(EncoderFault::Jumped);
        assert_eq!(told[40], if is_steering { (None, fault) } else { (fault, None) }, "{jumping}");
        assert_eq!((told[39], told[99]), ((None, None), (None, None)), "{jumping}");
        // Behind the fault a way goes on from where it was, but for that of the jump; an angle is where it is.
        let (first, last) = (samples[0].counts[jumping], samples.last().unwrap().counts[jumping]);
        let moved = CounterRange::BITS_24.step(first, last);
        assert_eq!(moved, if is_steering { 99 * 50 + 3_000_000 } else { 98 * 50 }, "{jumping}");
    }
}
