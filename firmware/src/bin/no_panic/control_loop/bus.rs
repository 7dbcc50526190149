//! The CAN bus: encoders, orders and the published pose.

use core::hint::black_box;

use agv_core::localizer::{OutputPredictor, Parameters};
use agv_core::measurement::{EncoderFaults, Time};
use agv_core::odometry::OdometryBias;
use agv_core::wire::can::canopen::NodeId;
use agv_core::wire::can::controller::{Health, LaserHealth, OrderReceiver, PosePublisher, StartSearch};
use agv_core::wire::can::controller_node::ControllerNode;
use agv_core::wire::can::encoder_pair::EncoderPair;
use agv_core::wire::can::frame::{Frame, extended_id, standard_id};
use agv_core::wire::can::slcan;
use agv_settings::Settings;
use agv_settings::encoders::{SYNC_PERIOD, channels, node};

use super::any;

/// What takes part in the bus.
pub struct Bus {
    pair: EncoderPair,
    node: ControllerNode,
    orders: OrderReceiver,
    publisher: PosePublisher,
    predictor: OutputPredictor<16>,
    slcan: slcan::Decoder,
}

impl Bus {
    pub fn new() -> Self {
        let settings: Settings = any(Settings::default());
        let start = any(Time::default());
        let controller: NodeId = node(settings.nodes.controller);
        let [drive, steering] = channels(&settings);
        let parameters: Parameters = settings.parameters;
        Self {
            pair: EncoderPair::new(&drive, &steering, SYNC_PERIOD, start),
            node: ControllerNode::new(controller, start),
            orders: OrderReceiver::new(controller),
            publisher: PosePublisher::new(controller, start),
            predictor: OutputPredictor::new(&parameters),
            slcan: slcan::Decoder::new(),
        }
    }

    /// A frame, a byte of a serial adapter, and what is due.
    pub fn step(&mut self) {
        let time = any(Time::default());
        let id = if any(true) { standard_id(any(0)) } else { extended_id(any(0)) };
        let bytes = any([0; 8]);
        let data = bytes.get(..any(8)).unwrap_or_default();
        let frame = if any(true) { Frame::new(id, data) } else { Frame::remote(id, any(8)) };
        if let Some(frame) = frame {
            self.take(&frame, time);
        }
        if let Some(Ok(message)) = self.slcan.push(any(0)) {
            black_box(message.encode());
            if let slcan::Message::Frame { frame, .. } = message
                && let Some(frame) = frame.classic()
            {
                self.take(frame, time);
            }
        }
        if self.orders.is_standstill(time) {
            self.pair.expect_standstill();
        }
        if let Some(faults) = self.pair.poll_faults(time) {
            self.predictor.doubt_encoders(&faults);
        }
        while let Some(frame) = self.pair.poll(time) {
            black_box(frame);
        }
        while let Some(frame) = self.node.poll(time) {
            black_box(frame);
        }
        let faults: EncoderFaults = self.pair.faults(time);
        let health = Health {
            drive: faults.drive,
            steering: faults.steering,
            laser: any(LaserHealth::Unknown),
            start_search: any(StartSearch::Idle),
        };
        if let Some(output) = self.predictor.output() {
            self.predictor.update(&any(output), &any(OdometryBias::default()));
            black_box(self.publisher.poll(time, &output, &health));
        }
    }

    fn take(&mut self, frame: &Frame, time: Time) {
        if let Some(sample) = self.pair.handle(frame, time) {
            self.predictor.encoders(&sample);
        }
        black_box(self.node.handle(frame));
        black_box(self.orders.handle(frame, time));
    }
}
