//! What measures the localiser: [`evaluate`] has one experiment a file, [`campaign`] has faults and their verdicts,
//! [`trust`] has kinds of faults at every size.
//!
//! It stands on `agv-host-sim`; nothing but the command `agv` stands on it.

pub mod campaign;
pub mod evaluate;
pub mod trust;
