//! A scan aligned to a stored place, and how much of it agrees.
//!
//! The floor plan of what stands on the floor is laid over that of the stored panorama, coarsely at many starts, then finer.

use std::vec::Vec;

use super::agreement::{Agreement, Voters, is_standing, thinned};
use super::floor_plan::{CELL, FloorPlan, occupied};
use super::panorama::Panorama;
use super::pose::Pose;
use super::refinement::refined;

/// Deviations of the plan that is searched coarsely and finely, m.
const BLUR: [f32; 2] = [0.45, 0.2];
/// Points that are laid over the plan, coarsely and finely.
const POINTS: [usize; 2] = [300, 900];
/// Coarse starts: turns to both sides of a heading, rad, and steps to the sides, cells of the plan.
const TURNS: [f32; 5] = [-0.0698, -0.0349, 0.0, 0.0349, 0.0698];
const STRIDE: usize = 3;
/// Places at each heading that are looked at, how many of all, and how many go on.
///
/// Where sensors have hidden sectors, other places often fit the plan better than the right one: the plan does not know
/// what was seen through.
const PLACES: usize = 3;
const LOOKED_AT: usize = 40;
const STARTS: usize = 4;
/// Steps of the climb: m and rad, and how often they are halved.
const CLIMB: [f32; 2] = [0.4, 0.0175];
const HALVINGS: usize = 5;
/// A climb of more steps than this at one size is no climb any more.
const STEPS: usize = 20;
/// A refined pose whose score is less by no more than this is the better one: scores do not show centimetres.
const EQUAL: f32 = 0.02;

/// What an alignment found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Where the asked scan lies in the stored place.
    pub pose: Pose,
    /// How much of the floor plan agrees.
    pub agreement: Agreement,
}

/// A stored place, ready for alignments.
pub struct Stored<'a> {
    voters: Voters<'a>,
    plans: [FloorPlan; 2],
}

/// A scan that is asked for: its panorama, and its points with their heights above the floor, m.
pub struct Asked<'a> {
    pub(super) voters: Voters<'a>,
    /// The points that are laid over a plan coarsely and finely.
    few: Vec<[f32; 3]>,
    many: Vec<[f32; 3]>,
}

impl<'a> Asked<'a> {
    /// Of levelled points.
    #[must_use]
    pub fn new(panorama: &'a Panorama, points: impl Iterator<Item = [f32; 3]>) -> Self {
        let standing: Vec<[f32; 3]> = points.filter(is_standing).collect();
        let [few, many] = POINTS.map(|count| thinned(&standing, count));
        Self { voters: Voters::new(panorama, &standing), few, many }
    }
}

impl<'a> Stored<'a> {
    /// Of its panorama.
    #[must_use]
    pub fn new(panorama: &'a Panorama) -> Self {
        let points: Vec<[f32; 3]> = panorama.points().filter(is_standing).collect();
        let voters = Voters::new(panorama, &points);
        let occupied = occupied(&points);
        let plans = BLUR.map(|blur| FloorPlan::new(&occupied, blur, &voters.knows));
        Self { voters, plans }
    }

    /// Aligns a scan that is turned about as one of some headings, rad, counter-clockwise, and at most `reach` away in each
    /// direction, m. None if nothing stands about either.
    #[must_use]
    pub fn align(&self, asked: &Asked<'_>, headings: &[f32], reach: f32) -> Option<Alignment> {
        if asked.few.is_empty() || self.voters.is_empty() {
            return None;
        }
        let [coarse, fine] = &self.plans;
        let climbed = self.starts(asked, headings, reach).into_iter().map(|pose| {
            let pose = climb(coarse, &asked.few, pose);
            climb(fine, &asked.many, pose)
        });
        let scored = |pose: Pose| Alignment { pose, agreement: self.voters.agreement(&asked.voters, &pose) };
        let found = climbed.map(scored).max_by(|a, b| a.agreement.score.total_cmp(&b.agreement.score))?;
        let refined = scored(refined(self.voters.panorama, &asked.many, found.pose));
        Some(if refined.agreement.score > found.agreement.score - EQUAL { refined } else { found })
    }

    /// Where the search goes on: of the places that fit the plan, those that agree roughly.
    fn starts(&self, asked: &Asked<'_>, headings: &[f32], reach: f32) -> Vec<Pose> {
        let stride = STRIDE as f32 * CELL;
        let steps = (reach / stride) as usize;
        let at = |heading: f32| {
            let found = self.plans[0].best_steps(&asked.few, heading, steps, STRIDE, PLACES).into_iter();
            found.map(move |(step, fit)| (fit, Pose { place: step.map(|step| stride * step as f32), heading }))
        };
        let best_first = |starts: &mut Vec<(f32, Pose)>| starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let turned = headings.iter().flat_map(|heading| TURNS.map(|turn| heading + turn));
        let mut starts: Vec<(f32, Pose)> = turned.flat_map(at).collect();
        best_first(&mut starts);
        starts.truncate(LOOKED_AT);
        for (fit, pose) in &mut starts {
            *fit = self.voters.rough_agreement(&asked.few, pose);
        }
        best_first(&mut starts);
        starts.into_iter().take(STARTS).map(|(_, pose)| pose).collect()
    }
}

/// Steps to a neighbour as long as it fits better, ever smaller.
fn climb(plan: &FloorPlan, points: &[[f32; 3]], start: Pose) -> Pose {
    let mut best = (plan.fit(points, &start), start);
    let [mut step, mut turn] = CLIMB;
    for _ in 0..HALVINGS {
        for _ in 0..STEPS {
            let Pose { place: [x, y], heading } = best.1;
            let around = [
                ([x + step, y], heading),
                ([x - step, y], heading),
                ([x, y + step], heading),
                ([x, y - step], heading),
                ([x, y], heading + turn),
                ([x, y], heading - turn),
            ];
            let neighbours = around.map(|(place, heading)| {
                let pose = Pose { place, heading };
                (plan.fit(points, &pose), pose)
            });
            match neighbours.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(better) if better.0 > best.0 => best = better,
                _ => break,
            }
        }
        step /= 2.0;
        turn /= 2.0;
    }
    best.1
}
