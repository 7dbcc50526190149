//! The controller on this machine.
#![cfg(unix)]

mod discrete;
mod flash_file;
mod recording;
mod vehicle;
