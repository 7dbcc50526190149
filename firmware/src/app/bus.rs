//! The CAN bus: encoders in, pose and health out.
//!
//! Deadline: a pose every 10 ms, and each sample predicted at most 200 us after its frame.

use agv_controller::{Bus, BusOutput, Troubles};
use agv_settings::Settings;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Ticker};

use super::can_port::{BusChange, CanPort};
use super::exchange::{self, now};
use super::supervision::{self, Task};

/// How often state machines are asked what is due.
const STEP: Duration = Duration::from_millis(1);

/// Takes part in the bus for ever.
pub async fn run(mut port: impl CanPort, settings: &Settings, troubles: Troubles) -> ! {
    let mut bus = Bus::new(settings, troubles, now());
    port.listen_to(&bus.nodes());
    let mut ticker = Ticker::every(STEP);
    loop {
        let woken = select(port.receive(), ticker.next()).await;
        supervision::check_in(Task::Bus);
        if let Some(code) = port.supervise(now()).and_then(code) {
            port.send(&bus.emergency(code));
        }
        if let Some(estimate) = exchange::newest_estimate() {
            bus.update(&estimate);
        }
        let mut take = |output| match output {
            // A frame for which there is no room is left out; what it says is said again.
            BusOutput::Send(frame) => {
                port.send(&frame);
            }
            BusOutput::Event(told) => exchange::pass_on(told),
            BusOutput::Published(published) => exchange::log_published(published),
        };
        if let Either::First((frame, heard)) = &woken {
            bus.hear(frame, *heard, &mut take);
        }
        bus.poll(now(), exchange::laser_health(), &mut take);
        exchange::set_standing(bus.is_standing(now()));
    }
}

/// What is told of a change of the bus, in the codes of CiA 301, table 26.
const fn code(change: BusChange) -> Option<u16> {
    match change {
        BusChange::Overrun => Some(0x8110),
        BusChange::Off => None,
        BusChange::BackFromOff => Some(0x8140),
    }
}
