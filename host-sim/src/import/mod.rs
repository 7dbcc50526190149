//! Recordings of others.

pub mod candump;
pub mod capture;
pub mod carmen;
pub mod carpark;
pub mod graph_log;
mod line_times;
#[cfg(feature = "bags")]
mod mounting;
pub mod optiodom;
pub mod packets;
mod posed_scan;
pub mod poses;
pub mod range_image;
pub mod raw;
#[cfg(feature = "bags")]
pub mod ros;
pub mod sapienza;
mod scan_drive;
mod scan_record;
mod table;
pub mod tcp_stream;
mod units;
pub mod wheel_recording;
pub mod wheel_table;

pub use posed_scan::{BEAMS, KEYPOINTS, PosedScan, RANGES, ScanLog};
pub use scan_drive::drive;

/// What is wrong with a line of that record.
fn missing_field(record: &str) -> String {
    format!("{record} has a field that is missing or no number")
}
