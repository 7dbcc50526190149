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

use super::can_port::CanPort;
use super::exchange::{self, BusEvent, now};
use super::supervision::{self, Task};

/// How often state machines are asked what is due.
const STEP: Duration = Duration::from_millis(1);

/// Takes part in the bus for ever.
pub async fn run(mut port: impl CanPort, settings: &Settings, has_panicked: bool) -> ! {
    let start = now();
    let [drive, steering] = channels(settings);
    let controller = node(settings.nodes.controller);
    let mut pair = EncoderPair::new(&drive, &steering, SYNC_PERIOD, start);
    let mut node = ControllerNode::new(controller, start);
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
            for emergency in troubles(has_panicked) {
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

/// What was wrong at the start, in the codes of CiA 301, table 26.
fn troubles(has_panicked: bool) -> impl Iterator<Item = Emergency> {
    let internal_software = has_panicked.then_some(0x6100);
    let data_set = (!exchange::are_settings_sound()).then_some(0x6300);
    let generic = |code| Emergency { code, register: 1, details: [0; 5] };
    internal_software.into_iter().chain(data_set).map(generic)
}
