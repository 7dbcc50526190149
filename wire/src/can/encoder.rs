//! One encoder of the profile CiA 406, as the master of its network sees it.
//!
//! The master resets the node, waits for its boot-up message, reads what it is, tells it when to report, starts it, and
//! then takes positions from its first transmit PDO, or reads them one by one if the node sends none. A node that boots
//! again is set up again. Objects and their meanings are those of CiA 301 and CiA 406; devices may lack most of them, so
//! only the measuring range is indispensable.

use super::canopen::{Message, NodeId, transmit_pdo_id};
use super::drive_402;
use super::emcy::Emergency;
use super::frame::{Frame, Id, extended_id, standard_id};
use super::nmt::{HeartbeatConsumer, NmtCommand, NmtState};
use super::pdo::{MappingEntry, PdoMapping};
use super::report_clock::ReportClock;
use super::sdo::{Object, Request, Response, SdoClient, TransferError, Value};
use agv_core::measurement::Time;
use agv_core::odometry::CounterRange;

/// Objects of an encoder.
pub mod object {
    use super::Object;

    /// Time between heartbeats, ms, 16 bits.
    pub const HEARTBEAT_TIME: Object = Object::new(0x1017, 0);
    /// Identifier of the first transmit PDO, 32 bits; bit 31: the PDO is off, bit 29: the identifier has 29 bits.
    pub const PDO_ID: Object = Object::new(0x1800, 1);
    /// Transmission type of the first transmit PDO, 8 bits: 1 at every SYNC, 254 by the event timer.
    pub const PDO_TRANSMISSION: Object = Object::new(0x1800, 2);
    /// Shortest time between two of these PDOs, 100 us, 16 bits.
    pub const PDO_INHIBIT_TIME: Object = Object::new(0x1800, 3);
    /// Longest time between two of these PDOs, ms, 16 bits.
    pub const PDO_EVENT_TIMER: Object = Object::new(0x1800, 5);
    /// How many objects the first transmit PDO holds, 8 bits.
    pub const PDO_MAPPING: Object = Object::new(0x1A00, 0);
    /// How it counts, 16 bits: bit 0 the code sequence, bit 2 whether it is scaled by the two objects that follow.
    pub const OPERATING_PARAMETERS: Object = Object::new(0x6000, 0);
    /// Steps of a revolution, 32 bits.
    pub const UNITS_PER_REVOLUTION: Object = Object::new(0x6001, 0);
    /// Number of positions, 32 bits.
    pub const MEASURING_RANGE: Object = Object::new(0x6002, 0);
    /// Position, 32 bits.
    pub const POSITION: Object = Object::new(0x6004, 0);
    /// Speed, 16 bits, in the device's own unit.
    pub const SPEED: Object = Object::new(0x6030, 1);
    /// Time between positions, ms, 16 bits; the older place of the event timer.
    pub const CYCLIC_TIMER: Object = Object::new(0x6200, 0);
    /// Physical steps of a revolution, 32 bits.
    pub const SINGLE_TURN_RESOLUTION: Object = Object::new(0x6501, 0);
    /// Physical revolutions that are told apart, 16 bits.
    pub const REVOLUTIONS: Object = Object::new(0x6502, 0);
}

/// When the encoder tells its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reporting {
    /// By itself, every so many ms.
    Timer {
        /// Time between positions, ms.
        period: u16,
    },
    /// At every SYNC.
    Synchronous,
    /// When it is asked, so often.
    Polled {
        /// Time between questions, ms.
        period: u16,
    },
}

/// Which way the counter goes, seen towards the shaft (CiA 406, 6000h bit 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeSequence {
    /// It rises while the shaft turns clockwise.
    RisingClockwise,
    /// It falls then.
    FallingClockwise,
}

impl CodeSequence {
    const fn of(operating_parameters: u32) -> Self {
        if operating_parameters & 1 == 0 { Self::RisingClockwise } else { Self::FallingClockwise }
    }
}

/// Bit of 6000h that says that the position is scaled by 6001h and 6002h.
const IS_SCALED: u32 = 1 << 2;

/// What tells the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// An encoder of CiA 406.
    Encoder,
    /// A drive of CiA 402, which is only listened to: see [`drive_402`].
    Drive,
}

