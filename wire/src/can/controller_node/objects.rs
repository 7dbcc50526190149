//! The values of the objects.

use agv_core::measurement::Time;

use super::NodeSettings;
use super::consumers::{CONSUMERS, Consumers};
use super::dictionary::{self, Access, DataType};
use super::errors::{ErrorKind, Errors};
use super::parameters::{CommunicationParameters, PdoParameters};
use super::process::{ProcessData, is_process_data};
use super::transmit_pdo::{BY_EVENT, NO_REQUEST, TransmitPdo, check_id, restored, to_store};
use crate::can::frame::{Frame, standard_id};
use crate::can::nmt::NmtState;
use crate::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};

/// Time between heartbeats, ms.
pub const HEARTBEAT_TIME: u16 = 100;

/// PDOs that are received and transmitted.
const RECEIVE_PDOS: u16 = 3;
pub(super) const TRANSMIT_PDOS: usize = 5;
/// What the transmit PDOs hold by default: base of the identifier, and the object.
const TRANSMITTED: [(u32, u16); TRANSMIT_PDOS] =
    [(0x180, 0x2001), (0x280, 0x2002), (0x380, 0x2003), (0x480, 0x2004), (0x680, 0x2008)];
/// What the receive PDOs hold.
const RECEIVED: [u16; RECEIVE_PDOS as usize] = [0x2005, 0x2006, 0x2007];
/// Identifiers of SYNC and, without the node, of emergencies.
const SYNC_ID: u32 = 0x80;
const EMERGENCY_ID: u32 = 0x80;
/// Bit of the emergencies' identifier: none are sent.
const NO_EMERGENCIES: u32 = 1 << 31;
/// Bits of 1F80h: the device is the NMT master; it does not become operational by itself.
const IS_MASTER: u32 = 1;
const WAITS: u32 = 1 << 2;
/// Where the settings are stored.
pub(super) const STORE: Object = Object::new(0x1010, 1);
/// What 1010h must be told to store the settings, and what it says: that it does so when it is told.
const SAVE: u32 = u32::from_le_bytes(*b"save");
const SAVES_ON_COMMAND: u32 = 1;
/// Settings have the objects from here on.
pub const FIRST_SETTING: u16 = 0x4000;
const LAST_SETTING: u16 = 0x4FFF;

/// Revision of what is said and heard: it goes up where a signal changes its meaning.
const REVISION: u32 = 3;

/// Everything that the node serves, but for pose and settings.
#[derive(Clone, Debug)]
pub(super) struct Objects {
    pub(super) settings: NodeSettings,
    pub(super) state: NmtState,
    pub(super) heartbeat_time: u16,
    emergency_id: u32,
    pub(super) consumers: Consumers,
    pub(super) pdos: [TransmitPdo; TRANSMIT_PDOS],
    pub(super) errors: Errors,
    /// An order that came by SDO instead of in a PDO.
    pub(super) order: Option<Frame>,
    /// Whether the settings are to be stored.
    pub(super) is_save_asked: bool,
    /// Counter of the telegrams that are sent next.
    pub(super) counter: u8,
}

impl Objects {
    /// Those of a node that has just started, with what was stored of them before it did; without it, if that cannot be.
    pub(super) fn new(settings: NodeSettings, errors: Errors, start: Time) -> Self {
        let by_default = Self::with_defaults(settings, errors, start);
        let Some(stored) = &settings.stored else { return by_default };
        let mut objects = by_default.clone();
        match objects.restore(stored, start) {
            Ok(()) => objects,
            Err(_) => {
                let mut objects = by_default;
                objects.errors.report(ErrorKind::SettingsLost, 0, start);
                objects
            }
        }
    }

    fn with_defaults(settings: NodeSettings, errors: Errors, start: Time) -> Self {
        let node = u32::from(settings.node.number());
        Self {
            settings,
            state: if settings.starts_itself { NmtState::Operational } else { NmtState::PreOperational },
            heartbeat_time: HEARTBEAT_TIME,
            emergency_id: EMERGENCY_ID + node,
            consumers: Consumers::new(),
            pdos: TRANSMITTED.map(|(base, index)| TransmitPdo::new(base + node, index, settings.period, start)),
            errors,
            order: None,
            is_save_asked: false,
            counter: 0,
        }
    }

