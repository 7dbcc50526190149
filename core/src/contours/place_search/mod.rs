//! Where in a kept map a scan was taken, with no prior: in steps, none of which takes long.
//!
//! All places are looked at from coarse to fine, by what cannot be excluded. Those that remain are laid onto the surfaces, and judged from
//! both sides: how much of the scan lies on surfaces of the map, and how many of the surfaces that should be in sight the scan shows,
//! rather than the free space behind them. Where many remain, as along a corridor, that is done with some of the points first, and with
//! all of them where that fits nearly as well as at the best. Only a clear gap to the second makes an answer.

pub(super) mod best_places;
mod bit_planes;
mod coarse_search;
mod place_grid;
mod range_profile;
mod settling;
mod support;

use core::num::NonZeroUsize;

use heapless::Vec;

use best_places::{BestPlaces, Candidate, Held, PlaceAnswer, PlaceFix};
use coarse_search::{CoarseSearch, PLACES, Place};
use place_grid::PlaceGrid;
use range_profile::{InSight, RangeProfile};
use settling::Settling;
use support::{Support, Verdict};

use super::kept_map::{Loading, corner};
use super::matcher::weak_axis;
use super::refinement::Refining;
use super::{KeptMap, SearchResult, SearchWindow, Submap, SurfacePoint, TILE, find_surface_points, search};
use crate::geometry::{Pose, ScanPoint, Transform, wrap};
use crate::sensing::PointView;

/// Whether a search has ended.
#[expect(clippy::large_enum_variant, reason = "there is no heap, and one such value at a time")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaceProgress {
    /// There is more to look at.
    Searching,
    /// All has been looked at.
    Done(PlaceAnswer),
}

/// A place is believed only if so much of the scan lies on surfaces,
const LEAST_SHARE: f32 = 0.55;

/// of at least so many points within its reach,
const FEWEST: usize = 40;

/// and so many of the surfaces in sight are shown.
const LEAST_SHOWN: f32 = 0.55;

/// A place is looked at closely if scan and map agree there this much as well as at the best one.
const WORTH: f32 = 0.6;

/// If there are more places than these, each is glanced at by one of so many points,
const FEW_PLACES: usize = 6;
const GLANCE: NonZeroUsize = NonZeroUsize::MIN.saturating_add(4);

/// left out if so few of them lie on surfaces,
const LEAST_GLANCE: f32 = 0.45;

/// or if there is a place where scan and map agree so much better.
const WORTH_ALL: f32 = 0.75;

/// All points are taken.
const ALL: NonZeroUsize = NonZeroUsize::MIN;

/// Turns to each side of a place that are searched, and the angle between them, rad.
const TURNS: i32 = 3;
const TURN: f64 = 0.03;

/// What is searched at each of them.
const WINDOW: SearchWindow = SearchWindow { shifts: 2, shift: 3, turns: 0, turn: 0.0, distance: 1.0 };

/// A place is laid onto the surfaces if the search gives it so much of what it gave the best one before.
const PROMISING: f32 = 0.5;

/// Points of a map, or of a submap, that are taken in one step.
const POINTS_A_STEP: usize = 64;

/// Points of a scan that are laid onto a submap in one step.
const REFINED_A_STEP: usize = 32;

/// What the steps cost, in points that are looked up in a grid, about 15 instructions each.
const MARK_EFFORT: i64 = 40 * POINTS_A_STEP as i64;
const LOAD_EFFORT: i64 = 25 * POINTS_A_STEP as i64;
const TURN_EFFORT: i64 = 2_500;
const REFINE_EFFORT: i64 = 40 * REFINED_A_STEP as i64;
const LOOK_EFFORT: i64 = 15 * POINTS_A_STEP as i64;

/// What a point of a scan costs that is laid onto all of the map, beside the points of the map that are looked at.
const SETTLE_EFFORT: i64 = 200;

/// Things agree with a place that is within this of where they have it, m,
const AGREED: f32 = 0.051;

/// or else it is shifted, so often at the most.
const MOST_SHIFTS: u8 = 3;

