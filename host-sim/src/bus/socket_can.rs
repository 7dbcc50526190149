//! SocketCAN.

use std::io::{self, ErrorKind};
use std::time::{Duration, Instant, SystemTime};

use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, Id};
use socketcan::{
    CanAnyFrame, CanErrorFrame, CanFdFrame, CanFdSocket, CanFilter, CanFrame, EmbeddedFrame, Socket, SocketOptions,
};

use super::waiting::wait;
use super::{Bus, BusChange, BusError, HeardFrame};

/// How long a full transmit queue is waited for, and how often it is looked at.
const QUEUE_PATIENCE: Duration = Duration::from_millis(200);
const QUEUE_PAUSE: Duration = Duration::from_millis(1);
/// What Linux says of a full transmit queue (ENOBUFS).
const NO_BUFFER: i32 = 105;

/// Oldest frame whose stamp is believed: one that waits for longer is as good as one that has just come, and a clock that is set
/// while frames wait is off by more.
const OLDEST: Duration = Duration::from_millis(100);

/// Classes of errors that are told (`linux/can/error.h`): problems of the controller, off the bus, restarted.
const CONTROLLER_PROBLEM: u32 = 0x4;
const OFF: u32 = 0x40;
const RESTARTED: u32 = 0x100;
/// A problem of the controller, in the second byte: it had no room for a frame that came.
const RECEIVE_OVERFLOW: u8 = 0x01;

/// That an identifier has 29 bits.
const EXTENDED: u32 = 0x8000_0000;
/// The bits of a node in an identifier of CANopen; 0 is for all nodes.
const NODE: u32 = 0x7F;

/// One interface, such as `can0` or `vcan0`.
pub struct SocketCanBus {
    name: String,
    socket: CanFdSocket,
    change: Option<BusChange>,
}

/// How old a frame with that stamp is by the clock that has stamped it.
fn age(stamp: Option<SystemTime>) -> Duration {
    let age = stamp.and_then(|stamp| SystemTime::now().duration_since(stamp).ok());
    age.filter(|age| *age <= OLDEST).unwrap_or_default()
}

impl SocketCanBus {
    /// Opens an interface that is up.
    ///
    /// # Errors
    /// If there is no such interface or the kernel has no CAN.
    pub fn open(name: &str) -> Result<Self, BusError> {
        let io = |source| BusError::Io { name: name.to_owned(), source };
        let open = || -> io::Result<CanFdSocket> {
            let socket = CanFdSocket::open(name)?;
            socket.set_nonblocking(true)?;
            socket.set_recv_timestamp(true)?;
            socket.set_error_filter(CONTROLLER_PROBLEM | OFF | RESTARTED)?;
            Ok(socket)
        };
        Ok(Self { name: name.to_owned(), socket: open().map_err(io)?, change: None })
    }

    fn io(&self, source: io::Error) -> BusError {
        BusError::Io { name: self.name.clone(), source }
    }

    fn try_send(&self, frame: &AnyFrame) -> io::Result<()> {
        let wrong = || io::Error::from(ErrorKind::InvalidInput);
        match frame {
            AnyFrame::Classic(frame) => {
                let sent = if frame.is_remote() {
                    CanFrame::new_remote(frame.id(), frame.length())
                } else {
                    CanFrame::new(frame.id(), frame.data())
                };
                self.socket.write_frame(&sent.ok_or_else(wrong)?)
            }
            AnyFrame::Fd(frame) => {
                let mut sent = CanFdFrame::new(frame.id(), frame.data()).ok_or_else(wrong)?;
                sent.set_brs(frame.is_fast());
                self.socket.write_frame(&sent)
            }
        }
    }
}