impl Profile {
    /// The position, 32 bits.
    const fn position(self) -> Object {
        match self {
            Self::Encoder => object::POSITION,
            Self::Drive => drive_402::POSITION,
        }
    }
}

/// What the master knows of an encoder beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderSettings {
    /// Its node.
    pub node: NodeId,
    /// What it is.
    pub profile: Profile,
    /// When it shall report.
    pub reporting: Reporting,
    /// Time between heartbeats that it shall keep, ms; 0 leaves it as it is.
    pub heartbeat: u16,
    /// How long it may think about an answer, s.
    pub answer_timeout: f64,
    /// The range that its counter is read with, if it is known. A node that tells another one is set up nevertheless:
    /// see [`Identity::tells_other_range`].
    pub range: Option<CounterRange>,
    /// Which way it shall count, if that is known. A node that tells another one is set up nevertheless: see
    /// [`Identity::tells_other_direction`].
    pub code_sequence: Option<CodeSequence>,
    /// Whether this is the node's master. If another one is, nothing is sent to it, and what it sends is taken as the profile
    /// has it, in the PDO with the predefined identifier: of an encoder the position alone, 32 bits, in the first.
    pub is_managed: bool,
}

impl EncoderSettings {
    /// Whether this is the node's master: drives are only listened to.
    #[must_use]
    pub fn has_master(&self) -> bool {
        self.is_managed && self.profile == Profile::Encoder
    }

    /// A node that reports every 10 ms, with a heartbeat every 100 ms and 50 ms for each answer.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Self {
            node,
            profile: Profile::Encoder,
            reporting: Reporting::Timer { period: 10 },
            heartbeat: 100,
            answer_timeout: 0.05,
            range: None,
            code_sequence: None,
            is_managed: true,
        }
    }
}

/// What an encoder says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Number of positions.
    pub range: CounterRange,
    /// Steps of a revolution, if it tells.
    pub units_per_revolution: Option<u32>,
    /// Physical steps of a revolution, if it tells.
    pub single_turn_resolution: Option<u32>,
    /// Physical revolutions that are told apart, if it tells.
    pub revolutions: Option<u32>,
    /// Identifier of its PDO, if it has one with the position in it.
    pub pdo_id: Option<Id>,
    /// What stands in that PDO.
    pub mapping: PdoMapping,
    /// How many settings it did not take.
    pub refused_settings: u8,
    /// Whether it took the timer and the transmission type that obeys it. Without them it reports as it likes.
    pub keeps_timer: bool,
    /// Whether it tells another range than the one in its settings, so that its counter wraps elsewhere.
    pub tells_other_range: bool,
    /// What it says of how it counts, if it does.
    pub operating_parameters: Option<u32>,
    /// Whether it tells another direction than the one in its settings.
    pub tells_other_direction: bool,
}

impl Identity {
    /// The number of positions, or the largest one if that has 33 bits, of an encoder that says that it is not scaled. What
    /// 6001h and 6002h hold then has no effect.
    fn physical_range(&self) -> Option<u32> {
        if self.operating_parameters? & IS_SCALED != 0 {
            return None;
        }
        let values = u64::from(self.single_turn_resolution?) * u64::from(self.revolutions?);
        u32::try_from(values.min(u64::from(u32::MAX))).ok().filter(|values| *values > 0)
    }
}

/// Why an encoder could not be set up. The master tries again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetupError {
    /// It has not answered.
    NoAnswer,
    /// It tells no range that makes sense, and none was given.
    NoRange,
}

/// Where the master is with an encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderState {
    /// It has not been heard yet.
    WaitingForBootUp,
    /// It is being asked what it is and told when to report.
    SettingUp,
    /// It sends positions.
    Reporting,
    /// It is asked for each position.
    Polled,
}

/// One position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderReading {
    /// When it was true.
    pub time: Time,
    /// The counter, ticks.
    pub position: u32,
    /// Speed in the device's own unit, if it is in the PDO.
    pub speed: Option<i16>,
}

/// What a frame meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderEvent {
    /// A position.
    Reading(EncoderReading),
    /// It has booted and will be set up.
    BootedUp,
    /// It is set up and has been told to report; see [`Encoder::identity`].
    Started,
    /// It reports an error, or the end of one.
    Emergency(Emergency),
    /// It could not be set up.
    SetupFailed(SetupError),
}

