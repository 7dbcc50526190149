//! What is said when a command fails: one line.

/// The reasons of a failure from the outermost to the innermost, each once: many errors say their reason themselves.
pub fn line(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for reason in error.chain() {
        let reason = reason.to_string();
        if text.ends_with(&reason) {
            continue;
        }
        if !text.is_empty() {
            text += ": ";
        }
        text += &reason;
    }
    // Some libraries speak in several lines.
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}
