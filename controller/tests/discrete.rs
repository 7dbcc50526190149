//! What wires say of the pose, and what the controller is told by them.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

use std::cell::Cell;
use std::convert::Infallible;
use std::rc::Rc;

use agv_controller::{
    Bus, BusOutput, ControllerIdentity, DEBOUNCE, DiscreteInputs, DiscreteLines, DiscreteReport, Estimate, Line,
    LineSet, SettingObjects, Troubles,
};
use agv_core::geometry::Pose;
use agv_core::localizer::PredictionState;
use agv_core::measurement::Time;
use agv_core::state::{LaserHealth, Mode, PoseOutput, ProtectionLevel, Reason, Relocalization};
use agv_settings::Settings;
use agv_wire::can::canopen::{Message, NodeId, transmit_pdo_id};
use agv_wire::can::frame::{Frame, standard_id};
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal_mock::eh1::MockError;
use embedded_hal_mock::eh1::digital::{Mock, State, Transaction};
use proptest::prelude::*;

const MODES: [Mode; 8] = [
    Mode::NotLocalised,
    Mode::Reflectors,
    Mode::Features,
    Mode::Mixed,
    Mode::DeadReckoning,
    Mode::WithoutOdometry,
    Mode::Lost,
    Mode::Degraded,
];
/// Levels that suffice to dock, to travel, and to nothing: by default the limits are 5 and 15 cm, 0.5 and 2 deg.
const LEVELS: [(f64, f64); 5] = [(0.03, 0.005), (0.1, 0.005), (0.03, 0.02), (0.2, 0.005), (0.03, 0.05)];

fn at(milliseconds: u64) -> Time {
    Time::from_micros(1_000_000 + milliseconds * 1000)
}

fn pose(mode: Mode, (position, heading): (f64, f64), time: Time) -> PoseOutput {
    PoseOutput {
        time,
        pose: Pose { x: 1.0, y: 2.0, theta: 0.5 },
        covariance: [1e-6, 0.0, 1e-6, 0.0, 0.0, 1e-8],
        mode,
        reason: Reason::None,
        dead_reckoning_distance: 0.0,
        correction: 0.0,
        smooth: Pose::default(),
        acceptance: 1.0,
        level: ProtectionLevel { position, heading },
        normalised_square: 2.0,
        resets: 0,
        last_reset: 0.0,
        overflows: 0,
    }
}

fn report(is_pose_valid: bool, is_within_docking_limits: bool, is_faulty: bool) -> DiscreteReport {
    let level = match (is_pose_valid, is_within_docking_limits) {
        (true, true) => LEVELS[0],
        (true, false) => LEVELS[1],
        (false, _) => LEVELS[3],
    };
    let pose = pose(Mode::Reflectors, level, at(0));
    DiscreteReport::of(Some(&pose), &Settings::default().parameters.alert_limits, u8::from(is_faulty), 0.05, at(0))
}

/// Pins that do what is written down, and what they do at the end, when their outputs become safe.
fn mocked(
    pose_valid: &[Transaction],
    docking: &[Transaction],
    fault: &[Transaction],
) -> (LineSet<Mock, Mock>, [Mock; 3]) {
    let safe = [Transaction::set(State::Low)];
    let pins = [pose_valid, docking, fault].map(|transactions| Mock::new(transactions.iter().chain(&safe)));
    let [pose_valid, within_docking_limits, fault] = pins.clone().map(Some);
    (LineSet { pose_valid, within_docking_limits, fault, ..LineSet::NONE }, pins)
}

fn low() -> Transaction {
    Transaction::set(State::Low)
}

fn high() -> Transaction {
    Transaction::set(State::High)
}

fn broken(transaction: Transaction) -> Transaction {
    transaction.with_error(MockError::Io(std::io::ErrorKind::BrokenPipe))
}

