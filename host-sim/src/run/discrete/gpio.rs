//! Lines of the kernel's GPIO chips.

use std::path::{Path, PathBuf};

use agv_controller::{DiscreteLines, LineSet};
use embedded_hal::digital::{Error, ErrorKind, ErrorType, InputPin, OutputPin};
use gpiocdev::Request;
use gpiocdev::chip::Chip;
use gpiocdev::line::{Bias, Offset, Value};

use super::DiscretePort;
use super::configuration::{DiscreteConfiguration, LineError, LineName};

/// What names this program to whoever asks the kernel who has a line.
const CONSUMER: &str = "agv";

/// A line that this program has.
struct GpioLine {
    request: Request,
    offset: Offset,
}

/// The kernel refuses to set or to read a line.
#[derive(Debug)]
struct Refusal;

impl Error for Refusal {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for GpioLine {
    type Error = Refusal;
}

impl OutputPin for GpioLine {
    fn set_low(&mut self) -> Result<(), Refusal> {
        self.request.set_value(self.offset, Value::Inactive).map_err(|_| Refusal)
    }

    fn set_high(&mut self) -> Result<(), Refusal> {
        self.request.set_value(self.offset, Value::Active).map_err(|_| Refusal)
    }
}

impl InputPin for GpioLine {
    fn is_high(&mut self) -> Result<bool, Refusal> {
        self.request.value(self.offset).map(|value| value == Value::Active).map_err(|_| Refusal)
    }

    fn is_low(&mut self) -> Result<bool, Refusal> {
        self.is_high().map(|is_high| !is_high)
    }
}

/// Which way a line goes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Out,
    In,
}

/// Where a line is.
fn find(key: &'static str, chip: Option<&Path>, line: &LineName) -> Result<(PathBuf, Offset), LineError> {
    let refused = |source| LineError::Kernel { key, line: line.clone(), source };
    let name = match (line, chip) {
        (LineName::Number(number), chip) => return Ok((chip.unwrap_or(Path::new("")).to_owned(), *number)),
        (LineName::Name(name), _) => name,
    };
    let found: Vec<_> = match chip {
        Some(path) => {
            let chip = Chip::from_path(path).map_err(refused)?;
            let lines = chip.line_info_iter().map_err(refused)?.flatten();
            lines.filter(|info| info.name == *name).map(|info| (path.to_owned(), info.offset)).collect()
        }
        None => {
            let lines = gpiocdev::lines().map_err(refused)?;
            lines.filter(|found| found.info.name == *name).map(|found| (found.chip, found.info.offset)).collect()
        }
    };
    match <[_; 1]>::try_from(found) {
        Ok([place]) => Ok(place),
        Err(found) => Err(LineError::Name { key, line: name.clone(), count: found.len() }),
    }
}

fn open_line(
    configuration: &DiscreteConfiguration,
    (key, line): (&'static str, Option<&LineName>),
    way: Way,
) -> Result<Option<GpioLine>, LineError> {
    let Some(line) = line else { return Ok(None) };
    let (chip, offset) = find(key, configuration.chip.as_deref(), line)?;
    let is_inverted = configuration.is_inverted(key);
    let mut request = Request::builder();
    request.on_chip(chip).with_consumer(CONSUMER).with_line(offset);
    if is_inverted {
        request.as_active_low();
    }
    match way {
        Way::Out => request.as_output(Value::Inactive),
        // A wire that is broken says nothing.
        Way::In => request.as_input().with_bias(if is_inverted { Bias::PullUp } else { Bias::PullDown }),
    };
    let request = request.request().map_err(|source| LineError::Kernel { key, line: line.clone(), source })?;
    Ok(Some(GpioLine { request, offset }))
}

/// Takes the lines; none if none is wanted.
pub(super) fn open(configuration: &DiscreteConfiguration) -> Result<Option<Box<dyn DiscretePort>>, LineError> {
    let lines = configuration.lines();
    if lines.iter().all(|(_, line)| line.is_none()) {
        return Ok(None);
    }
    let [pose_valid, within_docking_limits, fault, standstill, reset] = lines;
    let open = |line, way| open_line(configuration, line, way);
    Ok(Some(Box::new(DiscreteLines::new(LineSet {
        pose_valid: open(pose_valid, Way::Out)?,
        within_docking_limits: open(within_docking_limits, Way::Out)?,
        fault: open(fault, Way::Out)?,
        standstill: open(standstill, Way::In)?,
        reset: open(reset, Way::In)?,
    }))))
}
