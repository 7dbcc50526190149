//! The localiser on a desktop: simulation, replay, import, evaluation and reports.

pub mod bus;
pub mod calibrate;
pub mod campaign;
pub mod data;
pub mod emulate;
pub mod evaluate;
pub mod export;
pub mod file_kind;
pub mod import;
pub mod layout_check;
pub mod layout_file;
pub mod lidar3d;
pub mod link;
pub mod live;
pub mod log;
pub mod mapping;
pub mod places;
pub mod provision;
pub mod recording;
pub mod replay;
pub mod report;
pub mod ros;
pub mod serve;
pub mod simulate;
pub mod text_file;
pub mod view;
