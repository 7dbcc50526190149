//! Experiments, one file each.

pub mod falko;
pub mod repeatability;
