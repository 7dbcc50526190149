//! One client of a sensor: bytes in, bytes out, without sockets and without a clock of its own.

use agv_wire::cola::{Deframed, Deframer};

use super::pending::Pending;
use super::sensor::Sensor;

/// One connection to a sensor.
#[derive(Default)]
pub struct Connection {
    deframer: Box<Deframer<65_536>>,
    pending: Pending,
}

impl Connection {
    /// What the sensor answers to bytes at once.
    pub fn receive(&mut self, sensor: &mut Sensor, bytes: &[u8], now: f64) -> Vec<u8> {
        let mut answers = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let taken = self.deframer.extend(rest);
            rest = &rest[taken..];
            while let Some(found) = self.deframer.next() {
                let Deframed::Telegram { dialect, payload, .. } = found else { continue };
                if sensor.dialect.is_none_or(|only| only == dialect) {
                    answers.extend(sensor.answer(dialect, payload, now, &mut self.pending));
                }
            }
        }
        answers
    }

    /// When the sensor will have something to say by itself.
    #[must_use]
    pub fn due(&self) -> Option<f64> {
        self.pending.due()
    }

    /// What the sensor says by itself.
    pub fn poll(&mut self, sensor: &Sensor, now: f64) -> Option<Vec<u8>> {
        self.pending.poll(sensor, now)
    }
}
