//! Results on standard output, and what is said beside them.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use agv_host_sim::output_file;
use anyhow::Context;

static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// From now on neither progress nor notes are shown.
pub fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Whether neither progress nor notes are shown.
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Says something that is no result, on standard error.
pub fn note(text: &str) {
    if !is_quiet() {
        eprintln!("{text}");
    }
}

/// Refuses a file that could not be written at the end of a long run.
pub fn check_files<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> anyhow::Result<()> {
    paths.into_iter().try_for_each(|path| output_file::check(path).with_context(|| path.display().to_string()))
}

/// Prints names and values in two columns.
pub fn print_rows(rows: &[[String; 2]]) {
    for [name, value] in rows {
        println!("{name:<24} {value}");
    }
}
