//! Packets that a sensor sends to this machine.

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};

use agv_core::measurement::Time;
use agv_lidar3d::packet::{LENGTH, Packet};

/// How often somebody may want to stop.
const PATIENCE: Duration = Duration::from_millis(200);

/// A socket to which a sensor sends.
pub struct Listener {
    socket: UdpSocket,
    start: Instant,
    /// Datagrams that are no packets.
    pub refused: usize,
}

impl Listener {
    /// Listens on a port of all interfaces; port 0 takes any that is free.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn new(port: u16) -> io::Result<Self> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port))?;
        socket.set_read_timeout(Some(PATIENCE))?;
        Ok(Self { socket, start: Instant::now(), refused: 0 })
    }

    /// The port.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn port(&self) -> io::Result<u16> {
        Ok(self.socket.local_addr()?.port())
    }

    /// Waits for a packet, a moment at most, and calls `take` with its time since the beginning. Whether one came.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn receive(&mut self, take: impl FnOnce(Time, &Packet<'_>)) -> io::Result<bool> {
        let mut bytes = [0; LENGTH + 1];
        let length = match self.socket.recv(&mut bytes) {
            Ok(length) => length,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                return Ok(false);
            }
            Err(error) => return Err(error),
        };
        let time = Time::from_micros(self.start.elapsed().as_micros() as u64);
        match Packet::new(&bytes[..length]) {
            Ok(packet) => take(time, &packet),
            Err(_) => self.refused += 1,
        }
        Ok(true)
    }
}
