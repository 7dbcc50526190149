//! The session with the laser, and whether it can be used.

use agv_core::measurement::Time;
use agv_core::state::LaserHealth;
use agv_wire::nav350::{Configuration, Revolution, SensorSpeed, SensorWatch, Session, Step};

/// A session of which somebody keeps the connection. `BYTES` is the room for the longest telegram.
#[derive(Debug)]
pub struct Laser<const BYTES: usize> {
    session: Session<BYTES>,
    watch: SensorWatch,
}

impl<const BYTES: usize> Laser<BYTES> {
    /// A laser that has not been heard.
    #[must_use]
    pub fn new(configuration: Configuration) -> Self {
        Self { session: Session::new(configuration), watch: SensorWatch::new() }
    }

    /// Tells the laser how fast it moves, as soon as that may be sent.
    pub const fn set_speed(&mut self, speed: SensorSpeed) {
        self.session.set_speed(speed);
    }

    /// The connection is open.
    pub fn connected(&mut self, now: Time) {
        self.session.connected(now);
    }

    /// The connection cannot be opened, was closed by the other side, or takes no bytes.
    pub fn unreachable(&mut self) {
        self.watch.unreachable();
        self.session.closed();
    }

    /// Takes bytes, and returns how many; the rest is for the next call, after [`Laser::poll`].
    pub fn receive(&mut self, bytes: &[u8], now: Time) -> usize {
        self.session.receive(bytes, now)
    }

    /// What is to be done next; a revolution is written to `revolution` when the step says so.
    pub fn poll<const BEAMS: usize, const REFLECTORS: usize>(
        &mut self,
        now: Time,
        revolution: &mut Revolution<BEAMS, REFLECTORS>,
    ) -> Step<'_> {
        let step = self.session.poll(now, revolution);
        match &step {
            Step::Revolution => self.watch.measured(now),
            Step::Disconnect(reason) => self.watch.lost(*reason),
            Step::Report(report) => self.watch.reported(*report),
            Step::Connect | Step::Send(_) | Step::Wait(_) => {}
        }
        step
    }

    /// What the laser's health is told by.
    #[must_use]
    pub fn watch(&self) -> SensorWatch {
        self.watch
    }

    /// Whether it can be used.
    #[must_use]
    pub fn health(&self, now: Time) -> LaserHealth {
        self.watch.health(now)
    }
}
