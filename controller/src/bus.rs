//! All that the controller hears and says on the CAN bus.

use agv_core::geometry::Pose;
use agv_core::integrity::AlertLimits;
use agv_core::localizer::OutputPredictor;
use agv_core::measurement::{EncoderFaults, GyroSample, Time};
use agv_core::odometry::{Counted, MOST_COUNTERS};
use agv_core::state::{LaserHealth, Mode, PoseOutput, Relocalization};
use agv_settings::Settings;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::Health;
use agv_wire::can::controller_node::{
    CONSUMERS, CarriedMap, CommunicationParameters, ControllerNode, ErrorKind, NodeSettings, Permission, ProcessData,
};
use agv_wire::can::frame::{Frame, Id};
use agv_wire::can::sdo::{AbortCode, ObjectDictionary};
use agv_wire::nav350::SensorSpeed;
use heapless::Vec;

use super::discrete::{DiscreteInputs, DiscreteReport};
use super::encoders::{BusEvent, EncoderNodes, EncoderOutput, Encoders, add};
use super::gyro::Gyro;
use super::localization::Estimate;
use super::progress::{Progress, SentPose, Told};
use super::standstill::Standstill;

/// Motions that the localiser may be behind: more than a scan takes. All of them are redone when it has spoken, which with
/// 16 of them is 0.1 ms at 480 MHz; the bus's queue holds three frames, 0.3 ms.
pub const MOTIONS: usize = 16;

/// What was wrong when the controller started, told once on the bus in the codes of CiA 301, table 26.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Troubles {
    /// Parts of the board that do not work (5000h), a bit for each: 0 for the Ethernet, 1 for the clock, 2 for the option bytes.
    pub damaged_parts: u8,
    /// The program ended by itself the last time (6100h).
    pub has_panicked: bool,
    /// Not everything that was set was found (6300h).
    pub are_settings_lost: bool,
}

impl Troubles {
    /// Kinds of errors, each with its parts.
    fn kinds(self) -> impl Iterator<Item = (ErrorKind, u8)> {
        let board = (self.damaged_parts != 0).then_some((ErrorKind::Board, self.damaged_parts));
        let panicked = self.has_panicked.then_some((ErrorKind::Panicked, 0));
        let settings = self.are_settings_lost.then_some((ErrorKind::SettingsLost, 0));
        board.into_iter().chain(panicked).chain(settings)
    }
}

/// What the controller says of itself on the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControllerIdentity {
    /// What it is called there (1009h).
    pub hardware: &'static str,
    /// Which of all controllers it is; 0 if nobody knows (1018h, subindex 4).
    pub serial: u32,
    /// Its map (2014h).
    pub map: CarriedMap,
    /// What a master has had stored of how it speaks (1010h).
    pub stored: Option<CommunicationParameters>,
}

/// Encoders are being set up for so long after the start, s: their faults are no errors until then.
const SETTING_UP: f64 = 2.0;

/// Most nodes whose frames mean something here.
const NODES: usize = 1 + MOST_COUNTERS + CONSUMERS;
/// Most identifiers of frames that no such node says: two of the vehicle's own controller, and the gyro's.
const OTHERS: usize = 3;

/// What comes of a look at the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BusOutput {
    /// A frame is to be sent.
    Send(Frame),
    /// The localiser is told something.
    Event(Told),
    /// A pose went out, in the frames before.
    Published(SentPose),
    /// The settings are to be stored, and these of how the controller speaks; then [`Bus::saved`] is to be called.
    Save(CommunicationParameters),
}

/// The encoders, the controller's own node, and the pose for now.
#[derive(Clone, Debug)]
pub struct Bus {
    nodes: EncoderNodes,
    encoders: Encoders,
    gyro: Gyro,
    /// Whether the controller has a gyro of its own, beside which none on the bus is heard.
    has_own_gyro: bool,
    node: ControllerNode,
    limits: AlertLimits,
    /// How long a pose is used by wires, s.
    deadline: f64,
    accepts_pose: bool,
    accepts_settings: bool,
    predictor: OutputPredictor<MOTIONS>,
    progress: Progress,
    standstill: Standstill,
    faults: EncoderFaults,
    laser: LaserHealth,
    is_lost: bool,
    relocalization: Relocalization,
    /// Where the laser is in R, if it is told how fast it moves.
    laser_mount: Option<Pose>,
    start: Time,
}

