//! Words that go with numbers.

/// A number of things, such as `1 halt` and `2 halts`.
#[must_use]
pub(crate) fn count_of(count: usize, thing: &str) -> String {
    if count == 1 { format!("1 {thing}") } else { format!("{count} {thing}s") }
}