/// Time from a reset to the next one if the node does not boot, s.
const BOOT_TIME: f64 = 1.0;
/// A started node whose PDO does not come within this time is asked instead, s.
const PDO_PATIENCE: f64 = 0.25;
/// Heartbeats may be late by this factor.
const HEARTBEAT_TOLERANCE: f64 = 2.5;

/// What is asked or told next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    ReadOperation,
    ReadUnits,
    ReadResolution,
    ReadRevolutions,
    ReadRange,
    ReadPdoId,
    ReadMappingLength,
    ReadMapping { sub: u8, length: u8 },
    WriteTransmission,
    WriteInhibitTime,
    WriteEventTimer,
    WriteCyclicTimer,
    WriteHeartbeat,
}

impl Step {
    const fn is_write(self) -> bool {
        matches!(
            self,
            Self::WriteTransmission
                | Self::WriteInhibitTime
                | Self::WriteEventTimer
                | Self::WriteCyclicTimer
                | Self::WriteHeartbeat
        )
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Waiting { next_reset: Time },
    Setup(Step),
    Reporting { since: Time, has_reported: bool },
    Polled { next: Time },
}

/// The master's view of one encoder.
#[derive(Clone, Debug)]
pub struct Encoder {
    settings: EncoderSettings,
    phase: Phase,
    client: SdoClient,
    /// A command that is to be sent.
    command: Option<NmtCommand>,
    heartbeat: HeartbeatConsumer,
    identity: Identity,
    last_sync: Option<Time>,
    reports: ReportClock,
    error: Option<SetupError>,
}

impl Encoder {
    /// An encoder that has not been heard; its reset is due at `start`.
    #[must_use]
    pub fn new(settings: EncoderSettings, start: Time) -> Self {
        let settings = EncoderSettings { is_managed: settings.has_master(), ..settings };
        let mut identity = Identity {
            range: settings.range.unwrap_or(CounterRange::BITS_32),
            units_per_revolution: None,
            single_turn_resolution: None,
            revolutions: None,
            pdo_id: None,
            mapping: PdoMapping::new(),
            refused_settings: 0,
            keeps_timer: !settings.is_managed,
            tells_other_range: false,
            operating_parameters: None,
            tells_other_direction: false,
        };
        if !settings.is_managed {
            let (number, mapping) = overheard(settings.profile);
            identity.pdo_id = Some(transmit_pdo_id(settings.node, number));
            identity.mapping = mapping;
        }
        Self {
            settings,
            phase: if settings.is_managed {
                Phase::Waiting { next_reset: start }
            } else {
                Phase::Reporting { since: start, has_reported: true }
            },
            client: SdoClient::new(settings.node, settings.answer_timeout),
            command: None,
            heartbeat: HeartbeatConsumer::new(f64::from(settings.heartbeat) * 1e-3 * HEARTBEAT_TOLERANCE),
            identity,
            last_sync: None,
            reports: ReportClock::new(match settings.reporting {
                Reporting::Timer { period } => f64::from(period) * 1e-3,
                _ => 0.0,
            }),
            error: None,
        }
    }

    /// Where the master is with the encoder.
    #[must_use]
    pub const fn state(&self) -> EncoderState {
        match self.phase {
            Phase::Waiting { .. } => EncoderState::WaitingForBootUp,
            Phase::Setup(_) => EncoderState::SettingUp,
            Phase::Reporting { .. } => EncoderState::Reporting,
            Phase::Polled { .. } => EncoderState::Polled,
        }
    }

    /// What the encoder said of itself. None before it was set up.
    #[must_use]
    pub const fn identity(&self) -> Option<&Identity> {
        match self.phase {
            Phase::Reporting { .. } | Phase::Polled { .. } => Some(&self.identity),
            _ => None,
        }
    }

    /// Why the last attempt to set it up failed; none after a success.
    #[must_use]
    pub const fn setup_error(&self) -> Option<SetupError> {
        self.error
    }

    /// Its node.
    #[must_use]
    pub const fn node(&self) -> NodeId {
        self.settings.node
    }

    /// Whether heartbeats were asked for, came, and come no more.
    #[must_use]
    pub fn is_heartbeat_lost(&self, now: Time) -> bool {
        self.settings.heartbeat > 0 && self.identity().is_some() && self.heartbeat.is_lost(now)
    }

