//! The subcommands of `agv`, one file each.
//!
//! A subcommand is a clap `Args` structure with `run(self) -> anyhow::Result<()>`. Results go to standard output,
//! progress to standard error.

pub mod evaluate;
pub mod features;
pub mod import;
pub mod map;
pub mod nav350;
pub mod record;
pub mod replay;
pub mod simulate;
