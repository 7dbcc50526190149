//! Which lines of the machine are meant.

use std::fmt;
use std::path::PathBuf;

use serde::Deserialize;

use super::DiscretePort;

/// A line of a chip.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum LineName {
    /// Its number on the chip.
    Number(u32),
    /// What the chip calls it.
    Name(String),
}

impl fmt::Display for LineName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(formatter, "{number}"),
            Self::Name(name) => formatter.write_str(name),
        }
    }
}

/// The lines that there are: those of [`agv_controller::LineSet`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DiscreteConfiguration {
    /// The chip, such as `/dev/gpiochip0`. Without it names are looked for on all chips.
    pub chip: Option<PathBuf>,
    /// High while the pose may be driven by.
    pub pose_valid: Option<LineName>,
    /// High while it may be docked by.
    pub within_docking_limits: Option<LineName>,
    /// Low while something is wrong.
    pub fault: Option<LineName>,
    /// High while the vehicle stands.
    pub standstill: Option<LineName>,
    /// Rises when what can be reset is to be reset.
    pub reset: Option<LineName>,
    /// Those whose hardware inverts, by their keys here.
    pub inverted: Vec<String>,
}

/// Why a line cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// The kernel gives none.
    #[cfg(target_os = "linux")]
    #[error("[discrete] {key}, line {line}: {source}")]
    Kernel {
        /// Which one of the configuration it is.
        key: &'static str,
        /// What it is called there.
        line: LineName,
        /// What the kernel says.
        source: gpiocdev::Error,
    },
    /// No chip has a line of that name, or several have.
    #[error("[discrete] {key}: {count} lines are called {line}; gpioinfo lists them, and chip says which one is meant")]
    Name {
        /// Which one of the configuration it is.
        key: &'static str,
        /// The name.
        line: String,
        /// How many there are.
        count: usize,
    },
    /// This system has no such lines.
    #[error("[discrete]: only Linux has such lines")]
    NoLines,
}

impl DiscreteConfiguration {
    /// All lines, by their keys.
    pub(super) fn lines(&self) -> [(&'static str, Option<&LineName>); 5] {
        [
            ("pose_valid", self.pose_valid.as_ref()),
            ("within_docking_limits", self.within_docking_limits.as_ref()),
            ("fault", self.fault.as_ref()),
            ("standstill", self.standstill.as_ref()),
            ("reset", self.reset.as_ref()),
        ]
    }

    /// Whether the hardware inverts a line.
    pub(super) fn is_inverted(&self, key: &str) -> bool {
        self.inverted.iter().any(|inverted| inverted == key)
    }

    /// What is wrong with it whatever the machine has: a key, and what there is to say of it.
    pub(in crate::run) fn problem(&self) -> Option<(&str, String)> {
        let lines = self.lines();
        let there = || lines.iter().filter_map(|(key, line)| line.map(|line| (*key, line)));
        for (number, (key, line)) in there().enumerate() {
            if matches!(line, LineName::Number(_)) && self.chip.is_none() {
                return Some((key, format!("line {line} is a number of no chip; chip says of which one")));
            }
            if let Some((other, _)) = there().take(number).find(|(_, before)| *before == line) {
                return Some((key, format!("line {line} is {other} already")));
            }
        }
        let is_there = |wanted: &&String| there().any(|(key, _)| key == *wanted);
        let unknown = self.inverted.iter().find(|key| !is_there(key))?;
        Some(("inverted", format!("{unknown} is no line of this table")))
    }

    /// Takes the lines of this machine; none if none is wanted. Until they are set, the outputs are low.
    ///
    /// # Errors
    /// If the kernel does not give one.
    #[cfg(target_os = "linux")]
    pub fn open(&self) -> Result<Option<Box<dyn DiscretePort>>, LineError> {
        super::gpio::open(self)
    }

    /// Takes none.
    ///
    /// # Errors
    /// If one is wanted.
    #[cfg(not(target_os = "linux"))]
    pub fn open(&self) -> Result<Option<Box<dyn DiscretePort>>, LineError> {
        let is_wanted = self.lines().iter().any(|(_, line)| line.is_some());
        if is_wanted { Err(LineError::NoLines) } else { Ok(None) }
    }
}
