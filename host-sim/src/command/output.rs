//! Results on standard output.

use std::io::{ErrorKind, Write, stdout};

use anyhow::Context;

/// Prints results. A reader that has seen enough and goes away is no fault.
pub fn print(text: &str) -> anyhow::Result<()> {
    match writeln!(stdout().lock(), "{text}") {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("the results cannot be printed"),
    }
}

/// Prints names and values in two columns.
pub fn print_rows(rows: &[[String; 2]]) -> anyhow::Result<()> {
    let lines: Vec<String> = rows.iter().map(|[name, value]| format!("{name:<24} {value}")).collect();
    print(&lines.join("\n"))
}
