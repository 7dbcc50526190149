//! The image that is flashed, in the emulated STM32H743: `tests/chip` judges, this asks it.

use std::process::{Command, Output};

use agv_tests::{image, python, repository, skip};
use serde_json::Value;

/// Fewer checks than this were not all.
const LEAST: usize = 20;

fn chip(arguments: &[&str]) -> Output {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    Command::new(cargo).args(["xtask", "chip"]).args(arguments).current_dir(repository("")).output().unwrap()
}

#[test]
fn the_flashed_image_lives_in_the_emulated_chip() {
    const TEST: &str = "the_flashed_image_lives_in_the_emulated_chip";
    if image(TEST, "h743", "vehicle").is_none() || python(TEST, "unicorn, elftools").is_none() {
        return;
    }
    if !Command::new("cc").arg("--version").output().is_ok_and(|run| run.status.success()) {
        return skip(TEST, "there is no compiler for C (Debian package gcc)");
    }
    let output = chip(if std::env::var_os("AGV_LONG").is_some() { &["--long"] } else { &[] });
    let printed = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<Value> = printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(answers.len() >= LEAST, "{} checks:\n{}", answers.len(), String::from_utf8_lossy(&output.stderr));
    let failed: Vec<&Value> = answers.iter().filter(|answer| answer["passed"] != true).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
