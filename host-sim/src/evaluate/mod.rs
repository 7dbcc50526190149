//! Experiments: how good it is, one file an experiment.

pub mod accuracy;
pub mod warehouse;
