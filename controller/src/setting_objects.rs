//! Settings as objects of the controller's node: each leaf is one, at [`FIRST_SETTING`] and its key.

use agv_settings::leaf::{Leaf, LeafError, Value};
use agv_settings::{LEAVES, Settings};
use agv_wire::can::controller_node::FIRST_SETTING;
use agv_wire::can::controller_node::dictionary::DataType;
use agv_wire::can::sdo::{AbortCode, Object, ObjectDictionary, ValueBytes};

/// The object of a leaf.
#[must_use]
pub const fn object_of(leaf: &Leaf) -> Object {
    Object::new(FIRST_SETTING + leaf.key, 0)
}

/// How the value of a leaf is to be read. Whole numbers have as many bytes as the greatest one of the leaf needs.
#[must_use]
pub fn data_type(leaf: &Leaf, value: Value) -> DataType {
    let (_, most) = leaf.bounds;
    match value {
        Value::Number(_) => DataType::Real64,
        Value::Switch(_) => DataType::Boolean,
        Value::Address(_) => DataType::Unsigned32,
        Value::Whole(_) if most <= f64::from(u8::MAX) => DataType::Unsigned8,
        Value::Whole(_) if most <= f64::from(u16::MAX) => DataType::Unsigned16,
        Value::Whole(_) if most <= f64::from(u32::MAX) => DataType::Unsigned32,
        Value::Whole(_) => DataType::Unsigned64,
    }
}

/// Settings that can be read.
#[derive(Clone, Copy, Debug)]
pub struct SettingObjects<'a> {
    settings: &'a Settings,
}

impl<'a> SettingObjects<'a> {
    /// Those of a controller.
    #[must_use]
    pub const fn new(settings: &'a Settings) -> Self {
        Self { settings }
    }
}

fn find(object: Object) -> Result<&'static Leaf, AbortCode> {
    let leaf = LEAVES.iter().find(|leaf| object_of(leaf).index == object.index).ok_or(AbortCode::NoSuchObject)?;
    if object.sub == 0 { Ok(leaf) } else { Err(AbortCode::NoSuchSubindex) }
}

impl ObjectDictionary for SettingObjects<'_> {
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode> {
        let leaf = find(object)?;
        let value = leaf.value(self.settings);
        let bits = match value {
            Value::Number(number) => number.to_bits(),
            Value::Whole(whole) => whole,
            Value::Switch(is_on) => u64::from(is_on),
            // The first part of an address is its highest byte.
            Value::Address(parts) => u64::from(u32::from_be_bytes(parts)),
        };
        let bytes = bits.to_le_bytes();
        let bytes = data_type(leaf, value).length().and_then(|length| bytes.get(..length));
        bytes.and_then(|bytes| ValueBytes::from_slice(bytes).ok()).ok_or(AbortCode::InternalIncompatible)
    }

    fn writable(&self, object: Object) -> Result<usize, AbortCode> {
        find(object).and(Err(AbortCode::ReadOnly))
    }

    fn write(&mut self, object: Object, _: &[u8]) -> Result<(), AbortCode> {
        find(object).and(Err(AbortCode::ReadOnly))
    }
}

/// Settings that can be changed, too.
#[derive(Debug)]
pub struct ChangeableSettings<'a> {
    settings: &'a mut Settings,
}

impl<'a> ChangeableSettings<'a> {
    /// Those of a controller.
    #[must_use]
    pub const fn new(settings: &'a mut Settings) -> Self {
        Self { settings }
    }
}

/// A value of the kind of another one.
fn value_like(like: Value, bytes: &[u8]) -> Result<Value, AbortCode> {
    let bits = bytes.iter().rev().fold(0, |bits, byte| bits << 8 | u64::from(*byte));
    Ok(match like {
        Value::Number(_) => Value::Number(f64::from_bits(bits)),
        Value::Whole(_) => Value::Whole(bits),
        Value::Switch(_) if bits > 1 => return Err(AbortCode::InvalidValue),
        Value::Switch(_) => Value::Switch(bits == 1),
        Value::Address(_) => Value::Address((bits as u32).to_be_bytes()),
    })
}

impl ObjectDictionary for ChangeableSettings<'_> {
    fn read(&self, object: Object) -> Result<ValueBytes, AbortCode> {
        SettingObjects::new(self.settings).read(object)
    }

    fn writable(&self, object: Object) -> Result<usize, AbortCode> {
        let leaf = find(object)?;
        let value = leaf.value(self.settings);
        data_type(leaf, value).length().ok_or(AbortCode::InternalIncompatible)
    }

    fn write(&mut self, object: Object, bytes: &[u8]) -> Result<(), AbortCode> {
        let leaf = find(object)?;
        let value = value_like(leaf.value(self.settings), bytes)?;
        leaf.change(self.settings, value).map_err(|error| {
            let (least, most) = leaf.bounds;
            match (error, value) {
                (LeafError::Bounds, Value::Number(number)) if number > most => AbortCode::ValueTooHigh,
                (LeafError::Bounds, Value::Number(number)) if number < least => AbortCode::ValueTooLow,
                (LeafError::Bounds, Value::Whole(whole)) if whole as f64 > most => AbortCode::ValueTooHigh,
                (LeafError::Bounds, Value::Whole(whole)) if (whole as f64) < least => AbortCode::ValueTooLow,
                (LeafError::Bounds | LeafError::Kind, _) => AbortCode::InvalidValue,
                (LeafError::BusLoad | LeafError::Other(_), _) => AbortCode::ParameterIncompatible,
            }
        })
    }
}