#[test]
fn outputs_are_levels_and_fault_is_active_low() {
    let (lines, pins) = mocked(
        &[low(), high(), high(), high(), low(), low()],
        &[low(), high(), low(), high(), low(), low()],
        &[low(), high(), high(), low(), high(), low()],
    );
    let mut lines = DiscreteLines::new(lines);
    assert_eq!(lines.poll(None, at(0)), DiscreteInputs::default());
    for said in
        [report(true, true, false), report(true, false, false), report(true, true, true), report(false, false, false)]
    {
        assert_eq!(lines.poll(Some(&said), at(1)), DiscreteInputs::default());
    }
    // What was said 51 ms ago is said no more.
    lines.poll(Some(&report(true, true, false)), at(51));
    drop(lines);
    pins.into_iter().for_each(|mut pin| pin.done());
}

#[test]
fn a_line_that_cannot_be_set_is_a_fault_on_the_wire_and_on_the_bus() {
    // The fault line falls in the same cycle.
    let (lines, pins) = mocked(&[broken(high()), high()], &[high(), high()], &[high(), low(), high()]);
    let mut lines = DiscreteLines::new(lines);
    let said = report(true, true, false);
    assert_eq!(lines.poll(Some(&said), at(1)).failed, Line::PoseValid.bit());
    assert_eq!(lines.poll(Some(&said), at(2)).failed, 0);
    drop(lines);
    pins.into_iter().for_each(|mut pin| pin.done());
    // Where the fault line itself fails, nothing is valid.
    let (lines, pins) = mocked(&[low()], &[low()], &[broken(high())]);
    let mut lines = DiscreteLines::new(lines);
    assert_eq!(lines.poll(Some(&said), at(1)).failed, Line::Fault.bit());
    drop(lines);
    pins.into_iter().for_each(|mut pin| pin.done());
    // An input that cannot be read.
    let mut input = Mock::new(&[broken(Transaction::get(State::High)), Transaction::get(State::High)]);
    let (mut lines, pins) = mocked(&[high(), high()], &[high(), high()], &[low(), high()]);
    lines.standstill = Some(input.clone());
    let mut lines = DiscreteLines::new(lines);
    assert_eq!(
        lines.poll(Some(&said), at(1)),
        DiscreteInputs { failed: Line::Standstill.bit(), ..DiscreteInputs::default() }
    );
    assert_eq!(lines.poll(Some(&said), at(2)), DiscreteInputs::default());
    drop(lines);
    input.done();
    pins.into_iter().for_each(|mut pin| pin.done());
}

/// A level that the test sees, or sets.
#[derive(Clone, Debug, Default)]
struct Wire(Rc<Cell<bool>>);

impl ErrorType for Wire {
    type Error = Infallible;
}

impl OutputPin for Wire {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}

impl InputPin for Wire {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.get())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.get())
    }
}

/// Five wires: pose valid, within docking limits, fault, standstill, reset.
fn wires() -> ([Wire; 5], DiscreteLines<Wire, Wire>) {
    let wires: [Wire; 5] = Default::default();
    let [pose_valid, within_docking_limits, fault, standstill, reset] = wires.clone().map(Some);
    (wires, DiscreteLines::new(LineSet { pose_valid, within_docking_limits, fault, standstill, reset }))
}

#[test]
fn who_panics_leaves_the_outputs_safe() {
    let (wires, lines) = wires();
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || {
        let mut lines = lines;
        lines.poll(Some(&report(true, true, false)), at(1));
        std::panic::panic_any("on purpose");
    }));
    assert!(outcome.is_err());
    assert_eq!(wires.map(|wire| wire.0.get()), [false; 5]);
    let (wires, mut lines) = self::wires();
    lines.poll(Some(&report(true, true, false)), at(1));
    assert_eq!(wires.clone().map(|wire| wire.0.get()), [true, true, true, false, false]);
    assert_eq!(lines.make_safe(), 0);
    assert_eq!(wires.map(|wire| wire.0.get()), [false; 5]);
}

/// What the inputs have become of levels that are read every millisecond.
fn read(input: usize, levels: impl IntoIterator<Item = bool>) -> Vec<DiscreteInputs> {
    let (wires, mut lines) = wires();
    let read = |(now, level): (u64, bool)| {
        wires[input].0.set(level);
        lines.poll(None, at(now))
    };
    (0..).zip(levels).map(read).collect()
}

fn resets(levels: impl IntoIterator<Item = bool>) -> usize {
    read(4, levels).iter().filter(|inputs| inputs.is_reset).count()
}

