//! Faults that take away what alone shows others.

use serde::{Deserialize, Serialize};

/// A source of the vehicle's, the faults that take it away, and those that it alone shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Blinding {
    /// The source.
    pub source: String,
    /// Kinds that take it away, each with the size from which on it does.
    pub taken_by: Vec<(String, f64)>,
    /// Kinds that nothing else shows.
    pub shows: Vec<String>,
}

impl Blinding {
    pub(super) fn names(&self) -> impl Iterator<Item = &String> {
        self.taken_by.iter().map(|(name, _)| name).chain(&self.shows)
    }

    /// Whether the source is taken by a fault of that kind and size, and another of that kind is shown by nothing else.
    pub(super) fn hides(&self, taking: (&str, f64), hidden: &str) -> bool {
        self.taken_by.iter().any(|(name, least)| name == taking.0 && taking.1 >= *least)
            && self.shows.iter().any(|name| name == hidden)
    }
}