    /// A SYNC was sent: synchronous positions that come next are true at this time.
    pub fn note_sync(&mut self, time: Time) {
        self.last_sync = Some(time);
    }

    /// Takes a frame that was received at `time`; frames of others are left alone.
    pub fn handle(&mut self, frame: &Frame, time: Time) -> Option<EncoderEvent> {
        if let Some(reading) = self.pdo(frame, time) {
            return Some(EncoderEvent::Reading(reading));
        }
        match Message::decode(frame) {
            Ok(Message::Sync { .. }) => {
                self.note_sync(time);
                None
            }
            Ok(Message::Heartbeat { node, state }) if node == self.settings.node => self.heartbeat(state, time),
            Ok(Message::Emergency { node, emergency }) if node == self.settings.node => {
                Some(EncoderEvent::Emergency(emergency))
            }
            Ok(Message::SdoResponse { node, bytes }) if node == self.settings.node => {
                let response = Response::decode(bytes).ok()?;
                let asked = self.client.sent();
                let result = self.client.handle(&response)?;
                self.answered(result, asked, time)
            }
            _ => None,
        }
    }

    /// The next frame to send, or what the passing of time meant. Call until both are none.
    pub fn poll(&mut self, now: Time) -> (Option<Frame>, Option<EncoderEvent>) {
        if let Some(command) = self.command.take() {
            return (Some(self.command(command)), None);
        }
        match self.phase {
            Phase::Waiting { next_reset } if now >= next_reset => {
                self.phase = Phase::Waiting { next_reset: now.offset(BOOT_TIME) };
                return (Some(self.command(NmtCommand::ResetCommunication)), None);
            }
            Phase::Waiting { .. } => return (None, None),
            Phase::Setup(step) => {
                if self.client.is_idle() {
                    self.client.begin(self.request(step));
                }
            }
            Phase::Reporting { since, has_reported: false } if now.since(since) > PDO_PATIENCE => {
                self.phase = Phase::Polled { next: now };
            }
            Phase::Reporting { .. } => {}
            Phase::Polled { next } => {
                if now >= next && self.client.is_idle() {
                    let period = f64::from(match self.settings.reporting {
                        Reporting::Timer { period } | Reporting::Polled { period } => period.max(1),
                        Reporting::Synchronous => 10,
                    });
                    self.client.begin(Request::Read(object::POSITION));
                    self.phase = Phase::Polled { next: now.offset(period * 1e-3) };
                }
            }
        }
        match self.client.poll(now) {
            Ok(frame) => (frame, None),
            Err(_) => (None, self.fail(SetupError::NoAnswer, now)),
        }
    }

    fn pdo(&mut self, frame: &Frame, time: Time) -> Option<EncoderReading> {
        let Phase::Reporting { .. } = self.phase else { return None };
        if Some(frame.id()) != self.identity.pdo_id || frame.is_remote() {
            return None;
        }
        let position = self.identity.mapping.extract(self.settings.profile.position(), frame.data())? as u32;
        let speed = self.identity.mapping.extract(object::SPEED, frame.data()).map(|speed| speed as i16);
        if let Phase::Reporting { has_reported, .. } = &mut self.phase {
            *has_reported = true;
        }
        let time = match (self.settings.reporting, self.last_sync) {
            (Reporting::Synchronous, Some(sync)) => sync,
            (Reporting::Timer { .. }, _) if self.identity.keeps_timer => self.reports.time(time),
            _ => time,
        };
        Some(EncoderReading { time, position, speed })
    }

    fn heartbeat(&mut self, state: NmtState, time: Time) -> Option<EncoderEvent> {
        // A boot-up message is no promise of heartbeats.
        if state == NmtState::BootUp {
            self.heartbeat.forget();
        } else {
            self.heartbeat.hear(time);
        }
        match (state, self.phase) {
            (NmtState::BootUp, _) if !self.settings.is_managed => {
                self.reports.restart();
                Some(EncoderEvent::BootedUp)
            }
            (_, _) if !self.settings.is_managed => None,
            (NmtState::BootUp, _) => {
                self.begin_setup();
                Some(EncoderEvent::BootedUp)
            }
            // The node was there already and takes no reset.
            (_, Phase::Waiting { .. }) => {
                self.begin_setup();
                None
            }
            (NmtState::PreOperational | NmtState::Stopped, Phase::Reporting { .. } | Phase::Polled { .. }) => {
                self.command = Some(NmtCommand::Start);
                None
            }
            _ => None,
        }
    }