impl Bus {
    /// A bus on which nobody was heard before `start`.
    #[must_use]
    pub fn new(settings: &Settings, identity: ControllerIdentity, troubles: Troubles, start: Time) -> Self {
        let ControllerIdentity { hardware, serial, map, stored } = identity;
        let nodes = EncoderNodes::of(settings);
        let node = NodeSettings {
            vendor: settings.nodes.vendor,
            is_master: settings.nodes.is_master,
            starts_itself: settings.nodes.starts_itself,
            period: settings.publishing_period,
            hardware,
            serial,
            map,
            stored,
            ..NodeSettings::new(nodes.controller)
        };
        let mut node = ControllerNode::new(node, start);
        troubles.kinds().for_each(|(kind, parts)| node.report_of(kind, parts, start));
        Self {
            nodes,
            encoders: Encoders::new(&nodes, &settings.parameters, start),
            gyro: Gyro::of(settings),
            has_own_gyro: false,
            node,
            limits: settings.parameters.alert_limits,
            deadline: DiscreteReport::deadline(settings),
            accepts_pose: settings.nodes.accepts_pose,
            accepts_settings: settings.nodes.accepts_settings,
            predictor: OutputPredictor::new(&settings.parameters),
            progress: Progress::default(),
            standstill: Standstill::new(&settings.parameters.vehicle),
            faults: EncoderFaults::default(),
            laser: LaserHealth::Unknown,
            is_lost: false,
            relocalization: Relocalization::Idle,
            laser_mount: settings.laser.tells_speed.then(|| *settings.parameters.lasers.first()),
            start,
        }
    }

    /// How fast the laser moves, if it is told so and somebody reports it.
    #[must_use]
    pub fn laser_speed(&self) -> Option<SensorSpeed> {
        let Pose { x, y, theta } = self.laser_mount?;
        let (time, velocity) = self.predictor.velocity()?;
        // Of its point on the vehicle, along the axes of R, then along its own.
        let (along, across) = (velocity.x - velocity.theta * y, velocity.y + velocity.theta * x);
        let (sine, cosine) = libm::sincos(theta);
        let (x, y) = (cosine * along + sine * across, cosine * across - sine * along);
        Some(SensorSpeed { time, x, y, rotation: velocity.theta })
    }

    /// The localiser has said something.
    pub fn update(&mut self, estimate: &Estimate) {
        // Only the search may have got further. Before the first answer a vehicle without a pose is published.
        let is_first = !self.predictor.has_output();
        if core::mem::replace(&mut self.progress.answered, estimate.answered) != estimate.answered || is_first {
            self.predictor.update(&estimate.pose, &estimate.prediction);
        }
        self.is_lost = estimate.pose.mode == Mode::Lost;
        self.relocalization = estimate.relocalization;
    }

    /// Takes a frame that came at `heard`: at most three events and an answer. `settings` are what it can read, and change if it is
    /// permitted.
    pub fn hear(
        &mut self,
        frame: &Frame,
        heard: Time,
        settings: &mut impl ObjectDictionary,
        mut take: impl FnMut(BusOutput),
    ) {
        if self.node.is_operational() || !self.node.is_order(frame) {
            self.hear_others(frame, heard, &mut take);
        }
        let process = if self.node.is_asked(frame) { self.process() } else { None };
        if let Some(answer) = self.node.handle(frame, heard, process.as_ref(), settings, self.permission(heard)) {
            take(BusOutput::Send(answer));
        }
        if let Some(parameters) = self.node.take_save() {
            take(BusOutput::Save(parameters));
        }
        if let Some(order) = self.node.take_order() {
            self.hear_others(&order, heard, take);
        }
    }

    /// What was to be stored is stored, or could not be: the frame that tells whoever has asked for it.
    pub fn saved(&mut self, is_stored: bool) -> Option<Frame> {
        self.node.saved(is_stored)
    }

    /// Whether settings may be changed over the bus.
    fn permission(&self, now: Time) -> Permission {
        match (self.accepts_settings, self.standstill.stands(now)) {
            (true, true) => Ok(()),
            (true, false) => Err(AbortCode::DeviceState),
            (false, _) => Err(AbortCode::LocalControl),
        }
    }

    /// Takes what encoders and other controllers say.
    fn hear_others(&mut self, frame: &Frame, heard: Time, mut take: impl FnMut(BusOutput)) {
        let Self { encoders, predictor, progress, standstill, node, accepts_pose, faults, .. } = self;
        encoders.hear(frame, heard, |event| {
            match &event {
                BusEvent::Encoders(sample) => {
                    predictor.encoders(sample);
                    standstill.sample(sample.time, [sample.drive, 0, 0, 0]);
                }
                BusEvent::Wheels(sample) => {
                    predictor.wheels(sample);
                    standstill.sample(sample.time, sample.wheels.map(|wheel| wheel.count));
                }
                BusEvent::Speed(sample) => {
                    predictor.speed(sample);
                    standstill.speed(sample);
                }
                BusEvent::Increment(increment) => {
                    predictor.increment(increment);
                    standstill.increment(increment);
                }
                BusEvent::EncoderFaults(found) => {
                    *faults = *found;
                    predictor.doubt_encoders(found);
                }
                BusEvent::SetPose(_) if !*accepts_pose || !standstill.stands(heard) => {
                    return node.report(ErrorKind::PoseRefused, heard);
                }
                _ => {}
            }
            take(BusOutput::Event(progress.tell(event)));
        });
        if let Some(sample) = self.gyro.hear(frame, heard).filter(|_| !self.has_own_gyro) {
            take(self.tell_gyro(&sample));
        }
    }

    fn tell_gyro(&mut self, sample: &GyroSample) -> BusOutput {
        self.predictor.gyro(sample);
        BusOutput::Event(self.progress.tell(BusEvent::Gyro(*sample)))
    }

