//! The objects of an encoder: those of the communication profile (CiA 301) that a master looks at, and those of the encoder
//! profile (CiA 406).

use std::collections::BTreeMap;

use agv_core::odometry::CounterRange;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::encoder::object;
use agv_wire::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};

/// Steps of a revolution of the shaft.
const STEPS: u32 = 4096;
/// Bit of a PDO's identifier that says that it is off.
pub(super) const PDO_OFF: u32 = 1 << 31;
/// Bytes that a PDO holds.
const PDO_BYTES: u32 = 8;
/// What the store command must say: `save`.
const SAVE: u32 = u32::from_le_bytes(*b"save");

const DEVICE_TYPE: Object = Object::new(0x1000, 0);
/// Bit of the operating parameters that says that the position is scaled.
const SCALED: u16 = 1 << 2;
const PRESET: Object = Object::new(0x6003, 0);
const OPERATING_STATUS: Object = Object::new(0x6500, 0);
const STORE_ALL: Object = Object::new(0x1010, 1);

/// Objects that a master may write, but for the mapping.
const WRITABLE: [Object; 9] = [
    Object::new(0x1005, 0),
    object::HEARTBEAT_TIME,
    object::PDO_ID,
    object::PDO_TRANSMISSION,
    object::PDO_INHIBIT_TIME,
    object::PDO_EVENT_TIMER,
    object::OPERATING_PARAMETERS,
    PRESET,
    STORE_ALL,
];

/// The objects of one encoder, and the position of its shaft.
#[derive(Clone, Debug)]
pub(super) struct EncoderObjects {
    values: BTreeMap<(u16, u8), Vec<u8>>,
    /// How many positions there are.
    range: u64,
    /// Where the shaft is, without preset.
    shaft: u64,
    /// What is added to it.
    offset: u64,
}

impl EncoderObjects {
    /// The objects as they leave the factory. The range is told as most devices do: the largest position if it is a power of
    /// two.
    pub(super) fn new(node: NodeId, range: CounterRange) -> Self {
        let values = range.values();
        let told = if values.is_power_of_two() { values - 1 } else { values };
        let revolutions = u32::try_from(values / u64::from(STEPS)).unwrap_or(u32::MAX).max(1);
        let mut objects = Self { values: BTreeMap::new(), range: values, shaft: 0, offset: 0 };
        let wide = [
            (DEVICE_TYPE, 0x0002_0196),
            (Object::new(0x1005, 0), 0x80),
            (Object::new(0x1018, 1), 0),
            (Object::new(0x1018, 2), 406),
            (Object::new(0x1018, 3), 0x0001_0000),
            (Object::new(0x1018, 4), u32::from(node.number())),
            (STORE_ALL, 1),
            (object::PDO_ID, 0x180 + u32::from(node.number())),
            (Object::new(0x1A00, 1), 0x6004_0020),
            (object::UNITS_PER_REVOLUTION, STEPS),
            (object::MEASURING_RANGE, told as u32),
            (PRESET, 0),
            (object::SINGLE_TURN_RESOLUTION, STEPS),
            (Object::new(0x6502, 0), revolutions),
        ];
        // What a shaft of whole revolutions has is not scaled.
        let is_scaled = values != u64::from(STEPS) * u64::from(revolutions);
        let half = [
            (object::HEARTBEAT_TIME, 0),
            (object::PDO_INHIBIT_TIME, 0),
            (object::PDO_EVENT_TIMER, 0),
            (object::OPERATING_PARAMETERS, if is_scaled { SCALED } else { 0 }),
            (OPERATING_STATUS, 0),
            (Object::new(0x6503, 0), 0),
            (Object::new(0x6504, 0), 0),
            (Object::new(0x6505, 0), 0),
            (Object::new(0x6506, 0), 0_u16),
        ];
        let narrow = [
            (Object::new(0x1001, 0), 0),
            (Object::new(0x1010, 0), 1),
            (Object::new(0x1018, 0), 4),
            (Object::new(0x1800, 0), 5),
            (object::PDO_TRANSMISSION, 254),
            (object::PDO_MAPPING, 1_u8),
        ];
        let texts = [
            (Object::new(0x1008, 0), "emulated encoder"),
            (Object::new(0x1009, 0), "none"),
            (Object::new(0x100A, 0), concat!("agv ", env!("CARGO_PKG_VERSION"))),
        ];
        wide.into_iter().for_each(|(object, value)| objects.put(object, &value.to_le_bytes()));
        half.into_iter().for_each(|(object, value)| objects.put(object, &value.to_le_bytes()));
        narrow.into_iter().for_each(|(object, value)| objects.put(object, &[value]));
        texts.into_iter().for_each(|(object, text)| objects.put(object, text.as_bytes()));
        objects
    }

    fn put(&mut self, object: Object, bytes: &[u8]) {
        self.values.insert((object.index, object.sub), bytes.to_vec());
    }

