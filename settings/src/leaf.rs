//! One setting: its name, its unit, its bounds.

use agv_core::localizer::Parameters;
use agv_core::odometry::{Tricycle, Vehicle};
use serde::{Deserialize, Serialize};

use crate::Settings;
use crate::contradiction::Cause;

/// What a leaf holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// A measure, in the unit of the leaf.
    Number(f64),
    /// A whole number.
    Whole(u64),
    /// Yes or no.
    Switch(bool),
    /// An IPv4 address.
    Address([u8; 4]),
}

/// One setting. Names follow the folder names of the code; units are SI.
pub struct Leaf {
    /// Number of its item in flash. It never gets another meaning.
    pub key: u16,
    /// Its name.
    pub name: &'static str,
    /// Its unit, or empty.
    pub unit: &'static str,
    /// Least and greatest value; meaningless for switches and addresses.
    pub bounds: (f64, f64),
    /// What the settings say. None if they have no such setting, because the vehicle is of another kind.
    pub(crate) get: fn(&Settings) -> Option<Value>,
    /// Writes a value of the right kind within its bounds; false if it is of another kind.
    pub(crate) set: fn(&mut Settings, Value) -> bool,
}

/// Why a value is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LeafError {
    /// The leaf holds another kind of value.
    Kind,
    /// The value is not within the bounds of the leaf, or does not go with the other settings.
    Bounds,
    /// The CAN bus would be loaded by more than 60 % of its bit rate: [`crate::bus_load`].
    BusLoad,
}

impl Leaf {
    /// What the settings say; None if the vehicle has no such setting.
    #[must_use]
    pub fn get(&self, settings: &Settings) -> Option<Value> {
        (self.get)(settings)
    }

    /// Changes the settings.
    ///
    /// # Errors
    /// If the value is of another kind, or outside the bounds. The settings are as before.
    pub fn set(&self, settings: &mut Settings, value: Value) -> Result<(), LeafError> {
        let number = match value {
            Value::Number(number) => Some(number),
            Value::Whole(whole) => Some(whole as f64),
            Value::Switch(_) | Value::Address(_) => None,
        };
        let (least, most) = self.bounds;
        // Not a number is not within any bounds.
        if number.is_some_and(|number| !(least <= number && number <= most)) {
            return Err(LeafError::Bounds);
        }
        if (self.set)(settings, value) { Ok(()) } else { Err(LeafError::Kind) }
    }
}

impl Leaf {
    /// Changes settings that go together, if they still do with the new value.
    ///
    /// # Errors
    /// As [`Leaf::set`], and if the value does not go with the others. The settings are as before.
    pub fn change(&self, settings: &mut Settings, value: Value) -> Result<(), LeafError> {
        let before = self.get(settings);
        self.set(settings, value)?;
        if let Err(contradiction) = settings.check() {
            if let Some(before) = before {
                (self.set)(settings, before);
            }
            return Err(match contradiction.cause {
                Cause::Bounds => LeafError::Bounds,
                Cause::BusLoad => LeafError::BusLoad,
            });
        }
        Ok(())
    }
}

/// The tricycle of the parameters.
pub(crate) const fn tricycle(parameters: &Parameters) -> Option<&Tricycle> {
    match &parameters.vehicle {
        Vehicle::Tricycle(tricycle) => Some(tricycle),
        _ => None,
    }
}

/// The tricycle of the parameters.
pub(crate) const fn tricycle_mut(parameters: &mut Parameters) -> Option<&mut Tricycle> {
    match &mut parameters.vehicle {
        Vehicle::Tricycle(tricycle) => Some(tricycle),
        _ => None,
    }
}