    /// Takes a reading of the controller's own gyro ([`super::GyroChip`]), if the vehicle is said to have one. From the first one on none on
    /// the bus is heard: two would be taken for one that contradicts itself.
    pub fn hear_gyro(&mut self, sample: &GyroSample) -> Option<BusOutput> {
        if !self.gyro.is_there {
            return None;
        }
        self.has_own_gyro = true;
        Some(self.tell_gyro(sample))
    }

    /// Does what is due at `now`. To be called at least every 5 ms; a pose that is late is left out, the next one is for its
    /// own time.
    pub fn poll(&mut self, now: Time, laser: LaserHealth, mut take: impl FnMut(BusOutput)) {
        let Self { encoders, predictor, progress, faults, .. } = self;
        encoders.poll(now, |output| match output {
            EncoderOutput::Send(frame) => take(BusOutput::Send(frame)),
            EncoderOutput::Event(event) => {
                if let BusEvent::EncoderFaults(found) = &event {
                    *faults = *found;
                    predictor.doubt_encoders(found);
                }
                take(BusOutput::Event(progress.tell(event)));
            }
        });
        self.laser = laser;
        self.report_state(now);
        while let Some(frame) = self.node.poll(now) {
            take(BusOutput::Send(frame));
        }
        if self.node.is_publishing(now) {
            self.publish(now, take);
        }
    }

    fn publish(&mut self, now: Time, mut take: impl FnMut(BusOutput)) {
        let Some(process) = self.process() else { return };
        let frames = self.node.publish(now, &process);
        if frames.is_empty() {
            return;
        }
        frames.iter().for_each(|frame| take(BusOutput::Send(*frame)));
        take(BusOutput::Published(SentPose { pose: process.pose, progress: self.progress }));
    }

    /// Pose and state for now. None before the localiser has said anything.
    fn process(&self) -> Option<ProcessData> {
        let EncoderFaults { drive, steering, .. } = self.faults;
        let health = Health { drive, steering, laser: self.laser, start_search: self.relocalization };
        Some(ProcessData { pose: self.predictor.output()?, health, limits: self.limits })
    }

    /// Says what is wrong with encoders, laser and pose.
    fn report_state(&mut self, now: Time) {
        let are_set_up = now.since(self.start) > SETTING_UP;
        for (kind, is_there, which) in [
            (ErrorKind::Laser, matches!(self.laser, LaserHealth::Silent | LaserHealth::Faulty), 0),
            (ErrorKind::DriveEncoder, are_set_up && self.faults.drive.is_some(), self.encoders.faulty(Counted::Turn)),
            (
                ErrorKind::SteeringEncoder,
                are_set_up && self.faults.steering.is_some(),
                self.encoders.faulty(Counted::Steering),
            ),
            (ErrorKind::Lost, self.is_lost, 0),
        ] {
            if is_there {
                self.node.report_of(kind, which, now);
            }
        }
    }

    /// What wires are to say at `now`.
    #[must_use]
    pub fn discrete_report(&self, now: Time) -> DiscreteReport {
        let pose = self.predictor.output();
        DiscreteReport::of(pose.as_ref(), &self.limits, self.node.error_register(), self.deadline, now)
    }

    /// Takes what wires say at `now`. A reset forgets the errors that were, as 0 written to 1003h does; those that are there stay.
    pub fn hear_lines(&mut self, inputs: &DiscreteInputs, now: Time) {
        if inputs.is_standing {
            self.encoders.hear_standstill(now);
        }
        if inputs.is_reset {
            self.node.forget_errors();
        }
        if inputs.failed != 0 {
            self.node.report_of(ErrorKind::DiscreteLine, inputs.failed, now);
        }
    }

    /// Something is wrong that only the board can know.
    pub fn report(&mut self, kind: ErrorKind, now: Time) {
        self.node.report(kind, now);
    }

    /// Identifiers of the frames that mean something here though no node of [`Self::nodes`] says them.
    #[must_use]
    pub fn other_frames(&self) -> Vec<Id, OTHERS> {
        let mut others = Vec::new();
        // Not by value: the end of such an iterator is not seen to be without panic.
        self.encoders.own_frames().iter().for_each(|id| add(&mut others, Some(*id)));
        add(&mut others, self.gyro.id());
        others
    }

    /// The nodes whose frames mean something here: the controller, its encoders, and those whose heartbeats are watched.
    #[must_use]
    pub fn nodes(&self) -> Vec<NodeId, NODES> {
        let encoders = self.nodes.encoders.iter().take(self.encoders.count());
        let mut nodes = Vec::new();
        for node in core::iter::once(&self.nodes.controller).chain(encoders).chain(&self.node.watched()) {
            // There is room for all.
            let _ = nodes.push(*node);
        }
        nodes
    }

    /// The pose for now. None before the localiser has said anything.
    #[must_use]
    pub fn output(&self) -> Option<PoseOutput> {
        self.predictor.output()
    }

    /// Whether the vehicle stands: see [`Standstill::stands`].
    #[must_use]
    pub fn is_standing(&self, now: Time) -> bool {
        self.standstill.stands(now)
    }
}
