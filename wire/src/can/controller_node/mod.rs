//! The controller as a node of a CANopen bus: boot-up, heartbeat, NMT, its object dictionary, its PDOs and emergencies, as
//! `docs/agv.eds` has them.
//!
//! | concept | module |
//! |---|---|
//! | which objects there are | [`dictionary`] |
//! | their values | `objects` |
//! | pose and state as objects | [`ProcessData`] |
//! | what can be stored of how it speaks | [`CommunicationParameters`] |
//! | when a PDO goes out, and what is in it | `transmit_pdo` |
//! | errors, their ends and their history | [`ErrorKind`] |
//! | heartbeats of others | `consumers` |

mod consumers;
pub mod dictionary;
mod errors;
mod objects;
mod parameters;
mod process;
mod transmit_pdo;

use agv_core::measurement::Time;
use heapless::Vec;

use super::canopen::{Message, NodeId};
use super::frame::{Frame, standard_id};
use super::nmt::{NmtCommand, NmtState};
use super::sdo::{self, AbortCode, Object, ObjectDictionary, SdoServer, ValueBytes};

pub use consumers::CONSUMERS;
pub use errors::{ErrorKind, HISTORY, HOLD};
pub use objects::{FIRST_SETTING, HEARTBEAT_TIME, Permission};
pub use parameters::{CommunicationParameters, PARAMETER_BYTES};
pub use process::ProcessData;

use errors::Errors;
use objects::{Objects, STORE, Served, TRANSMIT_PDOS};

/// Highest value of the telegrams' counter.
const LAST_COUNT: u8 = 15;

/// Time between poses on the bus if nothing else is set, ms.
pub const PUBLISHING_PERIOD: u16 = 10;

/// What is set of the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeSettings {
    /// Its number.
    pub node: NodeId,
    /// Who has made the vehicle's controller, as CAN in Automation numbers makers; 0 for nobody (1018h, subindex 1).
    pub vendor: u32,
    /// Whether it is the NMT master of the encoders (bit 0 of 1F80h).
    pub is_master: bool,
    /// Whether it becomes operational without being told to (bit 2 of 1F80h is 0 then).
    pub starts_itself: bool,
    /// Time between poses, ms: the event timer of the PDOs when it starts.
    pub period: u16,
    /// What the controller is (1009h).
    pub hardware: &'static str,
    /// What runs on it (100Ah).
    pub software: &'static str,
    /// Which of all controllers it is; 0 if nobody knows (1018h, subindex 4).
    pub serial: u32,
    /// The map that it has.
    pub map: CarriedMap,
    /// What a master has had stored of how it speaks.
    pub stored: Option<CommunicationParameters>,
}

/// What a controller says of its map (2014h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CarriedMap {
    /// Which one it is; 0 for none.
    pub identity: u32,
    /// How many landmarks it has.
    pub landmarks: u16,
}

impl NodeSettings {
    /// A master without a maker that becomes operational by itself and says its pose every 10 ms.
    #[must_use]
    pub const fn new(node: NodeId) -> Self {
        Self {
            node,
            vendor: 0,
            is_master: true,
            starts_itself: true,
            period: PUBLISHING_PERIOD,
            hardware: "",
            software: concat!("agv ", env!("CARGO_PKG_VERSION")),
            serial: 0,
            map: CarriedMap { identity: 0, landmarks: 0 },
            stored: None,
        }
    }
}

/// A node that serves no settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct WithoutSettings;

impl ObjectDictionary for WithoutSettings {
    fn read(&self, _: Object) -> Result<ValueBytes, AbortCode> {
        Err(AbortCode::NoSuchObject)
    }

    fn writable(&self, _: Object) -> Result<usize, AbortCode> {
        Err(AbortCode::NoSuchObject)
    }

    fn write(&mut self, _: Object, _: &[u8]) -> Result<(), AbortCode> {
        Err(AbortCode::NoSuchObject)
    }
}

/// Something that is being stored.
#[derive(Clone, Copy, Debug)]
struct Saving {
    parameters: CommunicationParameters,
    /// What is answered when it is stored, unless the master has given up.
    answer: Option<[u8; 8]>,
}

/// The controller as a node.
#[derive(Clone, Debug)]
pub struct ControllerNode {
    objects: Objects,
    server: SdoServer,
    saving: Option<Saving>,
    has_booted: bool,
    next_heartbeat: Time,
}

