//! The encoders on the bus, and what other controllers say to the localiser there.

use agv_core::localizer::{Event, Parameters, PoseFix};
use agv_core::measurement::{EncoderFaults, EncoderSample, GyroSample, Time, WheelReading, WheelSample};
use agv_core::odometry::{Differential, DrivenWheel, Tricycle, Vehicle, WheelVehicle};
use agv_settings::Settings;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::OrderReceiver;
use agv_wire::can::encoder::{EncoderSettings, Profile, Reporting};
use agv_wire::can::encoder_pair::{ChannelSettings, EncoderPair};
use agv_wire::can::frame::Frame;
use agv_wire::can::plausibility::PlausibilityLimits;

/// Time between SYNC messages if encoders want them, s; and between their positions then.
const SYNC_PERIOD: f64 = 0.010;
/// Hardest braking of a sound vehicle, m/s^2.
const BRAKING: f64 = 2.5;
/// Fastest turn of the steering, rad/s, and its hardest braking, rad/s^2.
const STEERING: (f64, f64) = (3.0, 100.0);
/// The same of an encoder whose scale is not known, ticks/s and ticks/s^2.
const UNKNOWN: (f64, f64) = (1e6, 1e6);

/// Which nodes the encoders are, and how they report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderNodes {
    /// The driving wheel's encoder.
    pub drive: NodeId,
    /// The steering's encoder.
    pub steering: NodeId,
    /// The controller, whose orders are heard.
    pub controller: NodeId,
    /// What they are: driving wheel, steering.
    pub profiles: [Profile; 2],
    /// When they report.
    pub reporting: Reporting,
    /// Whether the controller is their master; else it only listens to them.
    pub are_managed: bool,
}

impl EncoderNodes {
    /// Those of a vehicle that is set up.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let nodes = settings.nodes;
        Self {
            drive: node(nodes.drive),
            steering: node(nodes.steering),
            controller: node(nodes.controller),
            profiles: [nodes.drive_profile, nodes.steering_profile].map(profile),
            reporting: Reporting::Timer { period: settings.encoder_period },
            are_managed: nodes.is_master,
        }
    }
}

/// The node with that number; the settings have no other numbers than those of nodes.
fn node(number: u8) -> NodeId {
    NodeId::new(number).unwrap_or(FIRST)
}

/// The profile with that number; the settings have no other numbers than those of the two.
const fn profile(number: u16) -> Profile {
    if number == 402 { Profile::Drive } else { Profile::Encoder }
}

const FIRST: NodeId = match NodeId::new(1) {
    Some(node) => node,
    None => panic!("1 is a node"),
};

/// Settings of the driving wheel's and the steering's encoder, with limits that fit the vehicle.
#[must_use]
pub fn channels(nodes: &EncoderNodes, parameters: &Parameters) -> [ChannelSettings; 2] {
    let mut channels = limited(nodes, parameters);
    for (channel, profile) in channels.iter_mut().zip(nodes.profiles) {
        channel.encoder.profile = profile;
        channel.encoder.is_managed = nodes.are_managed;
        // Nobody knows how often another master lets them tell that they are there; that they report is watched.
        if !channel.encoder.has_master() {
            channel.encoder.heartbeat = 0;
        }
    }
    channels
}

/// The same of encoders that this controller is the master of.
fn limited(nodes: &EncoderNodes, parameters: &Parameters) -> [ChannelSettings; 2] {
    let period = match nodes.reporting {
        Reporting::Timer { period } | Reporting::Polled { period } => 1e-3 * f64::from(period),
        Reporting::Synchronous => SYNC_PERIOD,
    };
    let channel = |node, range, (fastest, braking): (f64, f64), scale: f64| ChannelSettings {
        encoder: EncoderSettings { reporting: nodes.reporting, range, ..EncoderSettings::new(node) },
        limits: PlausibilityLimits::every(period, fastest / scale.abs(), braking / scale.abs()),
    };
    let drive = (parameters.limits.fastest, BRAKING);
    if let Some(Differential { left, right, .. }) = differential(parameters) {
        let of =
            |node, wheel: &DrivenWheel| channel(node, Some(wheel.turn.range), drive, wheel.radius * wheel.turn.scale);
        return [of(nodes.drive, left), of(nodes.steering, right)];
    }
    let Vehicle::Tricycle(Tricycle { drive_scale, steering_scale, drive_range, steering_range, .. }) =
        parameters.vehicle
    else {
        return [channel(nodes.drive, None, UNKNOWN, 1.0), channel(nodes.steering, None, UNKNOWN, 1.0)];
    };
    [
        channel(nodes.drive, Some(drive_range), drive, drive_scale),
        channel(nodes.steering, Some(steering_range), STEERING, steering_scale),
    ]
}

