//! The localiser on a desktop: simulation, replay, import, evaluation and reports.

pub mod acceptance;
pub mod account;
pub mod accuracy;
pub mod bus;
pub mod calibrate;
pub mod contour_map;
pub mod data;
pub mod delimited;
pub mod drive;
pub mod drive_check;
pub mod emulate;
pub mod export;
pub mod file_kind;
pub mod foreign_code;
pub mod hdl64e_packets;
pub mod import;
pub mod layout_check;
pub mod layout_file;
pub mod left_out;
pub mod lidar3d;
pub mod link;
pub mod live;
pub mod log;
pub mod mapping;
mod odometry_steps;
pub mod output_file;
pub mod places;
pub mod provision;
pub mod recording;
pub mod replay;
pub mod report;
#[cfg(feature = "bags")]
pub mod ros;
#[cfg(unix)]
pub mod run;
pub mod serve;
pub mod setting_doubts;
pub mod setting_meanings;
pub mod simulate;
pub mod sync;
pub mod text_file;
pub mod view;
mod wording;
