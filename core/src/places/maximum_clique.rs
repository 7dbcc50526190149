//! The largest set of mutually connected vertices of a graph.

use heapless::Vec;

/// Bits of a word of a set.
const WORD: usize = 32;

/// A graph of up to `32 * WORDS` vertices, as the set of neighbours of each.
#[derive(Clone, Debug)]
pub(super) struct Graph<const VERTICES: usize, const WORDS: usize> {
    neighbours: Vec<Set<WORDS>, VERTICES>,
}

/// A set of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Set<const WORDS: usize>([u32; WORDS]);

impl<const WORDS: usize> Set<WORDS> {
    const EMPTY: Self = Self([0; WORDS]);

    fn insert(&mut self, vertex: usize) {
        if let Some(word) = self.0.get_mut(vertex / WORD) {
            *word |= 1 << (vertex % WORD);
        }
    }

    fn remove(&mut self, vertex: usize) {
        if let Some(word) = self.0.get_mut(vertex / WORD) {
            *word &= !(1 << (vertex % WORD));
        }
    }

    fn first(&self) -> Option<usize> {
        let (index, word) = self.0.iter().enumerate().find(|(_, word)| **word != 0)?;
        Some(index * WORD + word.trailing_zeros() as usize)
    }

    fn intersection(&self, other: &Self) -> Self {
        let mut both = *self;
        for (word, mask) in both.0.iter_mut().zip(&other.0) {
            *word &= mask;
        }
        both
    }

    fn subtract(&mut self, other: &Self) {
        for (word, mask) in self.0.iter_mut().zip(&other.0) {
            *word &= !mask;
        }
    }

    fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }
}

/// Largest clique that is looked for.
const DEPTH: usize = 64;

/// The outcome of a search.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Clique {
    /// Vertices, mutually connected.
    pub vertices: Vec<u16, DEPTH>,
    /// Whether the search ended before its limit, so that no clique is larger.
    pub is_maximum: bool,
}

impl<const VERTICES: usize, const WORDS: usize> Graph<VERTICES, WORDS> {
    pub(super) const fn new() -> Self {
        Self { neighbours: Vec::new() }
    }

    /// Removes all edges and makes the graph one of `count` vertices, as far as there is room.
    pub(super) fn reset(&mut self, count: usize) {
        self.neighbours.clear();
        for _ in 0..count.min(VERTICES).min(WORDS * WORD) {
            let _ = self.neighbours.push(Set::EMPTY);
        }
    }

    pub(super) fn connect(&mut self, first: usize, second: usize) {
        if let Some(set) = self.neighbours.get_mut(first) {
            set.insert(second);
        }
        if let Some(set) = self.neighbours.get_mut(second) {
            set.insert(first);
        }
    }

    /// Finds a largest clique by branch and bound: the number of colours that a greedy colouring needs bounds what a set
    /// can add. Gives up after `most_steps` branches and then returns the largest clique seen.
    pub(super) fn maximum_clique(&self, most_steps: u32) -> Clique {
        let mut best = Clique { vertices: Vec::new(), is_maximum: true };
        let mut all = Set::EMPTY;
        for vertex in 0..self.neighbours.len() {
            all.insert(vertex);
        }
        let mut chosen = Vec::<u16, DEPTH>::new();
        let mut sets = Vec::<Set<WORDS>, DEPTH>::new();
        let _ = sets.push(all);
        let mut steps = 0;
        // The stack of candidate sets is the recursion; a set loses the vertex that was tried in it.
        while let Some(candidates) = sets.last().copied() {
            let bound = chosen.len() + self.colours(&candidates, best.vertices.len().saturating_sub(chosen.len()));
            let next = candidates.first();
            let (Some(_), true, true) = (next, bound > best.vertices.len(), steps < most_steps) else {
                if steps >= most_steps && next.is_some() && bound > best.vertices.len() {
                    best.is_maximum = false;
                }
                let _ = sets.pop();
                let _ = chosen.pop();
                continue;
            };
            steps += 1;
            // The vertex with most neighbours among the candidates leads to large cliques first.
            let Some((vertex, remaining)) = self.busiest(&candidates) else { break };
            if let Some(set) = sets.last_mut() {
                set.remove(vertex);
            }
            if chosen.push(vertex as u16).is_err() {
                break;
            }
            if chosen.len() > best.vertices.len() {
                best.vertices.clone_from(&chosen);
            }
            if remaining.len() == 0 || sets.push(remaining).is_err() {
                let _ = chosen.pop();
            }
        }
        best
    }

    /// The candidate with most neighbours among the candidates, and those neighbours.
    fn busiest(&self, candidates: &Set<WORDS>) -> Option<(usize, Set<WORDS>)> {
        let mut best: Option<(usize, Set<WORDS>, usize)> = None;
        let mut rest = *candidates;
        while let Some(vertex) = rest.first() {
            rest.remove(vertex);
            let set = self.neighbours.get(vertex)?.intersection(candidates);
            let count = set.len();
            if best.as_ref().is_none_or(|(_, _, most)| count > *most) {
                best = Some((vertex, set, count));
            }
        }
        best.map(|(vertex, set, _)| (vertex, set))
    }

    /// Number of colours of a greedy colouring, none of whose classes holds neighbours; counts no further than one above
    /// `enough`.
    fn colours(&self, candidates: &Set<WORDS>, enough: usize) -> usize {
        let mut rest = *candidates;
        let mut colours = 0;
        while rest != Set::EMPTY && colours <= enough {
            colours += 1;
            let mut class = rest;
            while let Some(vertex) = class.first() {
                class.remove(vertex);
                rest.remove(vertex);
                if let Some(neighbours) = self.neighbours.get(vertex) {
                    class.subtract(neighbours);
                }
            }
        }
        colours
    }
}