    fn begin_setup(&mut self) {
        self.client.cancel();
        self.command = None;
        self.identity.pdo_id = None;
        self.identity.mapping = PdoMapping::new();
        self.identity.refused_settings = 0;
        self.identity.keeps_timer = false;
        self.phase = Phase::Setup(Step::ReadOperation);
    }

    fn fail(&mut self, error: SetupError, now: Time) -> Option<EncoderEvent> {
        self.client.cancel();
        self.phase = Phase::Waiting { next_reset: now.offset(BOOT_TIME) };
        self.error = Some(error);
        Some(EncoderEvent::SetupFailed(error))
    }

    fn request(&self, step: Step) -> Request {
        let synchronous = self.settings.reporting == Reporting::Synchronous;
        let period = match self.settings.reporting {
            Reporting::Timer { period } => period,
            _ => 0,
        };
        match step {
            Step::ReadOperation => Request::Read(object::OPERATING_PARAMETERS),
            Step::ReadUnits => Request::Read(object::UNITS_PER_REVOLUTION),
            Step::ReadRange => Request::Read(object::MEASURING_RANGE),
            Step::ReadResolution => Request::Read(object::SINGLE_TURN_RESOLUTION),
            Step::ReadRevolutions => Request::Read(object::REVOLUTIONS),
            Step::ReadPdoId => Request::Read(object::PDO_ID),
            Step::ReadMappingLength => Request::Read(object::PDO_MAPPING),
            Step::ReadMapping { sub, .. } => Request::Read(Object::new(object::PDO_MAPPING.index, sub)),
            Step::WriteTransmission => {
                Request::Write(object::PDO_TRANSMISSION, Value::from(if synchronous { 1u8 } else { 254 }))
            }
            // A changing position can send frames faster than the timer alone; the inhibit time holds them back.
            Step::WriteInhibitTime => Request::Write(object::PDO_INHIBIT_TIME, Value::from(period.saturating_mul(10))),
            Step::WriteEventTimer => Request::Write(object::PDO_EVENT_TIMER, Value::from(period)),
            Step::WriteCyclicTimer => Request::Write(object::CYCLIC_TIMER, Value::from(period)),
            Step::WriteHeartbeat => Request::Write(object::HEARTBEAT_TIME, Value::from(self.settings.heartbeat)),
        }
    }

    fn answered(
        &mut self,
        result: Result<Option<Value>, TransferError>,
        asked: Option<Time>,
        time: Time,
    ) -> Option<EncoderEvent> {
        let value = result.ok().flatten().map(Value::unsigned);
        match self.phase {
            Phase::Setup(step) => match self.after(step, value, result.is_ok()) {
                Ok(Some(next)) => {
                    self.phase = Phase::Setup(next);
                    None
                }
                Ok(None) => Some(self.start(time)),
                Err(error) => self.fail(error, time),
            },
            Phase::Polled { .. } => {
                let position = value?;
                // The node read its counter somewhere between question and answer.
                let time = asked.map_or(time, |asked| asked.offset(0.5 * time.since(asked)));
                Some(EncoderEvent::Reading(EncoderReading { time, position, speed: None }))
            }
            _ => None,
        }
    }

    fn command(&self, command: NmtCommand) -> Frame {
        Message::Nmt { command, node: Some(self.settings.node) }.encode()
    }

