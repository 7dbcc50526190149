//! The NAV350: recorded telegrams, the emulated sensor, and what is recorded from it.

mod recorded;
