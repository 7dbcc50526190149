//! The images that are flashed, each in its emulated chip: `tests/chip` judges, this asks it.

use std::process::{Command, Output};

use agv_tests::{image, python, repository, skip};
use serde_json::Value;

/// Fewer checks than this were not all.
const LEAST: usize = 20;

/// What is asked of the smaller board where not everything is: what its single bank of flash, its clocks and its memory change.
const OF_ONE_BANK: [&str; 6] = [
    "boots",
    "has_the_clocks_of_the_manual",
    "says_before_it_stands_still",
    "starts_within_a_second_when_full",
    "a_stack_that_is_full_is_told",
    "writes_after_an_error",
];

fn chip(arguments: &[&str]) -> Output {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    Command::new(cargo).args(["xtask", "chip"]).args(arguments).current_dir(repository("")).output().unwrap()
}

/// Asks for checks of a board, all if none is named, and fails if one has failed or fewer have answered.
fn check(test: &str, board: &str, checks: &[&str]) {
    if image(test, board, "vehicle").is_none() || python(test, "unicorn, elftools").is_none() {
        return;
    }
    if !Command::new("cc").arg("--version").output().is_ok_and(|run| run.status.success()) {
        return skip(test, "there is no compiler for C (Debian package gcc)");
    }
    let is_long = std::env::var_os("AGV_LONG").is_some();
    let mut arguments = vec!["--board", board];
    arguments.extend(if is_long { &["--long"][..] } else { checks });
    let output = chip(&arguments);
    let printed = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<Value> = printed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let least = if is_long || checks.is_empty() { LEAST } else { checks.len() };
    assert!(answers.len() >= least, "{} checks:\n{}", answers.len(), String::from_utf8_lossy(&output.stderr));
    let failed: Vec<&Value> = answers.iter().filter(|answer| answer["passed"] != true).collect();
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_flashed_image_lives_in_the_emulated_chip() {
    check("the_flashed_image_lives_in_the_emulated_chip", "h743", &[]);
}

#[test]
fn the_image_of_the_smaller_board_lives_in_its_chip() {
    check("the_image_of_the_smaller_board_lives_in_its_chip", "h723", &OF_ONE_BANK);
}