/// The two driven wheels of the parameters, if it is such a vehicle: its encoders are the pair, left and right.
const fn differential(parameters: &Parameters) -> Option<&Differential> {
    match &parameters.vehicle {
        Vehicle::Wheels(WheelVehicle::Differential(vehicle)) => Some(vehicle),
        _ => None,
    }
}

/// What the bus tells the localiser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BusEvent {
    /// Counters of both encoders of a tricycle.
    Encoders(EncoderSample),
    /// Counters of several wheels.
    Wheels(WheelSample),
    /// What is wrong with them.
    EncoderFaults(EncoderFaults),
    /// A rate of the gyro.
    Gyro(GyroSample),
    /// A pose from outside.
    SetPose(PoseFix),
}

impl BusEvent {
    /// As the localiser takes it.
    #[must_use]
    pub fn event(&self) -> Event<'static> {
        match *self {
            Self::Encoders(sample) => Event::Encoders(sample),
            Self::Wheels(sample) => Event::Wheels(sample),
            Self::EncoderFaults(faults) => Event::EncoderFaults(faults),
            Self::Gyro(sample) => Event::Gyro(sample),
            Self::SetPose(fix) => Event::SetPose(fix),
        }
    }
}

/// What comes of a look at the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncoderOutput {
    /// A frame is to be sent.
    Send(Frame),
    /// The localiser is told something.
    Event(BusEvent),
}

/// Sets the encoders up, watches them, and makes events of what they and other controllers say. What comes out depends on
/// the calls alone, so a record of them gives the same events again.
#[derive(Clone, Debug)]
pub struct Encoders {
    pair: EncoderPair,
    orders: OrderReceiver,
    has_two_wheels: bool,
}

impl Encoders {
    /// Encoders that have not been heard before `start`.
    #[must_use]
    pub fn new(nodes: &EncoderNodes, parameters: &Parameters, start: Time) -> Self {
        let [drive, steering] = channels(nodes, parameters);
        Self {
            pair: EncoderPair::new(&drive, &steering, SYNC_PERIOD, start),
            orders: OrderReceiver::new(nodes.controller),
            has_two_wheels: differential(parameters).is_some(),
        }
    }

    /// Takes a frame that came at `heard`. The localiser is told at most two things.
    pub fn hear(&mut self, frame: &Frame, heard: Time, mut tell: impl FnMut(BusEvent)) {
        if let Some(fix) = self.orders.handle(frame, heard) {
            tell(BusEvent::SetPose(fix));
        }
        if let Some(sample) = self.pair.handle(frame, heard) {
            tell(if self.has_two_wheels { two_wheels(&sample) } else { BusEvent::Encoders(sample) });
        }
    }

    /// Both: looks at the bus at `now`, where a frame may have come.
    pub fn look(&mut self, now: Time, frame: Option<&Frame>, mut take: impl FnMut(EncoderOutput)) {
        if let Some(frame) = frame {
            self.hear(frame, now, |event| take(EncoderOutput::Event(event)));
        }
        self.poll(now, take);
    }

    /// Does what is due at `now`. To be called at least every 5 ms.
    pub fn poll(&mut self, now: Time, mut take: impl FnMut(EncoderOutput)) {
        if self.orders.is_standstill(now) {
            self.pair.expect_standstill();
        }
        if let Some(faults) = self.pair.poll_faults(now) {
            take(EncoderOutput::Event(BusEvent::EncoderFaults(faults)));
        }
        while let Some(frame) = self.pair.poll(now) {
            take(EncoderOutput::Send(frame));
        }
    }
}

/// The pair of a vehicle with two driven wheels: left, and right at the same time.
fn two_wheels(sample: &EncoderSample) -> BusEvent {
    let wheel = |count: u32| WheelReading { count, steering: 0 };
    let none = WheelReading::default();
    BusEvent::Wheels(WheelSample {
        time: sample.time,
        wheels: [wheel(sample.drive), wheel(sample.steering), none, none],
    })
}
