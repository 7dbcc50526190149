//! Adapters that speak text, on a serial line, a pseudo terminal or TCP.

use std::collections::VecDeque;
use std::fs::OpenOptions;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use agv_wire::can::frame::AnyFrame;
use agv_wire::can::slcan::{BitRate, Command, Decoder, Message};
use nix::sys::termios::{BaudRate, SetArg, cfmakeraw, cfsetspeed, tcgetattr, tcsetattr};

use super::waiting::wait;
use super::{Bus, BusError};

/// How long a frame may wait for the line to take it.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);

/// A stream that can be waited for.
trait Stream: Read + Write + AsFd + Send {}
impl<T: Read + Write + AsFd + Send> Stream for T {}

/// A bus behind an adapter.
pub struct SlcanBus {
    name: String,
    stream: Box<dyn Stream>,
    decoder: Decoder,
    received: VecDeque<AnyFrame>,
    unreadable: u64,
    acknowledged: u64,
}

impl SlcanBus {
    /// Opens a serial device or pseudo terminal and the bus behind it.
    ///
    /// # Errors
    /// If the device cannot be used.
    pub fn open_device(path: &str, rate: BitRate) -> Result<Self, BusError> {
        let open = || -> io::Result<std::fs::File> {
            let file = OpenOptions::new().read(true).write(true).open(path)?;
            let mut line = tcgetattr(&file)?;
            cfmakeraw(&mut line);
            cfsetspeed(&mut line, BaudRate::B115200)?;
            tcsetattr(&file, SetArg::TCSANOW, &line)?;
            Ok(file)
        };
        let file = open().map_err(|source| BusError::Io { name: path.to_owned(), source })?;
        Self::start(path, Box::new(file), rate)
    }

    /// Connects to an adapter on the network and opens the bus behind it.
    ///
    /// # Errors
    /// If nobody answers there.
    pub fn connect(address: &str, rate: BitRate) -> Result<Self, BusError> {
        let connect = || -> io::Result<TcpStream> {
            let stream = TcpStream::connect(address)?;
            stream.set_nodelay(true)?;
            stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
            Ok(stream)
        };
        let stream = connect().map_err(|source| BusError::Io { name: address.to_owned(), source })?;
        Self::start(address, Box::new(stream), rate)
    }

    /// A bus on a TCP connection that somebody else has made, whose other end needs no commands.
    ///
    /// # Errors
    /// If the connection is gone.
    pub fn accept(stream: TcpStream) -> Result<Self, BusError> {
        let name = "slcan-tcp".to_owned();
        let prepared = stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(WRITE_TIMEOUT)));
        match prepared {
            Ok(()) => Ok(Self::new(name, Box::new(stream))),
            Err(source) => Err(BusError::Io { name, source }),
        }
    }

    fn new(name: String, stream: Box<dyn Stream>) -> Self {
        Self { name, stream, decoder: Decoder::new(), received: VecDeque::new(), unreadable: 0, acknowledged: 0 }
    }

    fn start(name: &str, stream: Box<dyn Stream>, rate: BitRate) -> Result<Self, BusError> {
        let mut bus = Self::new(name.to_owned(), stream);
        // The ends of lines cut off what the adapter may still hold of an earlier talk.
        bus.write(b"\r\r\r")?;
        for command in [Command::Close, Command::BitRate(rate), Command::Open] {
            bus.command(command)?;
        }
        Ok(bus)
    }

    /// Tells the adapter something.
    ///
    /// # Errors
    /// If it is gone.
    pub fn command(&mut self, command: Command) -> Result<(), BusError> {
        self.write(&Message::from(command).encode())
    }

    /// How many commands the adapter has said to have done.
    #[must_use]
    pub fn acknowledged(&self) -> u64 {
        self.acknowledged
    }

    /// How many lines meant nothing.
    #[must_use]
    pub fn unreadable(&self) -> u64 {
        self.unreadable
    }

    fn io(&self, source: io::Error) -> BusError {
        BusError::Io { name: self.name.clone(), source }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), BusError> {
        let outcome = self.stream.write_all(bytes).and_then(|()| self.stream.flush());
        outcome.map_err(|source| self.io(source))
    }
}

impl Bus for SlcanBus {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        self.write(&Message::from(*frame).encode())
    }

    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        loop {
            if let Some(frame) = self.received.pop_front() {
                return Ok(Some(frame));
            }
            if !wait(&self.stream, deadline).map_err(|source| self.io(source))? {
                return Ok(None);
            }
            let mut bytes = [0; 4096];
            let count = match self.stream.read(&mut bytes) {
                Ok(0) => return Err(BusError::Closed { name: self.name.clone() }),
                Ok(count) => count,
                Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => 0,
                Err(error) => return Err(self.io(error)),
            };
            for byte in &bytes[..count] {
                match self.decoder.push(*byte) {
                    Some(Ok(Message::Frame { frame, .. })) => self.received.push_back(frame),
                    Some(Ok(Message::Acknowledged)) => self.acknowledged += 1,
                    Some(Err(_)) => self.unreadable += 1,
                    _ => {}
                }
            }
        }
    }
}
