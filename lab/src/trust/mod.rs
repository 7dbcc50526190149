//! Whether the vehicle may be trusted: kinds of faults at every size, in halls that are drawn, judged at the bus.

pub mod blinding;
pub mod exact_bound;
pub mod figures;
pub mod hall;
pub mod judge;
pub mod kinds;
pub mod nominal;
pub mod of_kind;
pub mod of_pairs;
pub mod outcome;
pub mod page;
pub mod pair;
pub mod row;
pub mod scene;
pub mod sight;
pub mod stanford;
pub mod sweep;
pub mod threats;
pub mod trace;
pub mod trial;
pub mod worst;
