//! CAN buses of a host.

mod in_process;
#[cfg(target_os = "linux")]
mod slcan;
#[cfg(target_os = "linux")]
mod socket_can;
#[cfg(target_os = "linux")]
mod waiting;

use std::time::{Duration, Instant};

use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::{AnyFrame, Id};
#[cfg(target_os = "linux")]
use agv_wire::can::slcan::BitRate;

pub use in_process::{InProcessBus, InProcessNode};
#[cfg(target_os = "linux")]
pub use slcan::SlcanBus;
#[cfg(target_os = "linux")]
pub use socket_can::SocketCanBus;

/// Why a bus cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The name is none of a bus.
    #[error(
        "{name}: no bus has such a name; use can0, slcan:/dev/ttyACM0 or slcan-tcp:HOST:PORT, and @BITRATE for slcan"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// The operating system refused.
    #[error("{name}: {source}")]
    Io {
        /// Name of the bus.
        name: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The other end is gone.
    #[error("{name}: the other end has closed the connection")]
    Closed {
        /// Name of the bus.
        name: String,
    },
}

/// A frame that was heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeardFrame {
    /// What it says.
    pub frame: AnyFrame,
    /// How long ago its end was heard; zero where nobody has noted it.
    pub age: Duration,
}

/// What has become of a bus, by the word of what drives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusChange {
    /// Frames of others came faster than they were taken.
    Overrun,
    /// Errors have driven this node off the bus.
    Off,
    /// It takes part again.
    BackFromOff,
}

/// A bus that this program takes part in. Nothing here waits by asking again and again.
pub trait Bus: Send {
    /// Sends a frame.
    ///
    /// # Errors
    /// If the bus is gone or takes no frames.
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError>;

    /// The next frame of others. None if there is none until `deadline`.
    ///
    /// # Errors
    /// If the bus is gone.
    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError>;

    /// The same, with the time at which it was heard.
    ///
    /// # Errors
    /// If the bus is gone.
    fn hear(&mut self, deadline: Instant) -> Result<Option<HeardFrame>, BusError> {
        Ok(self.receive(deadline)?.map(|frame| HeardFrame { frame, age: Duration::ZERO }))
    }

    /// Sends a frame if there is room for it; false if there is none. Never waits for room where the system says that there is none.
    ///
    /// # Errors
    /// If the bus is gone.
    fn offer(&mut self, frame: &AnyFrame) -> Result<bool, BusError> {
        self.send(frame).map(|()| true)
    }

    /// Takes only the frames of these nodes and for them, those for all nodes, and those of the `other` identifiers. Everything, if it
    /// cannot choose.
    ///
    /// # Errors
    /// If the bus is gone.
    fn listen_to(&mut self, _nodes: &[NodeId], _others: &[Id]) -> Result<(), BusError> {
        Ok(())
    }

    /// What has become of the bus since the last call.
    fn take_change(&mut self) -> Option<BusChange> {
        None
    }
}

/// What a bus is, by its name.
#[cfg(target_os = "linux")]
enum Kind {
    Device(String, BitRate),
    Address(String, BitRate),
    Interface(String),
}

#[cfg(target_os = "linux")]
impl Kind {
    fn of(name: &str) -> Result<Self, BusError> {
        let wrong = || BusError::Name { name: name.to_owned() };
        let with_rate = |text: &str| match text.rsplit_once('@') {
            None => Some((text.to_owned(), BitRate::Kbit500)),
            Some((place, rate)) => Some((place.to_owned(), BitRate::from_bits_per_second(rate.parse().ok()?)?)),
        };
        if let Some(device) = name.strip_prefix("slcan:") {
            with_rate(device).map(|(device, rate)| Self::Device(device, rate)).ok_or_else(wrong)
        } else if let Some(address) = name.strip_prefix("slcan-tcp:") {
            with_rate(address).map(|(address, rate)| Self::Address(address, rate)).ok_or_else(wrong)
        } else if name.is_empty() || name.contains([':', '/', '@']) {
            Err(wrong())
        } else {
            Ok(Self::Interface(name.to_owned()))
        }
    }
}

/// Whether a bus can have that name; nothing is opened.
///
/// # Errors
/// [`BusError::Name`] if it cannot.
#[cfg(target_os = "linux")]
pub fn check_name(name: &str) -> Result<(), BusError> {
    Kind::of(name).map(drop)
}

/// Opens the bus with that name: `slcan:DEVICE[@BITRATE]`, `slcan-tcp:HOST:PORT[@BITRATE]` (500 kbit/s if no bit rate is
/// named), else an interface of SocketCAN.
///
/// # Errors
/// If there is no such bus, or it cannot be used.
#[cfg(target_os = "linux")]
pub fn open(name: &str) -> Result<Box<dyn Bus>, BusError> {
    Ok(match Kind::of(name)? {
        Kind::Device(device, rate) => Box::new(SlcanBus::open_device(&device, rate)?),
        Kind::Address(address, rate) => Box::new(SlcanBus::connect(&address, rate)?),
        Kind::Interface(name) => Box::new(SocketCanBus::open(&name)?),
    })
}

/// This system has no CAN.
///
/// # Errors
/// Always.
#[cfg(not(target_os = "linux"))]
pub fn check_name(name: &str) -> Result<(), BusError> {
    Err(BusError::Name { name: name.to_owned() })
}

/// This system has no CAN.
///
/// # Errors
/// Always.
#[cfg(not(target_os = "linux"))]
pub fn open(name: &str) -> Result<Box<dyn Bus>, BusError> {
    Err(BusError::Name { name: name.to_owned() })
}
