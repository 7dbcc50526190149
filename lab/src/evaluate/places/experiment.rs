//! One method on one log.

use std::time::Instant;

use agv_places::{Glare, GlareTables, PlaceIndex};
use rayon::prelude::*;
use serde::Serialize;

use super::{
    Answer, CANDIDATES, CurvePoint, DescribedScan, Judged, LEAST_CONFIDENCE, Memory, Method, Mode, PLACES, Protocol,
    figures, is_right, tables,
};
use agv_host_sim::import::PosedScan;

/// What is asked of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Combination {
    /// Which pairs count.
    pub protocol: Protocol,
    /// What is known when a question is asked.
    pub mode: Mode,
    /// Places that are looked at for each question; at most [`CANDIDATES`].
    pub candidates: usize,
    /// Keypoints that must support an answer.
    pub n_min: usize,
}

/// How a method answers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Which pairs count.
    pub protocol: Protocol,
    /// What is known when a question is asked.
    pub mode: Mode,
    /// How places are recognised.
    pub method: Method,
    /// Places that are looked at for each question.
    pub candidates: usize,
    /// Keypoints that must support an answer.
    pub n_min: usize,
    /// Least score of an answer beside that; none where the number of keypoints is the score.
    pub least_score: Option<f64>,
    /// Share of the accepted answers that are right.
    pub precision: f64,
    /// Share of the questions that count which got a right answer.
    pub recall: f64,
    /// Largest recall with a precision of at least 0.95, over all thresholds of the score.
    pub r95: f64,
    /// The same with a precision of at least 0.99.
    pub r99: f64,
    /// Largest harmonic mean of precision and recall.
    pub max_f1: f64,
    /// Share of the questions that count for which at least one candidate is associated rightly: no choice among the
    /// candidates could have a larger recall.
    pub ceiling: f64,
    /// Questions that count for recall.
    pub questions: usize,
    /// Time of a signature, us.
    pub signature_us: f64,
    /// Time of the search of the candidates of a question, us.
    pub search_us: f64,
    /// Time of the association with all candidates of a question, us.
    pub association_us: f64,
    /// Precision and recall over the threshold.
    #[serde(skip)]
    pub curve: Vec<CurvePoint>,
}

/// A log, described for one method.
pub struct Experiment {
    method: Method,
    scans: Vec<DescribedScan>,
    tables: GlareTables,
    index: Box<PlaceIndex<PLACES>>,
}

/// Questions of which times are measured.
const TIMED: usize = 200;

impl Experiment {
    /// Describes the scans of a log.
    #[must_use]
    pub fn new(method: Method, scans: &[PosedScan]) -> Self {
        let scans = DescribedScan::all(scans.get(..PLACES).unwrap_or(scans), method.detectors());
        let tables = tables();
        let mut index = Box::new(PlaceIndex::new());
        for scan in &scans {
            // No more scans are described than there is room for.
            let _ = index.push(method.signature(scan, &tables));
        }
        Self { method, scans, tables, index }
    }

    /// The scans.
    #[must_use]
    pub fn scans(&self) -> &[DescribedScan] {
        &self.scans
    }

    /// The best answer to one question, and whether any candidate was associated rightly.
    #[must_use]
    pub fn ask(&self, memory: &mut Memory, combination: &Combination, query: usize) -> (Option<(usize, Answer)>, bool) {
        let found = self.candidates(combination, query);
        let mut best: Option<(usize, Answer)> = None;
        let mut any_right = false;
        for &place in found.iter().take(combination.candidates) {
            if let Some(answer) = memory.associate(self.method, &self.scans[query], &self.scans[place]) {
                any_right |= is_right(&self.scans, query, place, &answer.pose);
                if best.is_none_or(|(_, best)| answer.score > best.score) {
                    best = Some((place, answer));
                }
            }
        }
        (best, any_right)
    }

    fn candidates(&self, combination: &Combination, query: usize) -> Vec<usize> {
        let mut found = heapless::Vec::new();
        let is_admissible =
            |place: u32| combination.protocol.admits(combination.mode, &self.scans, query, place as usize);
        self.method.search(&self.index, &self.index.signatures()[query], is_admissible, &mut found);
        found.iter().map(|candidate| candidate.place as usize).take(combination.candidates.min(CANDIDATES)).collect()
    }

    /// Asks all questions; `done` is called after each.
    #[must_use]
    pub fn run(&self, combination: &Combination, done: impl Fn() + Sync) -> Outcome {
        let asked: Vec<_> = (0..self.scans.len())
            .into_par_iter()
            .map_init(Memory::default, |memory, query| {
                let counts = combination.protocol.counts(combination.mode, &self.scans, query);
                let (best, any_right) = self.ask(memory, combination, query);
                done();
                let judged = best.map(|(place, answer)| Judged {
                    score: answer.score,
                    points: answer.points,
                    is_right: is_right(&self.scans, query, place, &answer.pose),
                    counts,
                });
                (judged, counts, counts && any_right)
            })
            .collect();
        let questions = asked.iter().filter(|(_, counts, _)| *counts).count();
        let answerable = asked.iter().filter(|(_, _, any_right)| *any_right).count();
        let judged: Vec<_> = asked.iter().filter_map(|(judged, _, _)| *judged).collect();
        let least_score = (self.method == Method::Improved).then_some(LEAST_CONFIDENCE);
        let rated = figures(&judged, questions, |answer| {
            answer.points >= combination.n_min && least_score.is_none_or(|least| answer.score >= least)
        });
        let [signature_us, search_us, association_us] = self.times(combination);
        Outcome {
            protocol: combination.protocol,
            mode: combination.mode,
            method: self.method,
            candidates: combination.candidates,
            n_min: combination.n_min,
            least_score,
            precision: rated.precision,
            recall: rated.recall,
            r95: rated.r95,
            r99: rated.r99,
            max_f1: rated.max_f1,
            ceiling: answerable as f64 / questions.max(1) as f64,
            questions,
            signature_us,
            search_us,
            association_us,
            curve: rated.curve,
        }
    }

    /// Times of a signature, a search and an association with all candidates, us, on one core.
    fn times(&self, combination: &Combination) -> [f64; 3] {
        let queries: Vec<_> = (0..self.scans.len()).step_by((self.scans.len() / TIMED).max(1)).collect();
        let each = |work: &mut dyn FnMut(usize)| {
            let start = Instant::now();
            for &query in &queries {
                work(query);
            }
            start.elapsed().as_secs_f64() * 1e6 / queries.len().max(1) as f64
        };
        let signature = each(&mut |query| {
            std::hint::black_box(self.method.signature(&self.scans[query], &self.tables));
        });
        let search = each(&mut |query| {
            let mut found = heapless::Vec::new();
            let signature: &Glare = &self.index.signatures()[query];
            self.method.search(&self.index, signature, |place| place as usize != query, &mut found);
            std::hint::black_box(&found);
        });
        let found: Vec<_> = queries.iter().map(|&query| (query, self.candidates(combination, query))).collect();
        let mut memory = Memory::default();
        let start = Instant::now();
        for (query, places) in &found {
            for &place in places {
                std::hint::black_box(memory.associate(self.method, &self.scans[*query], &self.scans[place]));
            }
        }
        let association = start.elapsed().as_secs_f64() * 1e6 / found.len().max(1) as f64;
        [signature, search, association]
    }
}
