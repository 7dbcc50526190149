//! Calibration from logs: simulated drives whose truth is known, and logs that are not good enough.

mod bad_logs;
mod causes;
mod check;
mod command;
mod counters;
mod drives;
mod model;
mod planted;
mod truth;
