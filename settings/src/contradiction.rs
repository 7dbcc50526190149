//! Whether settings go together.

use agv_wire::can::bit_timing::BIT_RATES;
use agv_wire::can::bus_load::MOST_LOAD;

use crate::Settings;
use crate::bus_load::bus_load;

/// Why a setting does not go with the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The value is not possible, or not beside the others.
    Bounds,
    /// The CAN bus would be loaded by more than 60 % of its bit rate.
    BusLoad,
}

/// A setting that does not go with the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// Its name.
    pub leaf: &'static str,
    /// Why.
    pub cause: Cause,
}

impl Settings {
    /// Whether the settings go together.
    ///
    /// # Errors
    /// The first setting that does not, and why.
    pub fn check(&self) -> Result<(), Contradiction> {
        let bounds = |leaf| Contradiction { leaf, cause: Cause::Bounds };
        self.parameters.check().map_err(|error| bounds(error.leaf))?;
        if !BIT_RATES.contains(&self.bit_rate) {
            return Err(bounds("can.bit_rate"));
        }
        let is_profile = |number| matches!(number, 402 | 406);
        if !is_profile(self.nodes.drive_profile) {
            return Err(bounds("can.drive_profile"));
        }
        if !is_profile(self.nodes.steering_profile) {
            return Err(bounds("can.steering_profile"));
        }
        if bus_load(self) > MOST_LOAD {
            return Err(Contradiction { leaf: "can.publishing_period", cause: Cause::BusLoad });
        }
        Ok(())
    }
}
