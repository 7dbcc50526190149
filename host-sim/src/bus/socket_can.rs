//! SocketCAN.

use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

use agv_wire::can::frame::{AnyFrame, FdFrame, Frame};
use socketcan::{CanAnyFrame, CanFdFrame, CanFdSocket, CanFrame, EmbeddedFrame, Socket};

use super::{Bus, BusError};

/// How long a full transmit queue is waited for, and how often it is looked at.
const QUEUE_PATIENCE: Duration = Duration::from_millis(200);
const QUEUE_PAUSE: Duration = Duration::from_millis(1);
/// What Linux says of a full transmit queue (ENOBUFS).
const NO_BUFFER: i32 = 105;

/// One interface, such as `can0` or `vcan0`.
pub struct SocketCanBus {
    name: String,
    socket: CanFdSocket,
}

impl SocketCanBus {
    /// Opens an interface that is up.
    ///
    /// # Errors
    /// If there is no such interface or the kernel has no CAN.
    pub fn open(name: &str) -> Result<Self, BusError> {
        let io = |source| BusError::Io { name: name.to_owned(), source };
        let socket = CanFdSocket::open(name).map_err(io)?;
        Ok(Self { name: name.to_owned(), socket })
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

impl Bus for SocketCanBus {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        let start = Instant::now();
        loop {
            match self.try_send(frame) {
                // The kernel does not say when there is room again.
                Err(error) if error.raw_os_error() == Some(NO_BUFFER) && start.elapsed() < QUEUE_PATIENCE => {
                    std::thread::sleep(QUEUE_PAUSE);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                outcome => return outcome.map_err(|error| self.io(error)),
            }
        }
    }

    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        loop {
            // The kernel counts milliseconds; a shorter rest is waited for as one.
            let rest = deadline.saturating_duration_since(Instant::now());
            let rest = if rest.is_zero() { rest } else { rest.max(Duration::from_millis(1)) };
            match self.socket.read_frame_timeout(rest) {
                Ok(CanAnyFrame::Normal(frame)) => return Ok(Frame::new(frame.id(), frame.data()).map(AnyFrame::from)),
                Ok(CanAnyFrame::Remote(frame)) => return Ok(Frame::remote(frame.id(), frame.dlc()).map(AnyFrame::from)),
                Ok(CanAnyFrame::Fd(frame)) => {
                    return Ok(FdFrame::new(frame.id(), frame.data(), frame.is_brs()).map(AnyFrame::from));
                }
                Ok(CanAnyFrame::Error(_)) => {}
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => return Ok(None),
                Err(error) => return Err(self.io(error)),
            }
        }
    }
}
