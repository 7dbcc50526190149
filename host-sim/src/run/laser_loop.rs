//! The NAV350 over TCP.

use std::convert::Infallible;

use agv_wire::nav350::{Configuration, SensorWatch};

use super::exchange::{Exchange, LaserQueues, Task};
use crate::link::nav350::{Happening, Link};

/// How long the link is left alone before it is told how fast the laser moves, s: as often as a session tells the sensor.
const SLICE: f64 = 0.025;
/// Longest pause before a sensor that was lost is tried again, and how long a connection may take, s. A vehicle whose laser is back
/// localises within 5 s.
const LONGEST_PAUSE: f64 = 1.0;
const CONNECT: f64 = 1.0;

/// Asks the sensor at `address` for its revolutions until everything ends. `note` is told what becomes of the connection.
pub(super) fn run(
    address: &str,
    configuration: Configuration,
    exchange: &Exchange,
    queues: &LaserQueues,
    note: &(dyn Fn(&str) + Sync),
) {
    let configuration = Configuration { longest_pause: LONGEST_PAUSE, connect_timeout: CONNECT, ..configuration };
    let mut link = Link::new(address, configuration, exchange.clock);
    let mut watch = SensorWatch::new();
    let mut is_lost = false;
    while !exchange.is_over() {
        exchange.check_in(Task::Laser);
        if let Some(speed) = exchange.newest_laser_speed() {
            link.set_speed(speed);
        }
        let until = exchange.now().offset(SLICE);
        let outcome = link.run(until, |time, happening| -> Result<(), Infallible> {
            match happening {
                Happening::Connected => note(&format!("nav350: {address}: connected")),
                Happening::Revolution(revolution) => {
                    is_lost = false;
                    watch.measured(time);
                    queues.pass_on(revolution, exchange);
                }
                Happening::Lost(reason) => {
                    watch.lost(reason);
                    // Once, not at each attempt.
                    if !std::mem::replace(&mut is_lost, true) {
                        note(&format!("nav350: {address}: lost: {reason}; it is tried again"));
                    }
                }
                Happening::Report(report) => watch.reported(report),
                Happening::Sent(_) | Happening::Received(_) => {}
            }
            exchange.set_laser(watch);
            Ok(())
        });
        match outcome {
            Ok(()) => {}
            Err(never) => match never {},
        }
    }
}
