//! Packets that a sensor sends to this machine.

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};

use agv_core::measurement::Time;
use agv_lidar3d::packet::ouster;

use super::kind::Datagram;

/// How often somebody may want to stop.
const PATIENCE: Duration = Duration::from_millis(200);
/// Bytes of the longest datagram.
const LONGEST: usize = 1 << 16;

/// A socket to which a sensor sends.
pub struct Listener {
    socket: UdpSocket,
    port: u16,
    ouster: Option<ouster::Sensor>,
    bytes: Vec<u8>,
    start: Instant,
    /// Datagrams that are no packets.
    pub refused: usize,
}

impl Listener {
    /// Listens on a port of all interfaces; port 0 takes any that is free. `ouster` describes an Ouster.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn new(port: u16, ouster: Option<ouster::Sensor>) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port))?;
        socket.set_read_timeout(Some(PATIENCE))?;
        let port = socket.local_addr()?.port();
        Ok(Self { socket, port, ouster, bytes: vec![0; LONGEST], start: Instant::now(), refused: 0 })
    }

    /// When the time of the packets began.
    #[must_use]
    pub fn start(&self) -> Instant {
        self.start
    }

    /// The port.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Waits for a packet, a moment at most, and calls `take` with its time since the beginning. Whether one came.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn receive(&mut self, take: impl FnOnce(Time, &Datagram<'_>, &[u8])) -> io::Result<bool> {
        let length = match self.socket.recv(&mut self.bytes) {
            Ok(length) => length,
            // A signal, as that of Ctrl-C, ends the wait too.
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
                ) =>
            {
                return Ok(false);
            }
            Err(error) => return Err(error),
        };
        let time = Time::from_micros(self.start.elapsed().as_micros() as u64);
        let bytes = &self.bytes[..length];
        match Datagram::recognise(bytes, self.port, self.ouster.as_ref()) {
            Ok(Some(datagram)) => take(time, &datagram, bytes),
            Ok(None) | Err(_) => self.refused += 1,
        }
        Ok(true)
    }
}