    /// A number of up to 32 bits; 0 if there is no such object.
    pub(super) fn number(&self, object: Object) -> u32 {
        self.values.get(&(object.index, object.sub)).map_or(0, |bytes| number(bytes))
    }

    /// Turns the shaft.
    pub(super) fn turn(&mut self, position: u32) {
        self.shaft = u64::from(position) % self.range;
    }

    /// The position that is told: counted in the direction that is set, and moved by the preset.
    fn position(&self) -> u32 {
        let falls = self.number(object::OPERATING_PARAMETERS) & 1 != 0;
        let counted = if falls { (self.range - self.shaft) % self.range } else { self.shaft };
        ((counted + self.offset) % self.range) as u32
    }

    /// The bytes of the process data, as they are mapped.
    pub(super) fn process_data(&self) -> Vec<u8> {
        let entries = (1..=self.number(object::PDO_MAPPING) as u8).map(|sub| self.number(Object::new(0x1A00, sub)));
        entries.filter_map(|entry| self.read(mapped(entry)).ok()).flatten().collect()
    }

    fn preset(&mut self, value: u32) {
        self.offset = 0;
        let now = u64::from(self.position());
        self.offset = (u64::from(value) % self.range + self.range - now) % self.range;
    }

    /// Whether an entry of the mapping names an object that can be mapped, with its length.
    fn check_mapping(&self, entry: u32) -> Result<(), AbortCode> {
        let bytes = self.read(mapped(entry)).map_err(|_| AbortCode::NoSuchObject)?;
        let is_process_value = matches!(entry >> 16, 0x6004 | 0x6500 | 0x6503 | 0x6505);
        let has_length = 8 * bytes.len() as u32 == entry & 0xFF;
        if is_process_value && has_length { Ok(()) } else { Err(AbortCode::NotMappable) }
    }

    /// Changes the mapping, which is possible while it is empty only.
    fn map(&mut self, sub: u8, bytes: &[u8]) -> Result<(), AbortCode> {
        let value = number(bytes);
        if sub == 0 {
            let entries = (1..=value as u8).map(|sub| self.number(Object::new(0x1A00, sub)));
            let mut bits = 0;
            for entry in entries {
                self.check_mapping(entry)?;
                bits += entry & 0xFF;
            }
            if bits > 8 * PDO_BYTES {
                return Err(AbortCode::PdoLength);
            }
        } else {
            if self.number(object::PDO_MAPPING) != 0 {
                return Err(AbortCode::UnsupportedAccess);
            }
            self.check_mapping(value)?;
        }
        self.put(Object::new(0x1A00, sub), bytes);
        Ok(())
    }
}

/// The object that an entry of a mapping names.
const fn mapped(entry: u32) -> Object {
    Object::new((entry >> 16) as u16, (entry >> 8) as u8)
}

fn number(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

/// Whether something is the part of the mapping of the process data.
const fn is_mapping(object: Object) -> bool {
    object.index == 0x1A00
}

impl ObjectDictionary for EncoderObjects {
    fn read(&self, asked: Object) -> Result<ValueBytes, AbortCode> {
        let value = |bytes: &[u8]| ValueBytes::from_slice(bytes).map_err(|_| AbortCode::OutOfMemory);
        if asked == object::POSITION {
            return value(&self.position().to_le_bytes());
        }
        let is_index = |&(index, _): &(u16, u8)| index == asked.index || asked.index == object::POSITION.index;
        match self.values.get(&(asked.index, asked.sub)) {
            Some(bytes) => value(bytes),
            None if self.values.keys().any(is_index) => Err(AbortCode::NoSuchSubindex),
            None => Err(AbortCode::NoSuchObject),
        }
    }

    fn writable(&self, asked: Object) -> Result<usize, AbortCode> {
        let is_new_entry = is_mapping(asked) && (1..=8).contains(&asked.sub);
        let known = if is_new_entry { 4 } else { self.read(asked)?.len() };
        if !WRITABLE.contains(&asked) && !is_mapping(asked) {
            return Err(AbortCode::ReadOnly);
        }
        Ok(known)
    }

    fn write(&mut self, asked: Object, bytes: &[u8]) -> Result<(), AbortCode> {
        let value = number(bytes);
        match asked {
            asked if is_mapping(asked) => return self.map(asked.sub, bytes),
            object::PDO_TRANSMISSION if !matches!(value, 1..=240 | 254 | 255) => return Err(AbortCode::InvalidValue),
            // The identifier of a PDO that is on cannot be changed.
            object::PDO_ID => {
                let before = self.number(object::PDO_ID);
                if (before | value) & PDO_OFF == 0 && before != value {
                    return Err(AbortCode::InvalidValue);
                }
            }
            STORE_ALL if value == SAVE => return Ok(()),
            STORE_ALL => return Err(AbortCode::CannotStore),
            PRESET => self.preset(value),
            object::OPERATING_PARAMETERS => self.put(OPERATING_STATUS, bytes),
            _ => {}
        }
        self.put(asked, bytes);
        Ok(())
    }
}
