//! The machine that owns all below: one event in, outputs out.

mod event;
mod parameters;

pub use event::{Event, PoseFix};
pub use parameters::Parameters;
