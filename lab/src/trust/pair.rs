//! Pairs of faults, and those of which one takes away every source that could show the other.

use agv_host_sim::simulate::random::{Random, Stream};

use super::blinding::Blinding;
use super::kinds::{Catalogue, Kind};

impl Catalogue {
    /// The source that one of two faults takes away, if nothing else shows the other.
    #[must_use]
    pub fn hidden_by(&self, one: (&str, f64), other: (&str, f64)) -> Option<&str> {
        let hides = |blinding: &&Blinding| blinding.hides(one, other.0) || blinding.hides(other, one.0);
        self.blinding.iter().find(hides).map(|blinding| blinding.source.as_str())
    }
}

/// Two kinds that differ, each at one of its sizes, drawn by the seed; none if there are not two.
#[must_use]
pub fn draw(kinds: &[Kind], seed: u64) -> Option<[(&Kind, f64); 2]> {
    let mut random = Random::new(seed, Stream::Pairs);
    let mut below = |count: usize| ((random.uniform() * count as f64) as usize).min(count.saturating_sub(1));
    let first = below(kinds.len());
    let second = below(kinds.len().checked_sub(1)?);
    let second = if second < first { second } else { second + 1 };
    let mut at = |place: usize| {
        let kind = kinds.get(place)?;
        let sizes = kind.every_size();
        Some((kind, *sizes.get(below(sizes.len()))?))
    };
    Some([at(first.min(second))?, at(first.max(second))?])
}
