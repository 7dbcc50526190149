//! The CAN bus: encoders in, pose and health out.
//!
//! Deadline: a pose every 10 ms, and each sample predicted at most 200 us after its frame. A pose that is late is left
//! out; the next one is for its own time.

use agv_core::measurement::EncoderFaults;
use agv_core::wire::can::controller::{Health, Order, OrderReceiver, PosePublisher};
use agv_core::wire::can::controller_node::ControllerNode;
use agv_core::wire::can::encoder_pair::EncoderPair;
use agv_core::wire::can::frame::AnyFrame;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Ticker};

use super::can_port::CanPort;
use super::exchange::{self, BusEvent, now};
use super::settings::{SYNC_PERIOD, Settings};

/// How often state machines are asked what is due.
const STEP: Duration = Duration::from_millis(1);

/// Takes part in the bus for ever.
pub async fn run(mut port: impl CanPort, settings: &Settings) -> ! {
    let start = now();
    let mut pair = EncoderPair::new(&settings.drive, &settings.steering, SYNC_PERIOD, start);
    let mut node = ControllerNode::new(settings.controller, start);
    let mut orders = OrderReceiver::new(settings.controller);
    let mut publisher = PosePublisher::new(settings.controller, start);
    let mut faults = EncoderFaults::default();
    let mut ticker = Ticker::every(STEP);
    loop {
        let woken = select(port.receive(), ticker.next()).await;
        let time = now();
        if let Either::First(AnyFrame::Classic(frame)) = &woken {
            if let Some(sample) = pair.handle(frame, time) {
                exchange::take_encoders(sample);
            }
            if let Some(answer) = node.handle(frame) {
                port.send(&answer);
            }
            if let Some(Order::InitialPose(fix)) = orders.handle(frame, time) {
                exchange::pass_on(BusEvent::SetPose(fix));
            }
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
        let (output, laser) = exchange::output();
        let Some(output) = output else { continue };
        let health = Health { drive: faults.drive, steering: faults.steering, laser, layer: 0 };
        if let Some(frames) = publisher.poll(time, &output, &health) {
            for frame in &frames {
                port.send(frame);
            }
        }
    }
}
