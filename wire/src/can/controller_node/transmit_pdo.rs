//! One PDO that the controller sends: when, and what is in it (CiA 301, 7.5.2.35 and 7.5.2.37).

use agv_core::measurement::Time;

use super::dictionary;
use super::parameters::PdoParameters;
use super::process::{ProcessData, Telegrams, is_process_data};
use crate::can::frame::{Frame, standard_id};
use crate::can::pdo::{MAX_ENTRIES, MappingEntry};
use crate::can::sdo::AbortCode;

/// Bits of an identifier that are its number.
const NUMBER: u32 = 0x7FF;
/// Bit of an identifier: the PDO is off.
const OFF: u32 = 1 << 31;
/// Bit of an identifier: the PDO cannot be asked for by a frame without data.
pub(super) const NO_REQUEST: u32 = 1 << 30;
/// Transmission type: by the event timer (CiA 301, table 72).
pub(super) const BY_EVENT: u8 = 254;
/// Most SYNCs from one PDO to the next.
const MOST_SYNCS: u8 = 240;
/// Bits that a PDO holds.
const PDO_BITS: u32 = 64;

#[derive(Clone, Copy, Debug)]
pub(super) struct TransmitPdo {
    id: u32,
    transmission: u8,
    /// Shortest time between two, 100 us.
    inhibit: u16,
    /// Time between two, ms; 0 is never.
    timer: u16,
    count: u8,
    entries: [u32; MAX_ENTRIES],
    /// When the timer ends.
    next: Time,
    last: Option<Time>,
    syncs: u8,
    is_asked: bool,
}

impl TransmitPdo {
    /// A PDO of one object of 64 bits, sent every `timer` ms from `start` on.
    pub(super) const fn new(id: u32, index: u16, timer: u16, start: Time) -> Self {
        let mut entries = [0; MAX_ENTRIES];
        let [first, ..] = &mut entries;
        *first = (index as u32) << 16 | PDO_BITS;
        Self {
            id: id | NO_REQUEST,
            transmission: BY_EVENT,
            inhibit: 0,
            timer,
            count: 1,
            entries,
            next: start,
            last: None,
            syncs: 0,
            is_asked: false,
        }
    }

    const fn is_on(&self) -> bool {
        self.id & OFF == 0
    }

    const fn is_synchronous(&self) -> bool {
        self.transmission <= MOST_SYNCS
    }

    /// A SYNC was heard.
    pub(super) fn note_sync(&mut self) {
        if self.is_on() && self.is_synchronous() {
            self.syncs = self.syncs.saturating_add(1);
            self.is_asked |= self.syncs >= self.transmission.max(1);
        }
    }

    /// Whether it is to be sent.
    pub(super) fn is_due(&self, now: Time) -> bool {
        if !self.is_on() {
            return false;
        }
        if self.is_synchronous() {
            return self.is_asked;
        }
        let is_held = self.last.is_some_and(|last| now.since(last) < 1e-4 * f64::from(self.inhibit));
        self.timer > 0 && now >= self.next && !is_held
    }

    /// It goes out. Moments that were missed are left out.
    pub(super) fn note_sent(&mut self, now: Time) {
        let period = 1e-3 * f64::from(self.timer);
        let following = self.next.offset(period);
        self.next = if following <= now { now.offset(period) } else { following };
        self.last = Some(now);
        (self.syncs, self.is_asked) = (0, false);
    }

    /// The frame.
    pub(super) fn frame(&self, process: &ProcessData, telegrams: &Telegrams) -> Option<Frame> {
        let (mut payload, mut bits) = (0, 0);
        for entry in self.entries.iter().take(usize::from(self.count)) {
            let MappingEntry { object, bits: length } = MappingEntry::decode(*entry);
            let value = process.value(object, telegrams)?;
            let length = u32::from(length);
            if length == 0 || bits + length > PDO_BITS {
                return None;
            }
            payload |= (value & u64::MAX >> (64 - length)) << bits;
            bits += length;
        }
        let bytes = payload.to_le_bytes();
        Frame::new(standard_id(self.id as u16), bytes.get(..bits.div_ceil(8) as usize)?)
    }

    /// What can be stored of it; `default` is its identifier by default, and `period` its timer.
    pub(super) fn parameters(&self, default: u32, period: u16) -> PdoParameters {
        PdoParameters {
            id: to_store(default, self.id),
            transmission: self.transmission,
            inhibit: self.inhibit,
            timer: (self.timer != period).then_some(self.timer),
            count: self.count,
            entries: self.entries,
        }
    }

