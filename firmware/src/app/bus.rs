//! The CAN bus: encoders in, pose and health out.
//!
//! Deadline: a pose every 10 ms, and each sample predicted at most 200 us after its frame. A pose that is late is left
//! out; the next one is for its own time.

use agv_core::measurement::EncoderFaults;
use agv_core::wire::can::canopen::Message;
use agv_core::wire::can::controller::{Health, OrderReceiver, PosePublisher};
use agv_core::wire::can::controller_node::ControllerNode;
use agv_core::wire::can::emcy::Emergency;
use agv_core::wire::can::encoder_pair::EncoderPair;
use agv_settings::Settings;
use agv_settings::encoders::{SYNC_PERIOD, channels, node};
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Ticker};

use super::can_port::{BusChange, CanPort};
use super::exchange::{self, BusEvent, now};
use super::supervision::{self, Task};

/// How often state machines are asked what is due.
const STEP: Duration = Duration::from_millis(1);

/// What is to be told of the start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Troubles {
    /// The program has failed before.
    pub has_failed: bool,
    /// A part of the board does not work.
    pub is_board_damaged: bool,
}

/// Takes part in the bus for ever.
pub async fn run(mut port: impl CanPort, settings: &Settings, found: Troubles) -> ! {
    let start = now();
    let [drive, steering] = channels(settings);
    let controller = node(settings.nodes.controller);
    let mut pair = EncoderPair::new(&drive, &steering, SYNC_PERIOD, start);
    let mut node = ControllerNode::new(controller, start);
    port.listen_to(&[controller, drive.encoder.node, steering.encoder.node]);
    let mut orders = OrderReceiver::new(controller);
    let mut publisher = PosePublisher::new(controller, start);
    let mut faults = EncoderFaults::default();
    let mut has_reported = false;
    let mut ticker = Ticker::every(STEP);
    loop {
        let woken = select(port.receive(), ticker.next()).await;
        supervision::check_in(Task::Bus);
        if let Either::First((frame, heard)) = &woken {
            let time = *heard;
            if let Some(sample) = pair.handle(frame, time) {
                exchange::take_encoders(sample);
            }
            if let Some(answer) = node.handle(frame) {
                port.send(&answer);
            }
            if let Some(fix) = orders.handle(frame, time) {
                exchange::pass_on(BusEvent::SetPose(fix));
            }
        }
        let time = now();
        if let Some(emergency) = port.supervise(time).and_then(emergency) {
            port.send(&Message::Emergency { node: controller, emergency }.encode());
        }
        if orders.is_standstill(time) {
            pair.expect_standstill();
        }
        if let Some(found) = pair.poll_faults(time) {
            faults = found;
            exchange::take_faults(found);
        }
        while let Some(frame) = pair.poll(time) {
            port.send(&frame);
        }
        while let Some(frame) = node.poll(time) {
            port.send(&frame);
        }
        if !node.is_operational() {
            continue;
        }
        if !core::mem::replace(&mut has_reported, true) {
            for emergency in troubles(found) {
                port.send(&Message::Emergency { node: controller, emergency }.encode());
            }
        }
        let (output, laser) = exchange::output();
        let Some(output) = output else { continue };
        let start_search = exchange::start_search();
        let health = Health { drive: faults.drive, steering: faults.steering, laser, start_search };
        if let Some(frames) = publisher.poll(time, &output, &health) {
            for frame in &frames {
                port.send(frame);
            }
        }
    }
}

/// An error or its end, in the codes of CiA 301, table 26.
const fn generic(code: u16) -> Emergency {
    Emergency { code, register: 1, details: [0; 5] }
}

/// What was wrong at the start.
fn troubles(found: Troubles) -> impl Iterator<Item = Emergency> {
    let hardware = found.is_board_damaged.then_some(0x5000);
    let internal_software = found.has_failed.then_some(0x6100);
    let data_set = (!exchange::are_settings_sound()).then_some(0x6300);
    hardware.into_iter().chain(internal_software).chain(data_set).map(generic)
}

/// What is told of a change of the bus.
const fn emergency(change: BusChange) -> Option<Emergency> {
    match change {
        BusChange::Overrun => Some(generic(0x8110)),
        BusChange::Off => None,
        BusChange::BackFromOff => Some(generic(0x8140)),
    }
}
