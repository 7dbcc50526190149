//! Recordings of others.

pub mod carmen;
pub mod graph_log;
mod posed_scan;

pub use posed_scan::{PosedScan, ScanLog};
