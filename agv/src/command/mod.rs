//! The subcommands of `agv`, one file each.
//!
//! A subcommand is a clap `Args` structure with `run(self) -> anyhow::Result<()>`. Results go to standard output,
//! progress and notes to standard error.

pub mod accept;
pub mod calibrate;
pub mod campaign;
pub mod can;
pub mod check;
pub mod complaint;
pub mod completion;
pub mod ctl;
pub mod demonstration;
mod drive_summary;
pub mod emulate;
mod encoder_arguments;
pub mod evaluate;
pub mod export;
pub mod features;
pub mod import;
mod import_summary;
pub mod layout;
mod layout_input;
pub mod lidar3d;
mod like;
pub mod manual;
pub mod map;
pub mod nav350;
pub mod output;
pub mod panic_message;
pub mod places;
mod pose_argument;
mod posed_scans;
mod progress;
pub mod provision;
pub mod record;
pub mod replay;
pub mod report;
#[cfg(unix)]
pub mod run;
mod setting_arguments;
mod setting_text;
pub mod settings;
pub mod simulate;
mod stop;
mod summary;
mod vehicle_argument;
pub mod view;
