//! One setting: its name, its unit, its bounds.

use serde::{Deserialize, Serialize};

use crate::contradiction::Cause;
use crate::{Settings, VehicleKind};

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
    /// The kinds of vehicles for which it matters.
    pub kinds: &'static [VehicleKind],
    /// What its whole numbers are called, from 0 on; empty if they are numbers of something.
    pub choices: &'static [&'static str],
    /// What the settings say.
    pub(crate) get: fn(&Settings) -> Value,
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
    /// With the value the leaf of that key is out of its bounds, or does not go with the others.
    Other(u16),
}

impl Leaf {
    /// What the settings say, whether it matters or not.
    #[must_use]
    pub fn value(&self, settings: &Settings) -> Value {
        (self.get)(settings)
    }

    /// Whether it matters for the kind of the vehicle.
    #[must_use]
    pub fn matters(&self, settings: &Settings) -> bool {
        self.kinds.contains(&settings.vehicle.kind)
    }

    /// What the settings say; None if it does not matter for the kind of the vehicle.
    #[must_use]
    pub fn get(&self, settings: &Settings) -> Option<Value> {
        self.matters(settings).then(|| self.value(settings))
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
        let before = self.value(settings);
        self.set(settings, value)?;
        if let Err(contradiction) = settings.check() {
            (self.set)(settings, before);
            let names = [Some(contradiction.leaf), contradiction.other];
            let other = names.into_iter().flatten().filter_map(Self::named).find(|leaf| leaf.key != self.key);
            return Err(match (contradiction.cause, other) {
                (Cause::BusLoad, _) => LeafError::BusLoad,
                (Cause::Bounds, Some(other)) => LeafError::Other(other.key),
                (Cause::Bounds, None) => LeafError::Bounds,
            });
        }
        Ok(())
    }
}