    /// What a master may change of how the node speaks, as it is.
    pub(super) fn parameters(&self) -> CommunicationParameters {
        let NodeSettings { node, period, .. } = self.settings;
        let node = u32::from(node.number());
        let mut pdos = [PdoParameters::OFF; TRANSMIT_PDOS];
        for ((parameters, pdo), (base, _)) in pdos.iter_mut().zip(&self.pdos).zip(TRANSMITTED) {
            *parameters = pdo.parameters(base + node, period);
        }
        CommunicationParameters {
            emergency_id: to_store(EMERGENCY_ID + node, self.emergency_id),
            consumers: self.consumers.entries(),
            heartbeat_time: self.heartbeat_time,
            pdos,
        }
    }

    fn restore(&mut self, stored: &CommunicationParameters, now: Time) -> Result<(), AbortCode> {
        self.emergency_id = restored(self.emergency_id, stored.emergency_id)?;
        for (sub, entry) in (1..).zip(stored.consumers) {
            self.consumers.set(sub, entry)?;
        }
        self.heartbeat_time = stored.heartbeat_time;
        self.pdos.iter_mut().zip(&stored.pdos).try_for_each(|(pdo, stored)| pdo.set_parameters(stored, now))
    }

    /// The identifier of emergencies, if they are sent.
    pub(super) fn emergency_id(&self) -> Option<u16> {
        (self.emergency_id & NO_EMERGENCIES == 0).then_some(self.emergency_id as u16)
    }

    fn text(&self, index: u16) -> Option<&'static str> {
        match index {
            0x1008 => Some("Localisation controller"),
            0x1009 => Some(self.settings.hardware),
            0x100A => Some(self.settings.software),
            _ => None,
        }
    }

    fn number(&self, Object { index, sub }: Object) -> Result<u32, AbortCode> {
        let history = self.errors.history();
        let NodeSettings { node, vendor, serial, is_master, starts_itself, map, .. } = self.settings;
        let value = match (index, sub) {
            (0x1000, 0) | (0x1018, 2) => Some(0),
            (0x1018, 4) => Some(serial),
            (0x1001, 0) => Some(u32::from(self.errors.register())),
            (0x1003, 0) => Some(history.len() as u32),
            (0x1003, sub) => {
                let place = usize::from(sub).checked_sub(1);
                return place.and_then(|place| history.get(place)).copied().ok_or(AbortCode::NoData);
            }
            (0x1005, 0) => Some(SYNC_ID),
            (0x1010, 0) => Some(1),
            (0x1010, 1) => Some(SAVES_ON_COMMAND),
            (0x1014, 0) => Some(self.emergency_id),
            (0x1016, 0) => Some(CONSUMERS as u32),
            (0x1016, sub) => self.consumers.entry(sub),
            (0x1017, 0) => Some(u32::from(self.heartbeat_time)),
            (0x1018, 0) => Some(4),
            (0x1018, 1) => Some(vendor),
            (0x1018, 3) => Some(REVISION),
            (0x1400..=0x1402, 0) => Some(2),
            (0x1400..=0x1402, 1) => {
                Some(NO_REQUEST + 0x200 + 0x100 * u32::from(index - 0x1400) + u32::from(node.number()))
            }
            (0x1400..=0x1402, 2) => Some(u32::from(BY_EVENT)),
            (0x1600..=0x1602, 0) => Some(1),
            (0x1600..=0x1602, 1) => {
                RECEIVED.get(usize::from(index - 0x1600)).map(|content| u32::from(*content) << 16 | 64)
            }
            (0x1800..=0x1804, sub) => self.pdo(index - 0x1800).and_then(|pdo| pdo.parameter(sub)),
            (0x1A00..=0x1A04, sub) => self.pdo(index - 0x1A00).and_then(|pdo| pdo.mapping(sub)),
            (0x1F80, 0) => Some(if is_master { IS_MASTER } else { 0 } | if starts_itself { 0 } else { WAITS }),
            (0x2010 | 0x2012, 0) => Some(5),
            (0x2011, 0) => Some(3),
            (0x2013, 0) => Some(10),
            (0x2014, 0) => Some(2),
            (0x2014, 1) => Some(map.identity),
            (0x2014, 2) => Some(u32::from(map.landmarks)),
            _ => None,
        };
        value.ok_or(AbortCode::NoSuchSubindex)
    }

    fn pdo(&self, number: u16) -> Option<&TransmitPdo> {
        self.pdos.get(usize::from(number))
    }

    /// Takes a number that has the right length, of an object that can be written.
    fn set(&mut self, Object { index, sub }: Object, value: u32, now: Time) -> Result<(), AbortCode> {
        match (index, sub) {
            (0x1003, 0) if value != 0 => return Err(AbortCode::InvalidValue),
            (0x1003, 0) => self.errors.clear_history(),
            (0x1010, _) if value != SAVE => return Err(AbortCode::CannotStore),
            (0x1010, _) => self.is_save_asked = true,
            (0x1014, 0) => {
                check_id(self.emergency_id, value)?;
                self.emergency_id = value;
            }
            (0x1016, sub) => self.consumers.set(sub, value)?,
            (0x1017, 0) => self.heartbeat_time = value as u16,
            (0x1800..=0x1804 | 0x1A00..=0x1A04, sub) => {
                if self.state != NmtState::PreOperational {
                    return Err(AbortCode::DeviceState);
                }
                let pdo = self.pdos.get_mut(usize::from(index & 0xFF)).ok_or(AbortCode::NoSuchObject)?;
                match index {
                    0x1800..=0x1804 => pdo.set_parameter(sub, value, now)?,
                    _ => pdo.set_mapping(sub, value)?,
                }
            }
            _ => return Err(AbortCode::ReadOnly),
        }
        Ok(())
    }

    /// Takes an order as if it had come in its PDO.
    fn take_order(&mut self, index: u16, bytes: &[u8]) -> Result<(), AbortCode> {
        if self.state != NmtState::Operational {
            return Err(AbortCode::DeviceState);
        }
        let base = match index {
            0x2005 => 0x200,
            0x2006 => 0x300,
            _ => 0x400,
        };
        self.order = Frame::new(standard_id(base + u16::from(self.settings.node.number())), bytes);
        Ok(())
    }
}