/// The axis along which surfaces say least of a place, or the one across it.
fn axis_of(fix: &PlaceFix, is_across: bool) -> ScanPoint {
    let (xx, xy, yy) = (fix.information.m11, fix.information.m12, fix.information.m22);
    let strong = 0.5 * libm::atan2(2.0 * xy, xx - yy);
    let (sine, cosine) = libm::sincos(strong);
    if is_across { ScanPoint::new(cosine as f32, sine as f32) } else { ScanPoint::new(-sine as f32, cosine as f32) }
}

/// What is to be done next.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Nothing: there is no scan, or the search has ended.
    None,
    /// Marking points of a tile in the grid.
    Mark { tile: usize, point: usize },
    /// Looking at the cells of the grid.
    Search,
    /// Choosing the next place.
    Choose,
    /// Loading what is around a place.
    Load(usize, Loading),
    /// Searching around it.
    Turn { place: usize, turn: i32, best: SearchResult },
    /// Laying the scan onto the surfaces.
    Refine(usize, Refining),
    /// Looking for surfaces that should be in sight.
    Look { place: usize, fix: PlaceFix, point: usize, found: InSight },
    /// Laying the scan onto all of the map at one of the best places.
    Settle { place: usize, settling: Settling },
    /// Asking which things hold one of them along one axis, and across it.
    Ask { place: usize, is_across: bool, support: Support },
    /// Telling the answer.
    Answer,
}

/// What is known of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Glance {
    /// All has been looked at.
    Done,
    /// Nothing yet.
    None,
    /// How well some of the points and the map agree there, in parts of 255.
    Overlap(u8),
}

/// Searches by `POINTS` points of a scan, with `CELLS` cells for all of the map.
///
/// What is around a place is loaded into a submap that is lent to each step: nobody else may change it while a search is under way.
#[derive(Clone, Debug)]
pub struct PlaceSearch<const POINTS: usize = 400, const CELLS: usize = 49_152> {
    grid: PlaceGrid<CELLS>,
    has_grid: bool,
    points: Vec<SurfacePoint, POINTS>,
    profile: RangeProfile,
    coarse: CoarseSearch,
    step: Step,
    /// What is known of the places.
    glances: [Glance; PLACES],
    /// The best overlap of a glance, in parts of 255.
    best_glance: u8,
    best: BestPlaces,
    /// The best score of a search around a place.
    score: f32,
    /// Times the place that is looked at was shifted to where most things have it.
    shifts: u8,
    /// Effort that was spent beyond what was allowed.
    debt: u32,
}