#[test]
fn a_reset_is_an_edge_that_rises() {
    let held = |level: bool, milliseconds: usize| std::iter::repeat_n(level, milliseconds);
    // It was high from the start: nobody has pressed it.
    assert_eq!(resets(held(true, 500)), 0);
    assert_eq!(resets(held(false, 500)), 0);
    assert_eq!(resets(held(true, 100).chain(held(false, 100)).chain(held(true, 500))), 1);
    assert_eq!(resets(held(false, 100).chain(held(true, 500)).chain(held(false, 500))), 1);
    assert_eq!(resets(held(false, 100).chain(held(true, 19)).chain(held(false, 500))), 0);
}

proptest! {
    /// Shorter than [`DEBOUNCE`] nothing counts; longer than that everything does, once.
    #[test]
    fn contacts_may_bounce(pulses in prop::collection::vec((1_usize..60, 1_usize..60), 1..20)) {
        let longest = (DEBOUNCE * 1e3) as usize;
        let mut levels = vec![false; 100];
        let mut expected = 0;
        // What was believed, and for how long the level now holds.
        let mut is_high = false;
        for (up, down) in pulses {
            levels.extend(std::iter::repeat_n(true, up));
            if up > longest && !is_high {
                (expected, is_high) = (expected + 1, true);
            }
            levels.extend(std::iter::repeat_n(false, down));
            is_high &= down <= longest;
        }
        prop_assert_eq!(resets(levels.iter().copied()), expected);
        let standing = read(3, levels.iter().copied());
        for (number, inputs) in standing.iter().enumerate() {
            let before = &levels[number.saturating_sub(longest)..=number];
            if before.len() > longest && before.iter().all(|level| *level) {
                prop_assert!(inputs.is_standing, "{number}");
            }
            if before.iter().all(|level| !*level) {
                prop_assert!(!inputs.is_standing, "{number}");
            }
        }
    }
}

/// A controller with its wires, and encoders that nobody has to answer for.
struct Bench {
    bus: Bus,
    settings: Settings,
    lines: DiscreteLines<Wire, Wire>,
    wires: [Wire; 5],
    answers: Vec<Frame>,
    emergencies: Vec<(u16, u8)>,
    encoder: u32,
    /// Events that its localiser has answered.
    answered: u32,
}

impl Bench {
    fn new() -> Self {
        let mut settings = Settings::default();
        settings.nodes.is_master = false;
        let bus = Bus::new(&settings, ControllerIdentity::default(), Troubles::default(), at(0));
        let (wires, lines) = wires();
        Self { bus, settings, lines, wires, answers: Vec::new(), emergencies: Vec::new(), encoder: 0, answered: 0 }
    }

    fn hear(&mut self, frame: &Frame, now: u64) {
        let Self { bus, settings, answers, .. } = self;
        bus.hear(frame, at(now), &mut SettingObjects::new(settings), |output| {
            if let BusOutput::Send(frame) = output {
                answers.push(frame);
            }
        });
    }

    /// Both encoders report; the wheel has turned by so many ticks.
    fn encoders(&mut self, ticks: u32, now: u64) {
        self.encoder = self.encoder.wrapping_add(ticks);
        let count = self.encoder.to_le_bytes();
        self.hear(&Frame::of(transmit_pdo_id(NodeId::new(1).unwrap(), 1), count), now);
        self.hear(&Frame::of(transmit_pdo_id(NodeId::new(2).unwrap(), 1), [0; 4]), now);
    }

    fn estimate(&mut self, mode: Mode, level: (f64, f64), time: u64) {
        self.answered += 1;
        let answered = self.answered;
        let pose = pose(mode, level, at(time));
        let prediction = PredictionState::default();
        self.bus.update(&Estimate { answered, pose, prediction, relocalization: Relocalization::Idle });
    }

    fn poll(&mut self, now: u64) {
        let Self { bus, lines, emergencies, .. } = self;
        bus.poll(at(now), LaserHealth::Sound, |output| {
            if let BusOutput::Send(frame) = output
                && let Ok(Message::Emergency { emergency, .. }) = Message::decode(&frame)
            {
                emergencies.push((emergency.code, emergency.details[0]));
            }
        });
        let inputs = lines.poll(Some(&bus.discrete_report(at(now))), at(now));
        bus.hear_lines(&inputs, at(now));
    }

