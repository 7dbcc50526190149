//! Which hall, drive, noise and faults belong to a run: drawn by its seed for each kind of fault apart, so that runs of two
//! kinds with the same seed are independent of each other.

use agv_host_sim::simulate::random::{Random, Stream};

/// The seed of everything in the run of these kinds with that seed, below 2^53.
#[must_use]
pub fn scene<'a>(kinds: impl IntoIterator<Item = &'a str>, seed: u64) -> u64 {
    let named = kinds.into_iter().flat_map(|name| name.bytes().chain([0])).fold(OFFSET, hashed);
    let key = seed.to_le_bytes().into_iter().fold(named, hashed);
    (Random::new(key, Stream::Scenes).uniform() * (1_u64 << 53) as f64) as u64
}

/// FNV-1a of 64 bits (draft-eastlake-fnv): its offset basis, and its step with its prime.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const fn hashed(hash: u64, byte: u8) -> u64 {
    (hash ^ byte as u64).wrapping_mul(0x0100_0000_01b3)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::scene;

    #[test]
    fn scenes_of_kinds_and_seeds_are_apart() {
        let names = ["nothing", "carried on", "carried off", "power cut"];
        let alone = names.iter().flat_map(|name| (0..2000).map(|seed| scene([*name], seed)));
        let pairs = (0..2000).map(|seed| scene(["carried on", "power cut"], seed));
        let all: Vec<u64> = alone.chain(pairs).collect();
        assert!(all.iter().all(|scene| *scene < 1 << 53));
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
        // Names that only together read alike are other ones.
        assert_ne!(scene(["ab", "c"], 1), scene(["a", "bc"], 1));
    }
}