impl ControllerNode {
    /// A node that was just switched on.
    #[must_use]
    pub fn new(settings: NodeSettings, now: Time) -> Self {
        Self {
            objects: Objects::new(settings, Errors::new(), now),
            server: SdoServer::new(),
            saving: None,
            has_booted: false,
            next_heartbeat: now,
        }
    }

    /// Whether PDOs are sent and heard.
    #[must_use]
    pub fn is_operational(&self) -> bool {
        self.has_booted && self.objects.state == NmtState::Operational
    }

    /// Whether the node looks at the pose to answer a frame.
    #[must_use]
    pub fn is_asked(&self, frame: &Frame) -> bool {
        matches!(Message::decode(frame), Ok(Message::SdoRequest { node, .. }) if node == self.objects.settings.node)
    }

    /// Whether a frame is an order in a PDO, which is taken in operational only.
    #[must_use]
    pub fn is_order(&self, frame: &Frame) -> bool {
        matches!(Message::decode(frame), Ok(Message::ReceivePdo { node, .. }) if node == self.objects.settings.node)
    }

    /// An order that a master has written to an object instead of sending a PDO, as the frame that it stands for.
    pub fn take_order(&mut self) -> Option<Frame> {
        self.objects.order.take()
    }

    /// What is to be stored beside the settings, if a master has asked for it since the last call (1010h). It is told of it by what
    /// [`Self::saved`] returns, which must be called then.
    pub fn take_save(&mut self) -> Option<CommunicationParameters> {
        let is_asked = core::mem::take(&mut self.objects.is_save_asked);
        self.saving.filter(|_| is_asked).map(|saving| saving.parameters)
    }

    /// Settings and parameters are stored, or could not be: what the master is told, which has waited for it (CiA 301, 7.5.2.13).
    pub fn saved(&mut self, is_stored: bool) -> Option<Frame> {
        let Saving { parameters, answer } = self.saving.take()?;
        if is_stored {
            self.objects.settings.stored = Some(parameters);
        }
        let answer = answer?;
        let bytes = if is_stored { answer } else { sdo::abort(STORE, AbortCode::Hardware) };
        Some(Message::SdoResponse { node: self.objects.settings.node, bytes }.encode())
    }

    /// There is something wrong at `now`. What lasts is to be said again at least every [`HOLD`] seconds.
    pub fn report(&mut self, kind: ErrorKind, now: Time) {
        self.report_of(kind, 0, now);
    }

    /// The same, of those of several parts whose bits are set.
    pub fn report_of(&mut self, kind: ErrorKind, parts: u8, now: Time) {
        self.objects.errors.report(kind, parts, now);
    }

    /// What is wrong, all together (1001h).
    #[must_use]
    pub fn error_register(&self) -> u8 {
        self.objects.errors.register()
    }

    /// Forgets what was wrong, as 0 written to 1003h does.
    pub fn forget_errors(&mut self) {
        self.objects.errors.clear_history();
    }

    /// Nodes whose heartbeats are watched.
    #[must_use]
    pub fn watched(&self) -> Vec<NodeId, CONSUMERS> {
        self.objects.consumers.nodes()
    }

    /// The next frame that is due by itself: boot-up, heartbeat, emergency. Call until there is none.
    pub fn poll(&mut self, now: Time) -> Option<Frame> {
        let node = self.objects.settings.node;
        if !self.has_booted {
            self.has_booted = true;
            self.next_heartbeat = now;
            return Some(Message::Heartbeat { node, state: NmtState::BootUp }.encode());
        }
        if self.objects.heartbeat_time > 0 && now >= self.next_heartbeat {
            let period = f64::from(self.objects.heartbeat_time) * 1e-3;
            let following = self.next_heartbeat.offset(period);
            self.next_heartbeat = if following <= now { now.offset(period) } else { following };
            return Some(Message::Heartbeat { node, state: self.objects.state }.encode());
        }
        if self.objects.consumers.is_any_lost(now) {
            self.report(ErrorKind::HeartbeatLost, now);
        }
        if self.objects.state == NmtState::Stopped {
            return None;
        }
        // One that nobody wants is remembered all the same.
        while let Some(emergency) = self.objects.errors.poll(now) {
            if let Some(id) = self.objects.emergency_id() {
                return Some(Frame::of(standard_id(id), emergency.encode()));
            }
        }
        None
    }