/// Whether settings may be changed and stored, and why not.
pub type Permission = Result<(), AbortCode>;

/// The objects with what others know.
pub(super) struct Served<'a, S> {
    pub(super) objects: &'a mut Objects,
    pub(super) process: Option<&'a ProcessData>,
    pub(super) settings: &'a mut S,
    pub(super) permission: Permission,
    pub(super) now: Time,
}

fn is_setting(object: Object) -> bool {
    (FIRST_SETTING..=LAST_SETTING).contains(&object.index)
}

/// The first bytes of a number.
fn bytes_of(number: u64, data_type: DataType) -> Result<ValueBytes, AbortCode> {
    let bytes = number.to_le_bytes();
    let bytes = data_type.length().and_then(|length| bytes.get(..length));
    bytes.and_then(|bytes| ValueBytes::from_slice(bytes).ok()).ok_or(AbortCode::InternalIncompatible)
}

impl<S: ObjectDictionary> ObjectDictionary for Served<'_, S> {
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode> {
        if is_setting(object) {
            return self.settings.read(object);
        }
        let entry = dictionary::find(object)?;
        if entry.access == Access::Write {
            return Err(AbortCode::WriteOnly);
        }
        if let Some(text) = self.objects.text(object.index) {
            let text = text.as_bytes();
            return ValueBytes::from_slice(text).map_err(|_| AbortCode::InternalIncompatible);
        }
        if is_process_data(object) {
            let process = self.process.ok_or(AbortCode::NoData)?;
            let telegrams = process.telegrams(self.objects.settings.node, self.objects.counter);
            let value = process.value(object, &telegrams).ok_or(AbortCode::NoSuchSubindex)?;
            return bytes_of(value, entry.data_type);
        }
        bytes_of(u64::from(self.objects.number(object)?), entry.data_type)
    }

    fn writable(&self, object: Object) -> Result<usize, AbortCode> {
        if is_setting(object) {
            let length = self.settings.writable(object)?;
            return self.permission.and(Ok(length));
        }
        let entry = dictionary::find(object)?;
        if object == STORE {
            self.permission?;
        }
        match entry.access {
            Access::Constant | Access::Read => Err(AbortCode::ReadOnly),
            Access::ReadWrite | Access::Write => entry.data_type.length().ok_or(AbortCode::ReadOnly),
        }
    }

    fn write(&mut self, object: Object, bytes: &[u8]) -> Result<(), AbortCode> {
        if is_setting(object) {
            return self.settings.write(object, bytes);
        }
        if dictionary::find(object)?.access == Access::Write {
            return self.objects.take_order(object.index, bytes);
        }
        let number = bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte));
        self.objects.set(object, number, self.now)
    }
}
