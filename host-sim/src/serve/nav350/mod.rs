//! A NAV350 on TCP that sees what a recorded or simulated drive has seen.
//!
//! It speaks both dialects, has the sensor's operating modes, user levels, settings and layout, and answers the reads
//! that its maker's client makes at start-up. The drive begins with the first question for data, or when it is told to;
//! until then the first revolution is repeated, and the last one when it is over.

mod connection;
mod drive;
mod encoding;
mod factory;
mod mapping;
mod method;
mod pending;
mod promise;
mod request;
mod seen;
mod sensor;

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_wire::cola::Dialect;
use agv_wire::nav350::{IdentifiedLandmark, SpeedReport};

pub use connection::Connection;
pub use drive::{Drive, DriveError, Turn};
pub use sensor::{Sensor, SensorClockOptions};

/// How the sensor behaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How much faster than real time the drive goes.
    pub speed: f64,
    /// What the sensor's clock shows at its start, ms.
    pub clock_start: u32,
    /// The only dialect that is understood; both if None.
    pub dialect: Option<Dialect>,
    /// Whether the vehicle stands until [`Nav350::begin`].
    pub stands: bool,
    /// Time from the acknowledgement of a slow method to its result, s; at zero both leave in one piece.
    pub gap: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { speed: 1.0, clock_start: 0, dialect: None, stands: false, gap: 0.0 }
    }
}

/// An emulated sensor.
pub struct Nav350 {
    speed: f64,
    started: Instant,
    sensor: Mutex<Sensor>,
    /// Longest time by which an answer came after the end of its turn, since [`Nav350::begin`], us.
    longest_delay: AtomicU64,
}

impl Nav350 {
    /// A sensor that was just started.
    #[must_use]
    pub fn new(drive: Drive, options: Options) -> Self {
        let clock = SensorClockOptions { start: options.clock_start, ..SensorClockOptions::default() };
        let sensor = Sensor::new(drive, clock, options.dialect, options.stands).with_gap(options.gap);
        let sensor = Mutex::new(sensor);
        Self { speed: options.speed, started: Instant::now(), sensor, longest_delay: AtomicU64::new(0) }
    }

    /// The speed that the sensor was told last.
    #[must_use]
    pub fn speed(&self) -> Option<SpeedReport> {
        self.sensor().speed()
    }

    /// The layout as it is now.
    #[must_use]
    pub fn layout(&self) -> Vec<IdentifiedLandmark> {
        self.sensor().layout().to_vec()
    }

    /// Takes a turn that has just ended, of a drive that goes on; its time is that since the start of the sensor.
    pub fn see(&self, turn: Turn) {
        self.sensor().see(turn);
    }

    /// Lets the vehicle of a sensor that stands drive off at `time`.
    pub fn begin(&self, time: Instant) {
        let seconds = time.saturating_duration_since(self.started).as_secs_f64() * self.speed;
        self.sensor().begin(seconds);
        self.longest_delay.store(0, Ordering::Relaxed);
    }

    /// Longest time by which this machine sent a turn later than it was due, since [`Nav350::begin`], s. Of no use for a drive that goes on,
    /// whose turns are due when they are seen.
    #[must_use]
    pub fn longest_delay(&self) -> f64 {
        1e-6 * self.longest_delay.load(Ordering::Relaxed) as f64
    }

    /// Serves every connection, until `is_stopped`.
    ///
    /// # Errors
    /// If the listener fails.
    pub fn serve(&self, listener: &TcpListener, is_stopped: &AtomicBool) -> io::Result<()> {
        listener.set_nonblocking(true)?;
        std::thread::scope(|scope| {
            while !is_stopped.load(Ordering::Relaxed) {
                match listener.accept() {
                    Ok((stream, _)) => {
                        scope.spawn(move || {
                            // A connection that fails is the client's affair.
                            let _ = self.converse(stream, is_stopped);
                        });
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                        std::thread::sleep(Duration::from_millis(5));
                    }
                    Err(error) => return Err(error),
                }
            }
            Ok(())
        })
    }

    fn sensor(&self) -> MutexGuard<'_, Sensor> {
        self.sensor.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Seconds of the sensor since its start.
    #[must_use]
    pub fn now(&self) -> f64 {
        self.started.elapsed().as_secs_f64() * self.speed
    }

    fn converse(&self, mut stream: TcpStream, is_stopped: &AtomicBool) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        let mut connection = Connection::default();
        let mut buffer = vec![0; 1 << 16];
        while !is_stopped.load(Ordering::Relaxed) {
            let due = connection.due();
            let promised = connection.poll(&self.sensor(), self.now());
            if let Some(bytes) = promised {
                stream.write_all(&bytes)?;
                let delay = due.map_or(0.0, |due| (self.now() - due) / self.speed);
                self.longest_delay.fetch_max((1e6 * delay) as u64, Ordering::Relaxed);
                continue;
            }
            // What has been due for a while waits for a turn that has not ended.
            let wait = connection.due().map_or(LONGEST_WAIT, |due| (due - self.now()) / self.speed);
            stream.set_read_timeout(Some(Duration::from_secs_f64(wait.clamp(SHORTEST_WAIT, LONGEST_WAIT))))?;
            let count = match stream.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(count) => count,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => continue,
                Err(error) => return Err(error),
            };
            let answers = connection.receive(&mut self.sensor(), &buffer[..count], self.now());
            stream.write_all(&answers)?;
        }
        Ok(())
    }
}

/// How long is waited at least, s.
const SHORTEST_WAIT: f64 = 5e-4;
/// Waits are cut into pieces of this length, s, so that the sensor can be stopped.
const LONGEST_WAIT: f64 = 0.02;
