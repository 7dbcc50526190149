//! The NAV350: recorded telegrams, the emulated sensor, and what is recorded from it.

mod layout;
mod live;
mod recorded;
