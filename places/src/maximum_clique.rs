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

    /// The first vertex; only the first `words` words are looked at, as below.
    fn first(&self, words: usize) -> Option<usize> {
        let (index, word) = self.0.iter().take(words).enumerate().find(|(_, word)| **word != 0)?;
        Some(index * WORD + word.trailing_zeros() as usize)
    }

    fn intersection(&self, other: &Self, words: usize) -> Self {
        let mut both = Self::EMPTY;
        for ((word, one), other) in both.0.iter_mut().zip(&self.0).zip(&other.0).take(words) {
            *word = one & other;
        }
        both
    }

    fn subtract(&mut self, other: &Self, words: usize) {
        for (word, mask) in self.0.iter_mut().zip(&other.0).take(words) {
            *word &= !mask;
        }
    }

    /// Number of vertices of the intersection.
    fn common(&self, other: &Self, words: usize) -> usize {
        self.0.iter().zip(&other.0).take(words).map(|(one, other)| (one & other).count_ones() as usize).sum()
    }

    fn len(&self, words: usize) -> usize {
        self.0.iter().take(words).map(|word| word.count_ones() as usize).sum()
    }
}

/// Passes over the vertices that drop those with too few neighbours.
const PRUNING_PASSES: usize = 2;

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
        let mut best = Clique { vertices: self.greedy_clique(), is_maximum: true };
        let mut chosen = Vec::<u16, DEPTH>::new();
        // The stack is the recursion: what may join the chosen, and of that what has not been tried.
        let mut stack = Vec::<(Set<WORDS>, Set<WORDS>), DEPTH>::new();
        let start = self.vertices_with_neighbours(best.vertices.len());
        let _ = stack.push((start, self.coloured_beyond(start, best.vertices.len())));
        let words = self.words();
        let mut steps = 0;
        while let Some((candidates, untried)) = stack.last_mut() {
            let Some(vertex) = untried.first(words) else {
                let _ = stack.pop();
                let _ = chosen.pop();
                continue;
            };
            untried.remove(vertex);
            candidates.remove(vertex);
            if steps >= most_steps {
                best.is_maximum = false;
                break;
            }
            steps += 1;
            let remaining = self.neighbours.get(vertex).map_or(Set::EMPTY, |set| set.intersection(candidates, words));
            if chosen.push(vertex as u16).is_err() {
                best.is_maximum = false;
                break;
            }
            if chosen.len() > best.vertices.len() {
                best.vertices.clone_from(&chosen);
            }
            let enough = best.vertices.len() - chosen.len();
            let branches =
                if remaining.len(words) > enough { self.coloured_beyond(remaining, enough) } else { Set::EMPTY };
            if branches == Set::EMPTY || stack.push((remaining, branches)).is_err() {
                let _ = chosen.pop();
            }
        }
        best
    }

    fn words(&self) -> usize {
        self.neighbours.len().div_ceil(WORD)
    }

    fn neighbours_among(&self, vertex: usize, candidates: &Set<WORDS>) -> Set<WORDS> {
        self.neighbours.get(vertex).map_or(Set::EMPTY, |set| set.intersection(candidates, self.words()))
    }

    /// A clique by always adding the vertex with most neighbours among what is left.
    fn greedy_clique(&self) -> Vec<u16, DEPTH> {
        let mut clique = Vec::new();
        let mut candidates = self.vertices_with_neighbours(0);
        while let Some(vertex) = self.busiest(&candidates) {
            if clique.push(vertex as u16).is_err() {
                break;
            }
            candidates = self.neighbours_among(vertex, &candidates);
        }
        clique
    }

    /// The candidate with most neighbours among the candidates.
    fn busiest(&self, candidates: &Set<WORDS>) -> Option<usize> {
        let words = self.words();
        let mut best = None;
        let mut rest = *candidates;
        while let Some(vertex) = rest.first(words) {
            rest.remove(vertex);
            let count = self.neighbours.get(vertex)?.common(candidates, words);
            if best.is_none_or(|(_, most)| count > most) {
                best = Some((vertex, count));
            }
        }
        best.map(|(vertex, _)| vertex)
    }

    /// Vertices with at least that many neighbours of their own kind: no others can be in a larger clique.
    fn vertices_with_neighbours(&self, least: usize) -> Set<WORDS> {
        let words = self.words();
        let mut kept = Set::EMPTY;
        for vertex in 0..self.neighbours.len() {
            kept.insert(vertex);
        }
        for _ in 0..PRUNING_PASSES {
            for (vertex, neighbours) in self.neighbours.iter().enumerate() {
                if neighbours.common(&kept, words) < least {
                    kept.remove(vertex);
                }
            }
        }
        kept
    }

    /// Colours the candidates greedily so that no neighbours have the same colour, and returns those that need more than
    /// `enough` colours: a clique with more vertices than that has one of them.
    fn coloured_beyond(&self, mut rest: Set<WORDS>, enough: usize) -> Set<WORDS> {
        let words = self.words();
        for _ in 0..enough {
            let mut class = rest;
            let mut is_empty = true;
            while let Some(vertex) = class.first(words) {
                is_empty = false;
                class.remove(vertex);
                rest.remove(vertex);
                if let Some(neighbours) = self.neighbours.get(vertex) {
                    class.subtract(neighbours, words);
                }
            }
            if is_empty {
                break;
            }
        }
        rest
    }
}
