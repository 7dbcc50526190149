//! The CAN bus: encoders in, pose and health out.
//!
//! Deadline: a pose every 10 ms, and each sample predicted at most 200 us after its frame.

use agv_controller::{Bus, BusOutput, ControllerIdentity, DiscreteLines, LineSet, Troubles};
use agv_settings::Settings;
use agv_settings::patient_flash::PatientFlash;
use agv_wire::can::controller_node::ErrorKind;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Ticker};
use embedded_hal::digital::{InputPin, OutputPin};

use super::can_port::{BusChange, CanPort};
use super::exchange::{self, now};
use super::service::SharedController;
use super::shared_settings::SharedSettings;
use super::supervision::{self, Task};
/// How often state machines are asked what is due.
const STEP: Duration = Duration::from_millis(1);

/// Takes part in the bus for ever.
pub async fn run<F: PatientFlash>(
    identity: ControllerIdentity,
    mut port: impl CanPort,
    lines: LineSet<impl OutputPin, impl InputPin>,
    settings: &Settings,
    controller: &SharedController<F>,
    troubles: Troubles,
) -> ! {
    let mut bus = Bus::new(settings, identity, troubles, now());
    let mut lines = DiscreteLines::new(lines);
    let mut nodes = bus.nodes();
    port.listen_to(&nodes, &bus.other_frames());
    let mut objects = SharedSettings { controller };
    let mut lost_events = exchange::lost_events();
    let mut ticker = Ticker::every(STEP);
    exchange::bus_has_started();
    loop {
        let woken = select(port.receive(), ticker.next()).await;
        supervision::check_in(Task::Bus);
        if let Some(kind) = port.supervise(now()).and_then(error) {
            bus.report(kind, now());
        }
        if core::mem::replace(&mut lost_events, exchange::lost_events()) != lost_events {
            bus.report(ErrorKind::Overload, now());
        }
        if let Some(is_stored) = exchange::saved() {
            if !is_stored {
                bus.report(ErrorKind::SettingsLost, now());
            }
            if let Some(answer) = bus.saved(is_stored) {
                port.send(&answer);
            }
        }
        if exchange::is_pause_announced() {
            bus.report(ErrorKind::Pause, now());
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
            BusOutput::Save(parameters) => exchange::save(parameters),
        };
        if let Either::First((frame, heard)) = &woken {
            bus.hear(frame, *heard, &mut objects, &mut take);
        }
        while let Some(output) = exchange::next_gyro().and_then(|sample| bus.hear_gyro(&sample)) {
            take(output);
        }
        bus.poll(now(), exchange::laser_health(), &mut take);
        if let Some(speed) = bus.laser_speed() {
            exchange::set_laser_speed(speed);
        }
        // Wires are no quicker than a step.
        if let Either::Second(()) = woken {
            let inputs = lines.poll(Some(&bus.discrete_report(now())), now());
            bus.hear_lines(&inputs, now());
        }
        exchange::set_standing(bus.is_standing(now()));
        // A master may have others watched.
        let wanted = bus.nodes();
        if wanted != nodes {
            port.listen_to(&wanted, &bus.other_frames());
            nodes = wanted;
        }
    }
}

/// What is told of a change of the bus.
const fn error(change: BusChange) -> Option<ErrorKind> {
    match change {
        BusChange::Overrun => Some(ErrorKind::Overrun),
        BusChange::Off => None,
        BusChange::BackFromOff => Some(ErrorKind::BusOff),
    }
}
