//! The discrete lines, on a thread of their own: a chip of lines behind a slow bus may take its time, and a pose that is no longer made is
//! taken from the wires even so.

mod configuration;
#[cfg(target_os = "linux")]
mod gpio;

use std::time::Duration;

use agv_controller::{DiscreteInputs, DiscreteLines, DiscreteReport};
use agv_core::measurement::Time;
use embedded_hal::digital::{InputPin, OutputPin};

use super::exchange::{Exchange, Task};

pub use configuration::{DiscreteConfiguration, LineError, LineName};

/// How often the lines are set and read: half of the time between poses, and four times while an input must hold.
const STEP: Duration = Duration::from_millis(5);

/// Lines of any kind. When they go, they leave their outputs safe.
pub trait DiscretePort: Send {
    /// See [`DiscreteLines::poll`].
    fn poll(&mut self, report: Option<&DiscreteReport>, now: Time) -> DiscreteInputs;
}

impl<Output: OutputPin + Send, Input: InputPin + Send> DiscretePort for DiscreteLines<Output, Input> {
    fn poll(&mut self, report: Option<&DiscreteReport>, now: Time) -> DiscreteInputs {
        Self::poll(self, report, now)
    }
}

/// Drives the lines until everything ends.
pub(super) fn run(mut lines: Box<dyn DiscretePort>, exchange: &Exchange) {
    while !exchange.is_over() {
        exchange.check_in(Task::Lines);
        let report = exchange.discrete_report();
        exchange.set_discrete_inputs(lines.poll(report.as_ref(), exchange.now()));
        std::thread::sleep(STEP);
    }
}
