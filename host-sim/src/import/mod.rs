//! Recordings of others.

pub mod can_log;
mod can_times;
pub mod candump;
pub mod capture;
pub mod carmen;
mod carmen_parameters;
pub mod carpark;
mod fragments;
pub mod graph_log;
mod line_times;
pub mod optiodom;
pub mod overheard;
pub mod packets;
pub mod peak_trc;
mod posed_scan;
pub mod poses;
pub mod range_image;
pub mod raw;
#[cfg(feature = "bags")]
pub mod ros;
pub mod sapienza;
mod scan_drive;
mod scan_record;
mod summary;
mod table;
pub mod tcp_stream;
mod units;
pub mod vector_asc;
pub mod wheel_recording;
pub mod wheel_table;

pub use posed_scan::{BEAMS, KEYPOINTS, PosedScan, RANGES, ScanLog};
pub use scan_drive::drive;
pub use summary::{ImportSummary, Imported, LONGEST_GAP};

/// What is wrong with a line of that record.
fn missing_field(record: &str) -> String {
    format!("{record} has a field that is missing or no number")
}