impl SocketCanBus {
    /// Notes what the interface says of itself.
    fn note(&mut self, error: &CanErrorFrame) {
        let bits = error.error_bits();
        let has_overflow = error.data().get(1).is_some_and(|byte| byte & RECEIVE_OVERFLOW != 0);
        if bits & OFF != 0 {
            self.change = Some(BusChange::Off);
        } else if bits & RESTARTED != 0 {
            self.change = Some(BusChange::BackFromOff);
        } else if bits & CONTROLLER_PROBLEM != 0 && has_overflow {
            self.change = self.change.or(Some(BusChange::Overrun));
        }
    }
}

/// Whether the kernel has no room for a frame.
fn is_full(error: &io::Error) -> bool {
    error.raw_os_error() == Some(NO_BUFFER) || error.kind() == ErrorKind::WouldBlock
}

impl Bus for SocketCanBus {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        let start = Instant::now();
        loop {
            match self.try_send(frame) {
                // The kernel does not say when there is room again.
                Err(error) if is_full(&error) && start.elapsed() < QUEUE_PATIENCE => std::thread::sleep(QUEUE_PAUSE),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                outcome => return outcome.map_err(|error| self.io(error)),
            }
        }
    }

    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        Ok(self.hear(deadline)?.map(|heard| heard.frame))
    }

    fn hear(&mut self, deadline: Instant) -> Result<Option<HeardFrame>, BusError> {
        loop {
            if !wait(&self.socket, deadline).map_err(|error| self.io(error))? {
                return Ok(None);
            }
            let (frame, stamps) = match self.socket.read_frame_with_timestamps() {
                Ok(read) => read,
                Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => continue,
                Err(error) => return Err(self.io(error)),
            };
            let frame = match frame {
                CanAnyFrame::Normal(frame) => Frame::new(frame.id(), frame.data()).map(AnyFrame::from),
                CanAnyFrame::Remote(frame) => Frame::remote(frame.id(), frame.dlc()).map(AnyFrame::from),
                CanAnyFrame::Fd(frame) => FdFrame::new(frame.id(), frame.data(), frame.is_brs()).map(AnyFrame::from),
                CanAnyFrame::Error(error) => {
                    self.note(&error);
                    None
                }
            };
            if let Some(frame) = frame {
                return Ok(Some(HeardFrame { frame, age: age(stamps.socket) }));
            }
        }
    }

    fn offer(&mut self, frame: &AnyFrame) -> Result<bool, BusError> {
        loop {
            match self.try_send(frame) {
                Err(error) if is_full(&error) => return Ok(false),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                outcome => return outcome.map(|()| true).map_err(|error| self.io(error)),
            }
        }
    }

    fn listen_to(&mut self, nodes: &[NodeId], others: &[Id]) -> Result<(), BusError> {
        let numbers = std::iter::once(0).chain(nodes.iter().map(|node| u32::from(node.number())));
        let of_nodes = numbers.map(|number| CanFilter::new(number, NODE | EXTENDED));
        let of_others = others.iter().map(|id| match id {
            Id::Standard(id) => CanFilter::new(u32::from(id.as_raw()), 0x7FF | EXTENDED),
            Id::Extended(id) => CanFilter::new(id.as_raw() | EXTENDED, 0x1FFF_FFFF | EXTENDED),
        });
        let filters: Vec<CanFilter> = of_nodes.chain(of_others).collect();
        self.socket.set_filters(&filters).map_err(|error| self.io(error))
    }

    fn take_change(&mut self) -> Option<BusChange> {
        self.change.take()
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::age;

    #[test]
    fn a_clock_that_was_set_makes_no_frame_older() {
        let now = SystemTime::now();
        let hour = Duration::from_secs(3600);
        assert_eq!(age(None), Duration::ZERO);
        assert_eq!(age(now.checked_add(hour)), Duration::ZERO);
        assert_eq!(age(now.checked_sub(hour)), Duration::ZERO);
        let old = age(now.checked_sub(Duration::from_millis(20)));
        assert!(old == Duration::ZERO || old >= Duration::from_millis(20), "{old:?}");
    }
}