impl<const POINTS: usize, const CELLS: usize> PlaceSearch<POINTS, CELLS> {
    /// A search with nothing to do.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            grid: PlaceGrid::new(),
            has_grid: false,
            points: Vec::new(),
            profile: RangeProfile::new(),
            coarse: CoarseSearch::new(),
            step: Step::None,
            glances: [Glance::None; PLACES],
            best_glance: 0,
            best: BestPlaces::new(),
            score: 0.0,
            shifts: 0,
            debt: 0,
        }
    }

    /// The map has been replaced; a search that is under way is given up.
    pub fn forget_map(&mut self) {
        self.has_grid = false;
        self.step = Step::None;
    }

    /// Begins to search where a scan was taken; one that is under way is given up.
    pub fn begin(&mut self, scan: PointView<'_>) {
        find_surface_points(scan, &mut self.points);
        self.profile.set(scan);
        self.best.clear();
        self.score = 0.0;
        self.glances = [Glance::None; PLACES];
        self.best_glance = 0;
        self.debt = 0;
        let is_enough = self.coarse.begin(&self.points);
        self.step = match (is_enough, self.has_grid) {
            (false, _) => Step::None,
            (true, true) => Step::Search,
            (true, false) => Step::Mark { tile: 0, point: 0 },
        };
    }

    /// Goes on until `effort` is spent: a point that is looked up is one, about 15 instructions. What the last step, of at most some
    /// thousand, takes beyond it is spent of the next call's.
    pub fn advance<const ROOM: usize>(
        &mut self,
        map: &KeptMap,
        submap: &mut Submap<ROOM>,
        effort: u32,
    ) -> PlaceProgress {
        let mut left = i64::from(effort) - i64::from(self.debt);
        self.debt = 0;
        while left > 0 {
            let next = match self.step {
                Step::None => return PlaceProgress::Done(PlaceAnswer::TooFew),
                Step::Answer => {
                    self.step = Step::None;
                    return PlaceProgress::Done(self.best.answer(self.coarse.is_crowded()));
                }
                Step::Mark { tile, point } => self.mark(map, submap, (tile, point), &mut left),
                Step::Search if self.coarse.advance(&self.grid, &mut left) => Step::Search,
                Step::Search | Step::Choose => self.choose(submap),
                Step::Load(place, loading) => self.load(map, submap, (place, loading), &mut left),
                Step::Turn { place, turn, best } => self.turn(submap, place, (turn, best), &mut left),
                Step::Refine(place, refining) => self.refine(submap, place, refining, &mut left),
                Step::Look { place, fix, point, found } => self.look(submap, (place, &fix), (point, found), &mut left),
                Step::Settle { place, settling } => self.settle(map, place, settling, &mut left),
                Step::Ask { place, is_across, support } => self.ask(map, (place, is_across), support, &mut left),
            };
            self.step = next;
        }
        self.debt = u32::try_from(-left).unwrap_or(u32::MAX);
        PlaceProgress::Searching
    }

    fn mark<const ROOM: usize>(
        &mut self,
        map: &KeptMap,
        submap: &mut Submap<ROOM>,
        (tile, point): (usize, usize),
        left: &mut i64,
    ) -> Step {
        if (tile, point) == (0, 0) {
            // What is in it may be of another map.
            submap.begin(&Pose::default());
            if !self.grid.begin(map) {
                return Step::Answer;
            }
        }
        let Some(place) = map.place(tile) else {
            self.has_grid = true;
            return Step::Search;
        };
        let (corner, points) = (corner(place), map.points_of(tile));
        for surface in points.some(point, POINTS_A_STEP) {
            self.grid.add(&(corner + surface.position.cast::<f64>()), &surface);
        }
        *left -= MARK_EFFORT;
        let next = point + POINTS_A_STEP;
        if next < points.len() { Step::Mark { tile, point: next } } else { Step::Mark { tile: tile + 1, point: 0 } }
    }

    /// The next place: one that is within what is loaded, or else the best.
    fn choose<const ROOM: usize>(&mut self, submap: &mut Submap<ROOM>) -> Step {
        let places = self.coarse.places().iter().zip(&self.glances).enumerate();
        let least = WORTH_ALL * f32::from(self.best_glance);
        let is_open = |glance: Glance| match glance {
            Glance::Done => false,
            Glance::None => true,
            // After the last glance.
            Glance::Overlap(overlap) => f32::from(overlap) >= least,
        };
        let has_unseen = places.clone().any(|(_, (_, glance))| *glance == Glance::None);
        let open = places.filter(|(_, (_, glance))| is_open(**glance) && (**glance == Glance::None) == has_unseen);
        let origin = *submap.origin();
        let is_loaded = |place: &Place| {
            let apart = place.pose.position() - origin.position();
            !submap.is_empty() && apart.amax() < TILE
        };
        let loaded = open.clone().find(|(_, (place, _))| is_loaded(place));
        let first = open.max_by_key(|(number, (_, glance))| (**glance, core::cmp::Reverse(*number)));
        let Some((number, (place, _))) = loaded.or(first) else { return self.first_settling(0) };
        if loaded.is_some() {
            return self.first_look(submap, number);
        }
        match Loading::begin(place.pose.x, place.pose.y, submap) {
            Some(loading) => Step::Load(number, loading),
            None => self.end(number),
        }
    }

    /// A place has been looked at.
    fn end(&mut self, place: usize) -> Step {
        if let Some(glance) = self.glances.get_mut(place) {
            *glance = Glance::Done;
        }
        Step::Choose
    }

    fn load<const ROOM: usize>(
        &mut self,
        map: &KeptMap,
        submap: &mut Submap<ROOM>,
        (place, mut loading): (usize, Loading),
        left: &mut i64,
    ) -> Step {
        *left -= LOAD_EFFORT;
        if loading.step(map, POINTS_A_STEP, submap) {
            Step::Load(place, loading)
        } else {
            self.first_look(submap, place)
        }
    }

    /// Begins to look at a place: searches around it first, if that is the first time.
    fn first_look<const ROOM: usize>(&mut self, submap: &Submap<ROOM>, place: usize) -> Step {
        let (Some(found), Some(glance)) = (self.coarse.places().get(place), self.glances.get(place)) else {
            return self.end(place);
        };
        let pose = submap.origin().between(&found.pose);
        match glance {
            Glance::Overlap(_) => Step::Refine(place, Refining::new(pose)),
            Glance::None | Glance::Done => Step::Turn { place, turn: -TURNS, best: SearchResult { pose, score: -1.0 } },
        }
    }

    /// Of how many points one is taken for now: where there are many places, some are enough to leave most out.
    fn stride(&self, place: usize) -> NonZeroUsize {
        let is_first = self.glances.get(place) == Some(&Glance::None);
        if is_first && self.coarse.places().len() > FEW_PLACES { GLANCE } else { ALL }
    }

    fn turn<const ROOM: usize>(
        &mut self,
        submap: &Submap<ROOM>,
        place: usize,
        (turn, best): (i32, SearchResult),
        left: &mut i64,
    ) -> Step {
        let Some(found) = self.coarse.places().get(place) else { return self.end(place) };
        *left -= TURN_EFFORT;
        let around = submap.origin().between(&found.pose);
        let around = Pose { theta: wrap(around.theta + f64::from(turn) * TURN), ..around };
        let result = search(&self.points, submap.grid(), &around, &WINDOW);
        let best = if result.score > best.score { result } else { best };
        if turn < TURNS {
            return Step::Turn { place, turn: turn + 1, best };
        }
        // What is beyond the reach of the grid is not found in it.
        let reached = self.reached::<ROOM>(&best.pose, ALL).filter(|is_reached| *is_reached).count();
        let score = best.score * self.points.len() as f32 / reached.max(1) as f32;
        if reached < FEWEST || score < PROMISING * self.score {
            return self.end(place);
        }
        self.score = self.score.max(score);
        Step::Refine(place, Refining::by_some(best.pose, self.stride(place)))
    }

    /// Whether points of the scan, one of so many, are within the reach of the submap, in whose frame it is at a pose.
    fn reached<const ROOM: usize>(&self, pose: &Pose, stride: NonZeroUsize) -> impl Iterator<Item = bool> {
        let transform = Transform::of(pose);
        self.points
            .iter()
            .step_by(stride.get())
            .map(move |point| Submap::<ROOM>::reaches(&transform.apply(&point.position)))
    }

    /// Points further away that have surfaces near.
    fn far_hits<const ROOM: usize>(&self, submap: &Submap<ROOM>, pose: &Pose, stride: NonZeroUsize) -> usize {
        let in_map = submap.origin().compose(pose);
        let is_near = |point: &SurfacePoint| self.grid.is_near(&in_map.transform(&point.position.cast()));
        let points = self.points.iter().step_by(stride.get()).zip(self.reached::<ROOM>(pose, stride));
        points.filter(|(point, is_reached)| !is_reached && is_near(point)).count()
    }

    fn refine<const ROOM: usize>(
        &mut self,
        submap: &Submap<ROOM>,
        place: usize,
        mut refining: Refining,
        left: &mut i64,
    ) -> Step {
        *left -= REFINE_EFFORT;
        if refining.step(&self.points, REFINED_A_STEP, |point, reach| submap.nearest(point, reach)) {
            return Step::Refine(place, refining);
        }
        let Some(found) = refining.outcome() else { return self.end(place) };
        let stride = self.stride(place);
        let on_surfaces = found.inliers as usize + self.far_hits(submap, &found.pose, stride);
        let share = (on_surfaces as f32 / self.points.len().div_ceil(stride.get()).max(1) as f32).min(1.0);
        let least = if stride == ALL { LEAST_SHARE } else { LEAST_GLANCE };
        if share < least {
            return self.end(place);
        }
        let free_axis = weak_axis(found.directions);
        let fix = PlaceFix { pose: found.pose, information: found.information, share, shown: 0.0, free_axis };
        Step::Look { place, fix, point: 0, found: InSight::default() }
    }

    fn look<const ROOM: usize>(
        &mut self,
        submap: &Submap<ROOM>,
        (place, fix): (usize, &PlaceFix),
        (point, mut found): (usize, InSight),
        left: &mut i64,
    ) -> Step {
        *left -= LOOK_EFFORT;
        let to_laser = Transform::of(&fix.pose.inverse());
        let mut seen = 0;
        for surface in submap.points(point, POINTS_A_STEP) {
            self.profile.look(&surface, &to_laser, &mut found);
            seen += 1;
        }
        if seen == POINTS_A_STEP {
            return Step::Look { place, fix: *fix, point: point + seen, found };
        }
        if found.share() < LEAST_SHOWN {
            return self.end(place);
        }
        let fix = PlaceFix { pose: submap.origin().compose(&fix.pose), shown: found.share(), ..*fix };
        if self.stride(place) == ALL {
            self.best.keep(fix);
            return self.end(place);
        }
        self.coarse.set_pose(place, fix.pose);
        let overlap = (f32::from(u8::MAX) * fix.overlap()) as u8;
        self.best_glance = self.best_glance.max(overlap);
        if let Some(glance) = self.glances.get_mut(place) {
            *glance = Glance::Overlap(overlap);
        }
        Step::Choose
    }

    /// Begins to look closely at one of the best places.
    fn first_settling(&mut self, place: usize) -> Step {
        self.shifts = 0;
        let best = self.best.get(0).map_or(0.0, |best| best.fix.overlap());
        let fix = self.best.get(place).map(|candidate| candidate.fix).filter(|fix| fix.overlap() >= WORTH * best);
        match fix.and_then(|fix| Settling::begin(&fix.pose)) {
            Some(settling) => Step::Settle { place, settling },
            None => Step::Answer,
        }
    }

    fn settle(&mut self, map: &KeptMap, place: usize, mut settling: Settling, left: &mut i64) -> Step {
        let (looked_at, goes_on) = settling.step(&self.points, map);
        *left -= SETTLE_EFFORT + i64::from(looked_at);
        if goes_on {
            return Step::Settle { place, settling };
        }
        if let (Some(Candidate { fix, held }), Some((pose, found))) = (self.best.get_mut(place), settling.outcome()) {
            let share = found.inliers as f32 / self.points.len().max(1) as f32;
            if self.shifts > 0 && share < fix.share {
                // What most things say of an axis, all of them together do not.
                *held = Held::Disputed(pose);
                return self.first_settling(place + 1);
            }
            // Far walls of a corridor say more of the same; what is nearby may have held the axis that they leave free.
            let free_axis = fix.free_axis.and(weak_axis(found.directions));
            *fix = PlaceFix { pose, information: found.information, share, free_axis, ..*fix };
        }
        self.first_question(place, false)
    }

    fn first_question(&mut self, place: usize, is_across: bool) -> Step {
        let begin = |best: &Candidate| Support::begin(&best.fix.pose, axis_of(&best.fix, is_across));
        match self.best.get(place).and_then(begin) {
            Some(support) => Step::Ask { place, is_across, support },
            None => Step::Answer,
        }
    }

    /// What things say of a place along an axis. It is shifted to where they agree.
    fn ask(&mut self, map: &KeptMap, (place, is_across): (usize, bool), mut support: Support, left: &mut i64) -> Step {
        let (looked_at, goes_on) = support.step(&self.points, map);
        *left -= SETTLE_EFFORT + i64::from(looked_at);
        if goes_on {
            return Step::Ask { place, is_across, support };
        }
        let Some(Candidate { fix, held }) = self.best.get_mut(place) else { return Step::Answer };
        let axis = axis_of(fix, is_across);
        let along = |shift: f32| {
            let (x, y) = (fix.pose.x + f64::from(shift * axis.x), fix.pose.y + f64::from(shift * axis.y));
            Pose { x, y, ..fix.pose }
        };
        *held = match support.verdict() {
            Verdict::Agreed(shift) if libm::fabsf(shift) <= AGREED => Held::Surely,
            Verdict::Agreed(shift) if self.shifts < MOST_SHIFTS => {
                self.shifts += 1;
                let shifted = Settling::begin(&along(shift));
                return shifted.map_or(Step::Answer, |settling| Step::Settle { place, settling });
            }
            Verdict::Agreed(shift) | Verdict::Disputed(shift) => Held::Disputed(along(shift)),
            Verdict::TooFew => Held::ByTooFew,
        };
        if is_across || !matches!(held, Held::Surely) {
            self.first_settling(place + 1)
        } else {
            self.first_question(place, true)
        }
    }
}

impl<const POINTS: usize, const CELLS: usize> Default for PlaceSearch<POINTS, CELLS> {
    fn default() -> Self {
        Self::new()
    }
}
