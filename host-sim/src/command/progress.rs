//! Progress of long work, on standard error; nothing if that is no terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar for that many steps of what is being done.
pub fn bar(doing: &'static str, steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {bar:30} {percent} %, {eta} left");
    let bar = ProgressBar::new(steps).with_message(doing);
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
