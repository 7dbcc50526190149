//! The pins.

use agv_core::measurement::Time;
use embedded_hal::digital::{InputPin, OutputPin, PinState};

use super::debounce::Debounced;
use super::outputs::{DiscreteOutputs, DiscreteReport};

/// A line, as its fault is told (EMCY FF05h): the number of its bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Line {
    /// The pose may be driven by.
    PoseValid = 0,
    /// It may be docked by.
    WithinDockingLimits = 1,
    /// Nothing is wrong, if it is high.
    Fault = 2,
    /// The vehicle stands.
    Standstill = 3,
    /// What can be reset is reset when it rises.
    Reset = 4,
}

impl Line {
    /// Its bit.
    #[must_use]
    pub const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// The lines that there are.
#[derive(Clone, Debug)]
pub struct LineSet<Output, Input> {
    /// High while the pose may be driven by.
    pub pose_valid: Option<Output>,
    /// High while it may be docked by.
    pub within_docking_limits: Option<Output>,
    /// Low while something is wrong, so that a wire that is broken says so, too.
    pub fault: Option<Output>,
    /// High while the vehicle stands.
    pub standstill: Option<Input>,
    /// Rises when what can be reset is to be reset.
    pub reset: Option<Input>,
}

impl<Output, Input> LineSet<Output, Input> {
    /// No line.
    pub const NONE: Self =
        Self { pose_valid: None, within_docking_limits: None, fault: None, standstill: None, reset: None };
}

/// What the inputs say, and which lines have failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DiscreteInputs {
    /// The vehicle says that it stands. Low says nothing.
    pub is_standing: bool,
    /// What can be reset is to be reset, once.
    pub is_reset: bool,
    /// Lines that could not be set or read, each its [`Line::bit`].
    pub failed: u8,
}

/// Drives the outputs and reads the inputs. When it goes, the outputs are in their safe state.
#[derive(Debug)]
pub struct DiscreteLines<Output: OutputPin, Input: InputPin> {
    lines: LineSet<Output, Input>,
    standstill: Debounced,
    reset: Debounced,
}

/// Sets a line; its bit if it cannot be set.
fn set<Output: OutputPin>(line: Line, pin: &mut Option<Output>, is_high: bool) -> u8 {
    let outcome = pin.as_mut().map_or(Ok(()), |pin| pin.set_state(PinState::from(is_high)));
    outcome.map_or(line.bit(), |()| 0)
}

impl<Output: OutputPin, Input: InputPin> DiscreteLines<Output, Input> {
    /// Lines whose outputs nobody has set yet, and whose inputs nobody has read.
    #[must_use]
    pub fn new(lines: LineSet<Output, Input>) -> Self {
        Self { lines, standstill: Debounced::default(), reset: Debounced::default() }
    }

    /// Sets the outputs by what the controller has said last, and reads the inputs. To be called at least every
    /// [`super::DEBOUNCE`].
    pub fn poll(&mut self, report: Option<&DiscreteReport>, now: Time) -> DiscreteInputs {
        let Self { lines, standstill, reset } = self;
        let mut failed = 0;
        let mut read =
            |line: Line, pin: &mut Option<Input>, level: &mut Debounced| match pin.as_mut().map(InputPin::is_high) {
                Some(Ok(is_high)) => level.read(is_high, now),
                Some(Err(_)) => {
                    failed |= line.bit();
                    level.forget()
                }
                None => level.forget(),
            };
        let standstill = read(Line::Standstill, &mut lines.standstill, standstill);
        let reset = read(Line::Reset, &mut lines.reset, reset);
        let outputs = report.map_or(DiscreteOutputs::SAFE, |report| report.outputs(now));
        failed |= self.set(&outputs, failed != 0);
        DiscreteInputs { is_standing: standstill.is_high, is_reset: reset.has_risen, failed }
    }

    /// Sets the outputs. Which of them could not be set.
    fn set(&mut self, outputs: &DiscreteOutputs, has_failed: bool) -> u8 {
        let LineSet { pose_valid, within_docking_limits, fault, .. } = &mut self.lines;
        let DiscreteOutputs { is_pose_valid, is_within_docking_limits, is_faulty } = *outputs;
        // Where no fault can be told, nothing is valid.
        let fault_failed = set(Line::Fault, fault, !is_faulty && !has_failed);
        let may_say = fault_failed == 0;
        let failed = set(Line::PoseValid, pose_valid, is_pose_valid && may_say)
            | set(Line::WithinDockingLimits, within_docking_limits, is_within_docking_limits && may_say);
        if failed == 0 { fault_failed } else { failed | fault_failed | set(Line::Fault, fault, false) }
    }

    /// Puts the outputs into their safe state: nothing is valid, and there is a fault. Which of them could not be set.
    pub fn make_safe(&mut self) -> u8 {
        self.set(&DiscreteOutputs::SAFE, true)
    }
}

impl<Output: OutputPin, Input: InputPin> Drop for DiscreteLines<Output, Input> {
    fn drop(&mut self) {
        // Nobody is left to be told.
        let _ = self.make_safe();
    }
}
