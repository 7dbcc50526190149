//! The controller on this machine.
#![cfg(unix)]

mod flash_file;
mod vehicle;
