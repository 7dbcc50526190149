//! Tests that could not be made, which `cargo xtask test` counts and names.

use std::io::Write;

/// Says in one line that `test` is skipped because something that it needs is missing: on standard error, and in the file
/// that the environment variable `AGV_SKIPPED` names.
///
/// # Panics
/// If `CI` is `true`: there, everything must be there.
#[track_caller]
pub fn skip(test: &str, missing: &str) {
    note(test, missing);
    assert!(!is_complete(), "{test}: {missing}");
}

/// Says the same of a test that the machine was too busy for.
pub fn too_busy(test: &str) {
    note(test, "the machine is too busy to emulate a vehicle in real time");
}

/// Says the same of a test that needs a kernel which no package brings: even a machine that must be able to make every test may lack it.
pub fn no_kernel(test: &str, missing: &str) {
    note(test, missing);
}

/// Whether this machine must be able to make every test.
fn is_complete() -> bool {
    std::env::var_os("CI").is_some_and(|value| value == "true")
}

fn note(test: &str, reason: &str) {
    let line = format!("skipped: {test}, because {reason}\n");
    eprint!("{line}");
    if let Some(path) = std::env::var_os("AGV_SKIPPED")
        && let Ok(mut file) = std::fs::OpenOptions::new().create(true).append(true).open(path)
    {
        // A line that cannot be written changes nothing about the test.
        let _ = file.write_all(line.as_bytes());
    }
}
