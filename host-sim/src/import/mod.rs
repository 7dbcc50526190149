//! Recordings of others.

pub mod candump;
pub mod carmen;
pub mod carpark;
pub mod graph_log;
mod posed_scan;
pub mod sapienza;
mod scan_drive;
mod table;

pub use posed_scan::{PosedScan, ScanLog};
pub use scan_drive::drive;
pub use table::ImportError;