    /// Takes a frame; gives the answer, if there is one. Without a pose its objects have no value; without permission settings
    /// are only read.
    pub fn handle(
        &mut self,
        frame: &Frame,
        now: Time,
        process: Option<&ProcessData>,
        settings: &mut impl ObjectDictionary,
        permission: Permission,
    ) -> Option<Frame> {
        let own = self.objects.settings.node;
        match Message::decode(frame).ok()? {
            Message::Nmt { command, node } if node.is_none_or(|node| node == own) => {
                self.obey(command, now);
                None
            }
            Message::Sync { .. } if self.is_operational() => {
                self.objects.pdos.iter_mut().for_each(transmit_pdo::TransmitPdo::note_sync);
                None
            }
            Message::Heartbeat { node, state } => {
                self.objects.consumers.hear(node, state, now);
                None
            }
            Message::SdoRequest { node, bytes } if node == own && self.objects.state != NmtState::Stopped => {
                if let Some(saving) = &mut self.saving {
                    return answer_meanwhile(saving, bytes).map(|bytes| Message::SdoResponse { node, bytes }.encode());
                }
                let Self { objects, server, .. } = self;
                let before = objects.heartbeat_time;
                let bytes = server.answer(&mut Served { objects, process, settings, permission, now }, bytes)?;
                if objects.heartbeat_time != before {
                    self.next_heartbeat = now.offset(f64::from(objects.heartbeat_time) * 1e-3);
                }
                if objects.is_save_asked {
                    self.saving = Some(Saving { parameters: objects.parameters(), answer: Some(bytes) });
                    return None;
                }
                Some(Message::SdoResponse { node, bytes }.encode())
            }
            _ => None,
        }
    }

    /// The value of an object, as a master would be told.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub fn read(
        &mut self,
        object: Object,
        process: Option<&ProcessData>,
        settings: &mut impl ObjectDictionary,
    ) -> Result<ValueBytes, AbortCode> {
        let permission = Err(AbortCode::LocalControl);
        Served { objects: &mut self.objects, process, settings, permission, now: Time::default() }.read(object)
    }

    fn obey(&mut self, command: NmtCommand, now: Time) {
        match command {
            NmtCommand::Start => self.objects.state = NmtState::Operational,
            NmtCommand::Stop => {
                self.objects.state = NmtState::Stopped;
                self.forget_transfers();
            }
            NmtCommand::EnterPreOperational => self.objects.state = NmtState::PreOperational,
            NmtCommand::ResetNode | NmtCommand::ResetCommunication => {
                self.objects = Objects::new(self.objects.settings, self.objects.errors.clone(), now);
                self.forget_transfers();
                self.has_booted = false;
            }
        }
    }

    /// Nobody waits for an answer any more. What is being stored is stored all the same.
    fn forget_transfers(&mut self) {
        self.server.forget();
        if let Some(saving) = &mut self.saving {
            saving.answer = None;
        }
    }

    /// Whether a PDO is to be sent.
    #[must_use]
    pub fn is_publishing(&self, now: Time) -> bool {
        self.is_operational() && self.objects.pdos.iter().any(|pdo| pdo.is_due(now))
    }

    /// The PDOs that are due, all of the same pose and with the same counter.
    pub fn publish(&mut self, now: Time, process: &ProcessData) -> Vec<Frame, TRANSMIT_PDOS> {
        let mut frames = Vec::new();
        if !self.is_publishing(now) {
            return frames;
        }
        let Objects { settings, pdos, counter, .. } = &mut self.objects;
        let telegrams = process.telegrams(settings.node, *counter);
        for pdo in pdos.iter_mut().filter(|pdo| pdo.is_due(now)) {
            pdo.note_sent(now);
            if let Some(frame) = pdo.frame(process, &telegrams) {
                // There is room for one of each.
                let _ = frames.push(frame);
            }
        }
        *counter = if *counter >= LAST_COUNT { 0 } else { *counter + 1 };
        frames
    }
}

/// What is answered while something is being stored: that this is so, unless the master gives up.
fn answer_meanwhile(saving: &mut Saving, request: [u8; 8]) -> Option<[u8; 8]> {
    let [first, low, high, sub, ..] = request;
    if first >> 5 == sdo::GIVE_UP {
        saving.answer = None;
        return None;
    }
    Some(sdo::abort(Object::new(u16::from_le_bytes([low, high]), sub), AbortCode::DeviceState))
}
