//! Programs of others, in Python.

use std::path::{Path, PathBuf};
use std::process::Command;

use agv_host_sim::data;
use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// Python with the packages that `cargo xtask test` installs. None, and a word about it, if one of `modules` is missing.
pub fn python(test: &str, modules: &str) -> Option<Command> {
    let command = || {
        let mut python = Command::new("python3");
        let inherited = std::env::var("PYTHONPATH").unwrap_or_default();
        python.env("PYTHONPATH", format!("{}:{inherited}", repository("target/python").display()));
        python
    };
    if command().args(["-c", &format!("import {modules}")]).output().is_ok_and(|run| run.status.success()) {
        return Some(command());
    }
    data::skip(test, &format!("python3 with {modules} is not there"));
    None
}

/// A drive of that many seconds through the hall.
pub fn hall(seconds: f64) -> Recording {
    let scenario = Scenario::read(&repository("host-sim/scenarios/warehouse_hall.toml")).unwrap();
    let mut recording = simulate(&scenario).unwrap().recording;
    let end = recording.truth[0].time.offset(seconds);
    recording.events.retain(|event| event.time().is_none_or(|time| time < end));
    recording.truth.retain(|truth| truth.time < end);
    recording
}
