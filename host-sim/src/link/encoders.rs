//! The encoders of a vehicle on a CAN bus, and what else is said to a localiser there.

use agv_core::localizer::{Event, Parameters};
use agv_core::measurement::Time;
use agv_core::odometry::Vehicle;
use agv_core::wire::can::canopen::NodeId;
use agv_core::wire::can::controller::OrderReceiver;
use agv_core::wire::can::encoder::{EncoderSettings, Reporting};
use agv_core::wire::can::encoder_pair::{ChannelSettings, EncoderPair};
use agv_core::wire::can::frame::Frame;
use agv_core::wire::can::supervision::SupervisionLimits;

/// Which nodes the encoders are, and how they report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderNodes {
    /// The driving wheel's encoder.
    pub drive: NodeId,
    /// The steering's encoder.
    pub steering: NodeId,
    /// Whether positions are read at SYNC instead of by the encoders' own timers.
    pub is_synchronous: bool,
    /// The controller, whose orders are heard.
    pub controller: NodeId,
}

/// Time between positions, ms.
const PERIOD: u16 = 10;
/// Hardest braking of a vehicle whose own is not known, m/s^2.
const HARDEST_BRAKING: f64 = 2.5;
/// Fastest and hardest motion of a steering, rad/s and rad/s^2.
const STEERING_LIMITS: (f64, f64) = (3.0, 100.0);
/// Limits of an encoder whose scale is not known, ticks/s and ticks/s^2.
const UNKNOWN_LIMITS: (f64, f64) = (1e6, 1e6);

/// Settings of the driving wheel's and the steering's encoder, with limits that fit the vehicle.
#[must_use]
pub fn settings(nodes: &EncoderNodes, parameters: &Parameters) -> [ChannelSettings; 2] {
    let reporting = if nodes.is_synchronous { Reporting::Synchronous } else { Reporting::Timer { period: PERIOD } };
    let channel = |node, range, (fastest, braking)| ChannelSettings {
        encoder: EncoderSettings { reporting, range, ..EncoderSettings::new(node) },
        limits: SupervisionLimits::every(0.010, fastest, braking),
    };
    let Vehicle::Tricycle(vehicle) = parameters.vehicle else {
        return [channel(nodes.drive, None, UNKNOWN_LIMITS), channel(nodes.steering, None, UNKNOWN_LIMITS)];
    };
    let ticks = |(fastest, braking): (f64, f64), scale: f64| (fastest / scale.abs(), braking / scale.abs());
    let drive = ticks((parameters.limits.fastest, HARDEST_BRAKING), vehicle.drive_scale);
    let steering = ticks(STEERING_LIMITS, vehicle.steering_scale);
    [
        channel(nodes.drive, Some(vehicle.drive_range), drive),
        channel(nodes.steering, Some(vehicle.steering_range), steering),
    ]
}

/// What comes of a look at the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<'a> {
    /// A frame is to be sent.
    Send(Frame),
    /// A localiser is told something.
    Event(Event<'a>),
}

/// Sets the encoders up, watches them, and makes events of what they and other controllers say. What comes out depends
/// on the calls of [`EncoderLink::look`] alone, so a record of them gives the same events again.
#[derive(Clone, Debug)]
pub struct EncoderLink {
    pair: EncoderPair,
    orders: OrderReceiver,
}

impl EncoderLink {
    /// Encoders that have not been heard before `start`.
    #[must_use]
    pub fn new(nodes: &EncoderNodes, parameters: &Parameters, start: Time) -> Self {
        let [drive, steering] = settings(nodes, parameters);
        let pair = EncoderPair::new(&drive, &steering, f64::from(PERIOD) * 1e-3, start);
        Self { pair, orders: OrderReceiver::new(nodes.controller) }
    }

    /// Looks at the bus at `now`, where a frame may have come. To be called for every frame, and at least every 5 ms.
    ///
    /// # Errors
    /// What `take` returns.
    pub fn look<E>(
        &mut self,
        now: Time,
        frame: Option<&Frame>,
        mut take: impl FnMut(Outcome) -> Result<(), E>,
    ) -> Result<(), E> {
        if let Some(frame) = frame {
            if let Some(fix) = self.orders.handle(frame, now) {
                take(Outcome::Event(Event::SetPose(fix)))?;
            }
            if let Some(sample) = self.pair.handle(frame, now) {
                take(Outcome::Event(Event::Encoders(sample)))?;
            }
        }
        if self.orders.is_standstill(now) {
            self.pair.expect_standstill();
        }
        if let Some(faults) = self.pair.poll_faults(now) {
            take(Outcome::Event(Event::EncoderFaults(faults)))?;
        }
        while let Some(frame) = self.pair.poll(now) {
            take(Outcome::Send(frame))?;
        }
        Ok(())
    }
}
