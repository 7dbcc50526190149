//! The NAV350: recorded telegrams, the emulated sensor, and what is recorded from it.

mod capture;
pub mod commands;
mod hostile;
mod layout;
mod live;
mod minute;
mod recorded;
mod third_party;
mod turns;