    /// Takes the answer of a step; gives the next one, or none if it was the last.
    fn after(&mut self, step: Step, value: Option<u32>, is_ok: bool) -> Result<Option<Step>, SetupError> {
        if step.is_write() {
            return Ok(self.after_write(step, is_ok));
        }
        let identity = &mut self.identity;
        Ok(Some(match step {
            Step::ReadOperation => {
                identity.operating_parameters = value;
                let sequence = value.map(CodeSequence::of);
                identity.tells_other_direction =
                    sequence.is_some() && self.settings.code_sequence.is_some_and(|set| sequence != Some(set));
                Step::ReadUnits
            }
            Step::ReadUnits => {
                identity.units_per_revolution = value;
                Step::ReadResolution
            }
            Step::ReadResolution => {
                identity.single_turn_resolution = value;
                Step::ReadRevolutions
            }
            Step::ReadRevolutions => {
                identity.revolutions = value;
                Step::ReadRange
            }
            Step::ReadRange => {
                let told = identity.physical_range().or(value);
                identity.range = self.settings.range.or(told.and_then(range_of)).ok_or(SetupError::NoRange)?;
                identity.tells_other_range = told.is_some_and(|told| told != 0 && !is_range(told, identity.range));
                if let Reporting::Polled { .. } = self.settings.reporting {
                    return Ok(self.write_heartbeat());
                }
                Step::ReadPdoId
            }
            Step::ReadPdoId => {
                identity.pdo_id = match value {
                    Some(id) if id >> 31 != 0 => None,
                    Some(id) if id & 1 << 29 != 0 => Some(extended_id(id)),
                    Some(id) => Some(standard_id(id as u16)),
                    None => Some(transmit_pdo_id(self.settings.node, 1)),
                };
                Step::ReadMappingLength
            }
            Step::ReadMappingLength => match value {
                Some(length @ 1..=8) => Step::ReadMapping { sub: 1, length: length as u8 },
                Some(_) => {
                    identity.pdo_id = None;
                    Step::WriteTransmission
                }
                // The default of the profile.
                None => {
                    identity.mapping.push(MappingEntry { object: object::POSITION, bits: 32 });
                    Step::WriteTransmission
                }
            },
            Step::ReadMapping { sub, length } => {
                let is_added = value.is_some_and(|entry| identity.mapping.push(MappingEntry::decode(entry)));
                if is_added && sub < length {
                    return Ok(Some(Step::ReadMapping { sub: sub + 1, length }));
                }
                if !identity.mapping.contains(object::POSITION) {
                    identity.pdo_id = None;
                    return Ok(self.write_heartbeat());
                }
                Step::WriteTransmission
            }
            _ => return Ok(None),
        }))
    }

    /// The same for a step that writes.
    fn after_write(&mut self, step: Step, is_ok: bool) -> Option<Step> {
        let identity = &mut self.identity;
        // The event timer may be kept elsewhere.
        if !matches!(step, Step::WriteEventTimer) {
            identity.refused_settings += u8::from(!is_ok);
        }
        match step {
            Step::WriteTransmission => {
                identity.keeps_timer = is_ok;
                if self.settings.reporting == Reporting::Synchronous {
                    return self.write_heartbeat();
                }
                Some(Step::WriteInhibitTime)
            }
            Step::WriteInhibitTime => Some(Step::WriteEventTimer),
            Step::WriteEventTimer if !is_ok => Some(Step::WriteCyclicTimer),
            Step::WriteEventTimer => self.write_heartbeat(),
            Step::WriteCyclicTimer => {
                identity.keeps_timer &= is_ok;
                self.write_heartbeat()
            }
            _ => None,
        }
    }

    /// The last step, unless the heartbeat is left as it is.
    fn write_heartbeat(&self) -> Option<Step> {
        (self.settings.heartbeat > 0).then_some(Step::WriteHeartbeat)
    }

    fn start(&mut self, now: Time) -> EncoderEvent {
        self.error = None;
        self.reports.restart();
        self.command = Some(NmtCommand::Start);
        self.phase = if self.identity.pdo_id.is_some() {
            Phase::Reporting { since: now, has_reported: false }
        } else {
            Phase::Polled { next: now }
        };
        EncoderEvent::Started
    }
}

/// The PDO of a node that another master has set up, and what stands in it, as the profile has them.
fn overheard(profile: Profile) -> (u8, PdoMapping) {
    match profile {
        Profile::Encoder => {
            let mut mapping = PdoMapping::new();
            mapping.push(MappingEntry { object: object::POSITION, bits: 32 });
            (1, mapping)
        }
        Profile::Drive => (drive_402::POSITION_PDO, drive_402::position_mapping()),
    }
}

/// Whether 6002h tells that range, as the number of positions or as the largest one.
fn is_range(told: u32, range: CounterRange) -> bool {
    matches!(range.values().checked_sub(u64::from(told)), Some(0 | 1))
}

/// The range that 6002h tells. Many devices tell the largest position instead of the number of positions: all bits one.
fn range_of(value: u32) -> Option<CounterRange> {
    let value = u64::from(value);
    CounterRange::new(if (value + 1).is_power_of_two() { value + 1 } else { value })
}