    /// Whether the pose is valid, within docking limits, and no fault is told.
    fn says(&self) -> [bool; 3] {
        let [pose_valid, docking, fault, ..] = &self.wires;
        [pose_valid, docking, fault].map(|wire| wire.0.get())
    }

    /// Drives, with an estimate every tenth of a second.
    fn drive(&mut self, times: std::ops::Range<u64>) {
        for now in times {
            if now.is_multiple_of(10) {
                self.encoders(10, now);
            }
            if now.is_multiple_of(100) {
                self.estimate(Mode::Reflectors, LEVELS[0], now);
            }
            self.poll(now);
        }
    }
}

#[test]
fn a_sound_vehicle_is_valid_and_without_encoders_it_is_not() {
    let mut bench = Bench::new();
    bench.poll(0);
    assert_eq!(bench.says(), [false, false, true], "before the first pose");
    bench.drive(1..3000);
    assert_eq!(bench.says(), [true, true, true]);
    (3000..3055).for_each(|now| bench.poll(now));
    assert_eq!(bench.says(), [false, false, false], "the encoders are silent");
    bench.drive(3060..6000);
    assert_eq!(bench.says(), [true, true, true]);
    bench.estimate(Mode::Lost, LEVELS[0], 6000);
    bench.poll(6000);
    assert_eq!(bench.says(), [false, false, false], "lost, and told as a fault");
}

proptest! {
    /// Whatever comes: no wire says that a pose is valid while the vehicle is lost, without odometry, without a first pose, too unsure,
    /// or behind the deadline.
    #[test]
    fn no_wire_says_more_than_is_known(
        steps in prop::collection::vec((0_u64..40, 0..10_u8, 0..MODES.len(), 0..LEVELS.len(), 0_u64..120), 1..200),
        lead in 0_u64..1500,
    ) {
        let mut bench = Bench::new();
        bench.drive(0..lead);
        let mut known = (lead > 0).then_some((Mode::Reflectors, LEVELS[0], (lead.max(1) - 1) / 100 * 100));
        let mut heard = (lead > 0).then_some((lead.max(1) - 1) / 10 * 10);
        let mut now = lead;
        for (pause, what, mode, level, age) in steps {
            now += pause;
            match what {
                0..=6 => {
                    bench.encoders(10, now);
                    heard = Some(now);
                }
                7..=8 => {
                    let time = now.saturating_sub(age);
                    bench.estimate(MODES[mode], LEVELS[level], time);
                    known = Some((MODES[mode], LEVELS[level], time));
                }
                _ => {}
            }
            bench.poll(now);
            let [is_valid, is_dockable, is_sound] = bench.says();
            if is_valid {
                let Some((mode, (position, heading), time)) = known else {
                    return Err(TestCaseError::fail("there was no pose"));
                };
                prop_assert!([Mode::Reflectors, Mode::Features, Mode::Mixed].contains(&mode), "{mode:?}");
                prop_assert!(position <= 0.15 && heading <= 2.0_f64.to_radians(), "{position}, {heading}");
                prop_assert!(heard.is_some_and(|heard| now - heard <= 50), "{heard:?} at {now}");
                prop_assert!(now - time <= 301, "{time} at {now}");
                if is_dockable {
                    prop_assert!(position <= 0.05 && heading <= 0.5_f64.to_radians(), "{position}, {heading}");
                }
            }
            prop_assert!(is_valid || !is_dockable);
            // A vehicle that is lost says so at once.
            prop_assert!(!is_sound || known.is_none_or(|(mode, ..)| mode != Mode::Lost));
        }
        // Nobody asks the bus any more.
        let last = bench.bus.discrete_report(at(now));
        bench.lines.poll(Some(&last), at(now + 51));
        prop_assert_eq!(bench.says(), [false; 3]);
    }

    /// The same of any pose whatever: levels and times that are no numbers, or of tomorrow.
    #[test]
    fn a_report_says_what_its_definition_does(
        mode in 0..MODES.len(),
        level in (prop::num::f64::ANY, prop::num::f64::ANY),
        times in (0_u64..200, 0_u64..200),
        register in any::<u8>(),
    ) {
        let limits = Settings::default().parameters.alert_limits;
        let pose = pose(MODES[mode], level, at(times.0));
        let report = DiscreteReport::of(Some(&pose), &limits, register, 0.05, at(times.1));
        let outputs = report.outputs(at(times.1));
        let is_fresh = times.1 <= times.0 + 50;
        let is_within = |position: f64, heading: f64| level.0 <= position && level.1 <= heading.to_radians();
        let is_valid = (1..=3).contains(&mode) && is_fresh && is_within(0.15, 2.0);
        prop_assert_eq!(outputs.is_pose_valid, is_valid);
        prop_assert_eq!(outputs.is_within_docking_limits, is_valid && is_within(0.05, 0.5));
        prop_assert_eq!(outputs.is_faulty, register != 0);
    }
}

