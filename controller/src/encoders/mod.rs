//! What tells the vehicle's motion on the bus, and what other controllers say to the localiser there.

mod own_reports;

use agv_core::localizer::{Event, Parameters, PoseFix};
use agv_core::measurement::{
    EncoderFaults, EncoderSample, GyroSample, MOST_WHEELS, PoseIncrement, SpeedSample, Time, WheelReading, WheelSample,
};
use agv_core::odometry::{Counted, Counter, CounterRange, MOST_COUNTERS, Vehicle};
use agv_settings::Settings;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::OrderReceiver;
use agv_wire::can::encoder::{CodeSequence, EncoderSettings, Profile, Reporting};
use agv_wire::can::encoder_group::{ChannelSettings, Counts, EncoderGroup};
use agv_wire::can::frame::{Frame, Id};
use agv_wire::can::motion_frames::MotionFrames;
use agv_wire::can::plausibility::PlausibilityLimits;
use heapless::Vec;

use own_reports::OwnReports;

/// Time between SYNC messages if encoders want them, s; and between their positions then.
const SYNC_PERIOD: f64 = 0.010;
/// Hardest braking of a sound vehicle, m/s^2.
const BRAKING: f64 = 2.5;
/// Fastest turn of the steering, rad/s, and its hardest braking, rad/s^2.
const STEERING: (f64, f64) = (3.0, 100.0);
/// The same of an encoder whose scale is not known, ticks/s and ticks/s^2.
const UNKNOWN: (f64, f64) = (1e6, 1e6);

/// Who tells the vehicle's motion, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderNodes {
    /// The encoders, in the order of [`Vehicle::counters`]; as many as the vehicle has count.
    pub encoders: [NodeId; MOST_COUNTERS],
    /// What they are.
    pub profiles: [Profile; MOST_COUNTERS],
    /// Which way they shall count, where that is known.
    pub code_sequences: [Option<CodeSequence>; MOST_COUNTERS],
    /// The controller, whose orders are heard.
    pub controller: NodeId,
    /// When the encoders report, or the vehicle's own controller does.
    pub reporting: Reporting,
    /// Whether the controller is the master of the encoders; else it only listens to them.
    pub are_managed: bool,
    /// Where the vehicle's own controller says how it moves. Without it two encoders are heard of a vehicle that reports no
    /// counters: what they say can be recorded.
    pub motion_frames: Option<MotionFrames>,
}

impl EncoderNodes {
    /// Encoders of CiA 406 that the controller is the master of, and that report every 10 ms.
    #[must_use]
    pub const fn new(encoders: [NodeId; MOST_COUNTERS], controller: NodeId) -> Self {
        Self {
            encoders,
            profiles: [Profile::Encoder; MOST_COUNTERS],
            code_sequences: [None; MOST_COUNTERS],
            controller,
            reporting: Reporting::Timer { period: 10 },
            are_managed: true,
            motion_frames: None,
        }
    }

    /// Those of a vehicle that is set up.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let nodes = settings.nodes;
        Self {
            encoders: nodes.encoders.map(|encoder| node(encoder.node)),
            profiles: nodes.encoders.map(|encoder| profile(encoder.profile)),
            code_sequences: nodes.encoders.map(|encoder| encoder.code_sequence),
            controller: node(nodes.controller),
            reporting: Reporting::Timer { period: settings.encoder_period },
            are_managed: nodes.is_master,
            motion_frames: Some(settings.motion_frames),
        }
    }

    /// Time between reports, s.
    #[must_use]
    pub fn period(&self) -> f64 {
        match self.reporting {
            Reporting::Timer { period } | Reporting::Polled { period } => 1e-3 * f64::from(period),
            Reporting::Synchronous => SYNC_PERIOD,
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

/// Settings of the encoders, with limits that fit the vehicle; of driving wheel and steering if it reports no counters.
#[must_use]
pub fn channels(nodes: &EncoderNodes, parameters: &Parameters) -> Vec<ChannelSettings, MOST_COUNTERS> {
    let counters = parameters.vehicle.counters();
    let mut channels = Vec::new();
    if counters.is_empty() {
        for (number, counted) in [Counted::Turn, Counted::Steering].into_iter().enumerate() {
            add(&mut channels, channel(nodes, number, counted, None, UNKNOWN));
        }
    }
    for (number, counter) in counters.iter().enumerate() {
        let Counter { counted, range, scale, .. } = *counter;
        let (fastest, braking) = match counted {
            Counted::Turn => (parameters.limits.fastest, BRAKING),
            Counted::Steering => STEERING,
        };
        let limits = (fastest / scale.abs(), braking / scale.abs());
        add(&mut channels, channel(nodes, number, counted, Some(range), limits));
    }
    channels
}

/// Adds what there is; nobody adds more than there is room for.
pub(super) fn add<T, const ROOM: usize>(to: &mut Vec<T, ROOM>, what: Option<T>) {
    if let Some(what) = what {
        let _ = to.push(what);
    }
}

/// The encoder of that number, whose fastest motion (ticks/s) and hardest braking (ticks/s^2) are given.
fn channel(
    nodes: &EncoderNodes,
    number: usize,
    counted: Counted,
    range: Option<CounterRange>,
    (fastest, braking): (f64, f64),
) -> Option<ChannelSettings> {
    let (node, profile) = (*nodes.encoders.get(number)?, *nodes.profiles.get(number)?);
    let mut encoder = EncoderSettings {
        reporting: nodes.reporting,
        range,
        code_sequence: nodes.code_sequences.get(number).copied().flatten(),
        profile,
        is_managed: nodes.are_managed,
        ..EncoderSettings::new(node)
    };
    // Nobody knows how often another master lets them tell that they are there; that they report is watched.
    if !encoder.has_master() {
        encoder.heartbeat = 0;
    }
    Some(ChannelSettings { encoder, limits: PlausibilityLimits::every(nodes.period(), fastest, braking), counted })
}

/// What the bus tells the localiser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BusEvent {
    /// Counters of both encoders of a tricycle.
    Encoders(EncoderSample),
    /// Counters of several wheels.
    Wheels(WheelSample),
    /// Speed and steering angle.
    Speed(SpeedSample),
    /// How far the vehicle has moved.
    Increment(PoseIncrement),
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
            Self::Speed(sample) => Event::Speed(sample),
            Self::Increment(increment) => Event::Increment(increment),
            Self::EncoderFaults(faults) => Event::EncoderFaults(faults),
            Self::Gyro(sample) => Event::Gyro(sample),
            Self::SetPose(fix) => Event::SetPose(fix),
        }
    }
}

