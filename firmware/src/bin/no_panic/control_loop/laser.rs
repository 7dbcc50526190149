//! The session with the laser, in whichever dialect it answers.

use core::hint::black_box;

use agv_controller::TELEGRAM;
use agv_core::measurement::Time;
use agv_wire::nav350::{Configuration, Revolution};

use super::any;

/// The session, and the revolution that it fills.
pub struct Laser {
    laser: agv_controller::Laser<TELEGRAM>,
    revolution: Revolution,
}

impl Laser {
    pub fn new() -> Self {
        Self { laser: agv_controller::Laser::new(any(Configuration::default())), revolution: Revolution::new() }
    }

    /// Some bytes, and what is to be done then.
    pub fn step(&mut self) {
        let time = any(Time::default());
        if any(false) {
            self.laser.connected(time);
        }
        if any(false) {
            self.laser.unreachable();
        }
        let bytes = any([0; 64]);
        black_box(self.laser.receive(bytes.get(..any(64)).unwrap_or_default(), time));
        black_box(self.laser.poll(time, &mut self.revolution));
        black_box(self.laser.health(time));
        black_box(self.revolution.reflectors());
        black_box(self.revolution.scan());
    }
}