/// How many errors are remembered (1003h, subindex 0).
fn remembered(bench: &mut Bench, now: u64) -> u8 {
    bench.answers.clear();
    bench.hear(&Frame::of(standard_id(0x610), [0x40, 0x03, 0x10, 0, 0, 0, 0, 0]), now);
    bench.answers.last().unwrap().padded()[4]
}

#[test]
fn a_reset_forgets_the_errors_that_were() {
    let mut bench = Bench::new();
    bench.drive(0..100);
    bench.estimate(Mode::Lost, LEVELS[0], 100);
    (100..200).for_each(|now| bench.poll(now));
    assert_eq!(remembered(&mut bench, 200), 1);
    bench.wires[4].0.set(true);
    (200..230).for_each(|now| bench.poll(now));
    assert_eq!(remembered(&mut bench, 230), 0);
    // It is lost all the same.
    assert!(!bench.says()[2]);
    bench.wires[4].0.set(false);
    (230..300).for_each(|now| bench.poll(now));
    assert_eq!(remembered(&mut bench, 300), 0);
}

#[test]
fn a_failed_line_is_an_emergency_until_it_works() {
    let mut bench = Bench::new();
    bench.drive(0..3000);
    assert_eq!(bench.emergencies, []);
    bench.bus.hear_lines(&DiscreteInputs { failed: Line::Reset.bit(), ..DiscreteInputs::default() }, at(3000));
    bench.drive(3000..3400);
    assert_eq!((bench.says(), &bench.emergencies[..]), ([true, true, false], &[(0xFF05, 0b10000)][..]));
    bench.drive(3400..3700);
    assert_eq!((bench.says(), bench.emergencies.len()), ([true; 3], 2));
}

/// The vehicle brakes harder than it is believed to: its counter is taken for one that has frozen, unless somebody says that it stands.
fn faults_of_a_hard_stop(mut tell: impl FnMut(&mut Bench, u64)) -> usize {
    let mut bench = Bench::new();
    for now in 0..4000_u64 {
        if now.is_multiple_of(10) {
            bench.encoders(if now < 3000 { 100 } else { 0 }, now);
        }
        tell(&mut bench, now);
        bench.poll(now);
    }
    bench.emergencies.iter().filter(|(code, _)| *code == 0x7305).count()
}

#[test]
fn a_wire_tells_of_standstill_as_the_bus_does() {
    let telegram = |is_standstill: u8| Frame::of(standard_id(0x410), [0, 0, is_standstill << 4, 0, 0, 0, 0, 0]);
    assert_eq!(faults_of_a_hard_stop(|_, _| ()), 1);
    assert_eq!(faults_of_a_hard_stop(|bench, now| bench.wires[3].0.set(now >= 2970)), 0);
    let on_the_bus = |bench: &mut Bench, now: u64| bench.hear(&telegram(u8::from(now >= 2990)), now);
    assert_eq!(faults_of_a_hard_stop(on_the_bus), 0);
    // A wire that hangs on its supply, while the bus says that the vehicle moves.
    let contradicted = |bench: &mut Bench, now: u64| {
        bench.wires[3].0.set(true);
        bench.hear(&telegram(0), now);
    };
    assert_eq!(faults_of_a_hard_stop(contradicted), 1);
}
