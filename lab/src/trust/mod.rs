//! Whether the vehicle may be trusted: kinds of faults at every size, in halls that are drawn, judged at the bus.

pub mod figures;
pub mod hall;
pub mod judge;
pub mod kinds;
pub mod outcome;
pub mod row;
pub mod sight;
pub mod sweep;
pub mod trial;
