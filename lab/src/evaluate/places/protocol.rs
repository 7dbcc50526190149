//! What counts as a loop.

use agv_core::geometry::{Pose, difference};
use serde::Serialize;

use super::DescribedScan;

/// Which pairs of scans count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Protocol {
    /// K 4.2: neighbours in time are allowed; all queries count.
    Thesis,
    /// Candidates within 50 scans or 10 s of the query are not allowed; only queries that truly have an allowed scan within
    /// 0.5 m and 30 degrees count for recall, all queries count for precision.
    Honest,
}

/// What is known when a question is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// All other scans.
    Offline,
    /// Earlier scans; by the thesis protocol only those taken further than 0.2 m or 0.35 rad away (K 4.2.2).
    Online,
}

/// An answer with larger errors of position (m) or heading (rad) is wrong (K 4.2.1).
const RIGHT: (f64, f64) = (0.5, 10.0 * std::f64::consts::PI / 180.0);

/// A scan further away than this (m, rad) does not make a query one that can be answered.
const ANSWERABLE: (f64, f64) = (0.5, 30.0 * std::f64::consts::PI / 180.0);

const SCANS_BETWEEN: usize = 50;
const SECONDS_BETWEEN: f64 = 10.0;
const AWAY: (f64, f64) = (0.2, 0.35);

impl Protocol {
    /// Whether scan `candidate` may be an answer to the question where scan `query` was taken.
    #[must_use]
    pub fn admits(self, mode: Mode, scans: &[DescribedScan], query: usize, candidate: usize) -> bool {
        if candidate == query || (mode == Mode::Online && candidate > query) {
            return false;
        }
        let (asked, offered) = (&scans[query], &scans[candidate]);
        match (self, mode) {
            (Self::Thesis, Mode::Offline) => true,
            (Self::Thesis, Mode::Online) => {
                let (a, b) = (&asked.laser, &offered.laser);
                (a.x - b.x).abs() > AWAY.0 || (a.y - b.y).abs() > AWAY.0 || difference(a.theta, b.theta).abs() > AWAY.1
            }
            (Self::Honest, _) => {
                query.abs_diff(candidate) > SCANS_BETWEEN && asked.time.since(offered.time).abs() > SECONDS_BETWEEN
            }
        }
    }

    /// Whether a query counts for recall.
    #[must_use]
    pub fn counts(self, mode: Mode, scans: &[DescribedScan], query: usize) -> bool {
        match self {
            Self::Thesis => true,
            Self::Honest => (0..scans.len()).any(|candidate| {
                let apart = scans[candidate].laser.between(&scans[query].laser);
                apart.position().norm() <= ANSWERABLE.0
                    && apart.theta.abs() <= ANSWERABLE.1
                    && self.admits(mode, scans, query, candidate)
            }),
        }
    }
}

/// Whether `pose`, the pose of the query in the frame of the answer, is right.
#[must_use]
pub fn is_right(scans: &[DescribedScan], query: usize, answer: usize, pose: &Pose) -> bool {
    let truth = scans[answer].laser.between(&scans[query].laser);
    let error = truth.between(pose);
    error.position().norm() < RIGHT.0 && error.theta.abs() < RIGHT.1
}