    /// Takes what was stored.
    ///
    /// # Errors
    /// If a master could not have set it so.
    pub(super) fn set_parameters(&mut self, stored: &PdoParameters, now: Time) -> Result<(), AbortCode> {
        self.id = restored(self.id, stored.id)?;
        self.set_parameter(2, u32::from(stored.transmission), now)?;
        self.set_parameter(3, u32::from(stored.inhibit), now)?;
        if let Some(timer) = stored.timer {
            self.set_parameter(5, u32::from(timer), now)?;
        }
        self.set_mapping(0, 0)?;
        for (sub, entry) in (1..).zip(stored.entries) {
            // Nobody has ever set the others.
            if entry != 0 {
                self.set_mapping(sub, entry)?;
            }
        }
        self.set_mapping(0, u32::from(stored.count))
    }

    /// A part of its communication parameter.
    pub(super) fn parameter(&self, sub: u8) -> Option<u32> {
        Some(match sub {
            0 => 5,
            1 => self.id,
            2 => u32::from(self.transmission),
            3 => u32::from(self.inhibit),
            5 => u32::from(self.timer),
            _ => return None,
        })
    }

    /// Changes a part of it.
    pub(super) fn set_parameter(&mut self, sub: u8, value: u32, now: Time) -> Result<(), AbortCode> {
        match sub {
            1 => {
                check_id(self.id, value)?;
                self.id = value;
                self.restart(now);
            }
            // The ranges between are reserved, or for PDOs that are asked for.
            2 if !matches!(value, 0..=240 | 254 | 255) => return Err(AbortCode::InvalidValue),
            2 => {
                self.transmission = value as u8;
                self.restart(now);
            }
            3 => self.inhibit = value as u16,
            5 => {
                self.timer = value as u16;
                self.restart(now);
            }
            _ => return Err(AbortCode::NoSuchSubindex),
        }
        Ok(())
    }

    fn restart(&mut self, now: Time) {
        (self.next, self.syncs, self.is_asked) = (now, 0, false);
    }

    /// A part of its mapping.
    pub(super) fn mapping(&self, sub: u8) -> Option<u32> {
        match sub.checked_sub(1) {
            None => Some(u32::from(self.count)),
            Some(place) => self.entries.get(usize::from(place)).copied(),
        }
    }

    /// Changes a part of it: entries while there are none, then their number.
    pub(super) fn set_mapping(&mut self, sub: u8, value: u32) -> Result<(), AbortCode> {
        let Some(place) = sub.checked_sub(1) else { return self.set_count(value) };
        if self.count != 0 {
            return Err(AbortCode::UnsupportedAccess);
        }
        check_entry(value)?;
        *self.entries.get_mut(usize::from(place)).ok_or(AbortCode::NoSuchSubindex)? = value;
        Ok(())
    }

    fn set_count(&mut self, count: u32) -> Result<(), AbortCode> {
        if count as usize > MAX_ENTRIES {
            return Err(AbortCode::PdoLength);
        }
        let mut bits = 0;
        for entry in self.entries.iter().take(count as usize) {
            check_entry(*entry)?;
            bits += u32::from(MappingEntry::decode(*entry).bits);
        }
        if bits > PDO_BITS {
            return Err(AbortCode::PdoLength);
        }
        self.count = count as u8;
        Ok(())
    }
}

/// Whether an entry names an object that can be mapped, with its length.
fn check_entry(entry: u32) -> Result<(), AbortCode> {
    let MappingEntry { object, bits } = MappingEntry::decode(entry);
    let found = dictionary::find(object)?;
    let length = found.data_type.length().unwrap_or(0);
    if is_process_data(object) && usize::from(bits) == 8 * length { Ok(()) } else { Err(AbortCode::NotMappable) }
}

/// An identifier as it is stored: with the number 0 for the one by default.
pub(super) const fn to_store(default: u32, id: u32) -> u32 {
    if (id ^ default) & NUMBER == 0 { id & !NUMBER } else { id }
}

/// The identifier that was stored so.
///
/// # Errors
/// If a master could not have set it.
pub(super) fn restored(default: u32, stored: u32) -> Result<u32, AbortCode> {
    if stored & NUMBER == 0 {
        let id = stored | default & NUMBER;
        return if (id ^ default) & !OFF == 0 { Ok(id) } else { Err(AbortCode::InvalidValue) };
    }
    // It was switched off when its number was changed.
    check_id(default | OFF, stored)?;
    Ok(stored)
}

/// Whether the identifier of what the controller sends may become another one: of eleven bits, not one that CiA 301 (table
/// 40) keeps for itself, and only while it is off.
pub(super) fn check_id(before: u32, after: u32) -> Result<(), AbortCode> {
    let number = after & NUMBER;
    let is_restricted =
        matches!(number, 0..=0x080 | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..);
    let is_changed_while_on = (before | after) & OFF == 0 && number != before & NUMBER;
    let has_other_bits = after & !(OFF | NO_REQUEST) != number;
    if is_restricted || is_changed_while_on || has_other_bits || (after ^ before) & NO_REQUEST != 0 {
        return Err(AbortCode::InvalidValue);
    }
    Ok(())
}