/// What the counters of a vehicle say, as its localiser takes it.
#[must_use]
pub fn counted(vehicle: &Vehicle, counts: &Counts) -> BusEvent {
    let Counts { time, counts } = *counts;
    let Vehicle::Wheels(_) = vehicle else {
        let [drive, steering, ..] = counts;
        return BusEvent::Encoders(EncoderSample { time, drive, steering });
    };
    let mut sample = WheelSample { time, wheels: [WheelReading::default(); MOST_WHEELS] };
    for (counter, count) in vehicle.counters().iter().zip(counts) {
        sample.set_count(counter, count);
    }
    BusEvent::Wheels(sample)
}

/// What comes of a look at the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncoderOutput {
    /// A frame is to be sent.
    Send(Frame),
    /// The localiser is told something.
    Event(BusEvent),
}

/// Who tells the motion.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one of them")]
#[derive(Clone, Debug)]
enum Source {
    Counters(EncoderGroup),
    Own(OwnReports),
}

/// Sets the encoders up, watches them, and makes events of what they, or the vehicle's own controller, and other controllers say.
/// What comes out depends on the calls alone, so a record of them gives the same events again.
#[derive(Clone, Debug)]
pub struct Encoders {
    source: Source,
    vehicle: Vehicle,
    orders: OrderReceiver,
}

impl Encoders {
    /// Encoders that have not been heard before `start`.
    #[must_use]
    pub fn new(nodes: &EncoderNodes, parameters: &Parameters, start: Time) -> Self {
        let source = match OwnReports::of(nodes, &parameters.vehicle, start) {
            Some(reports) => Source::Own(reports),
            None => Source::Counters(EncoderGroup::new(&channels(nodes, parameters), SYNC_PERIOD, start)),
        };
        Self { source, vehicle: parameters.vehicle, orders: OrderReceiver::new(nodes.controller) }
    }

    /// Takes a frame that came at `heard`. The localiser is told at most two things.
    pub fn hear(&mut self, frame: &Frame, heard: Time, mut tell: impl FnMut(BusEvent)) {
        if let Some(fix) = self.orders.handle(frame, heard) {
            tell(BusEvent::SetPose(fix));
        }
        match &mut self.source {
            Source::Counters(group) => {
                if let Some(counts) = group.handle(frame, heard) {
                    tell(counted(&self.vehicle, &counts));
                }
            }
            Source::Own(reports) => reports.hear(frame, heard, tell),
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
        let is_standing = self.orders.is_standstill(now);
        let faults = match &mut self.source {
            Source::Counters(group) => {
                if is_standing {
                    group.expect_standstill();
                }
                group.poll_faults(now)
            }
            Source::Own(reports) => reports.poll_faults(now),
        };
        if let Some(faults) = faults {
            take(EncoderOutput::Event(BusEvent::EncoderFaults(faults)));
        }
        if let Source::Counters(group) = &mut self.source {
            while let Some(frame) = group.poll(now) {
                take(EncoderOutput::Send(frame));
            }
        }
    }

    /// A wire says at `now` that the vehicle stands still.
    pub fn hear_standstill(&mut self, now: Time) {
        self.orders.hear_line(now);
    }

    /// Which of the encoders that count turns, or of those that count angles, have a fault: bit 0 is the first encoder.
    #[must_use]
    pub fn faulty(&self, counted: Counted) -> u8 {
        match &self.source {
            Source::Counters(group) => group.faulty(counted),
            Source::Own(_) => 0,
        }
    }

    /// How many of the nodes are encoders of the vehicle.
    #[must_use]
    pub fn count(&self) -> usize {
        match &self.source {
            Source::Counters(group) => group.encoders().count(),
            Source::Own(_) => 0,
        }
    }

    /// Identifiers of the frames of the vehicle's own controller, if it tells the motion.
    #[must_use]
    pub fn own_frames(&self) -> Vec<Id, 2> {
        match &self.source {
            Source::Counters(_) => Vec::new(),
            Source::Own(reports) => reports.ids(),
        }
    }
}
