//! Progress of long work, on standard error; nothing if that is no terminal, or if nothing is to be said.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output;

/// A bar for that many steps of what is being done.
pub fn bar(doing: &'static str, steps: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {bar:30} {percent} %, {eta} left");
    shown(ProgressBar::new(steps).with_message(doing))
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// A sign of life where nobody knows how long it takes.
pub fn spinner() -> ProgressBar {
    shown(ProgressBar::new_spinner())
}

fn shown(bar: ProgressBar) -> ProgressBar {
    if output::is_quiet() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}
