//! What measures the localiser: [`evaluate`] has one experiment a file, [`campaign`] has faults and their verdicts,
//! [`trust`] has kinds of faults at every size, and [`equipment`] the vehicles to choose from.
//!
//! It stands on `agv-host-sim`; nothing but the command `agv` stands on it.

pub mod campaign;
pub mod equipment;
pub mod evaluate;
pub mod trust;
