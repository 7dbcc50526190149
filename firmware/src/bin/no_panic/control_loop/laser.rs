//! The session with the laser, in whichever dialect it answers.

use core::hint::black_box;

use agv_core::measurement::Time;
use agv_core::wire::nav350::{Configuration, Revolution, Session};

use super::any;

/// The session, and the revolution that it fills.
pub struct Laser {
    session: Session<{ 18 * 1024 }>,
    revolution: Revolution,
}

impl Laser {
    pub fn new() -> Self {
        Self { session: Session::new(any(Configuration::default())), revolution: Revolution::new() }
    }

    /// Some bytes, and what is to be done then.
    pub fn step(&mut self) {
        let time = any(Time::default());
        if any(false) {
            self.session.connected(time);
        }
        if any(false) {
            self.session.closed();
        }
        let bytes = any([0; 64]);
        black_box(self.session.receive(bytes.get(..any(64)).unwrap_or_default(), time));
        black_box(self.session.poll(time, &mut self.revolution));
        black_box(self.revolution.reflectors());
        black_box(self.revolution.scan());
    }
}
