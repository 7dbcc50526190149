//! A vehicle that is switched on somewhere among reflectors: how often it finds itself, and that it is never wrong.
//!
//! It stands still and sees one revolution after another. A reflector is seen if it is near enough and nothing hides it;
//! each revolution misses some of them, independently, and holds false ones at random places.

pub mod feature_map;
mod halls;

use agv_core::geometry::{Point, Pose};
use agv_core::maps::{FixedMap, Landmark};
use agv_core::relocalization::{
    IndexedReflectors, ReflectorAnswer, ReflectorIndex, ReflectorNoise, ReflectorRelocalizer, ReflectorSnapshot,
    RelocalizationParameters, RelocalizationProgress,
};
use rayon::prelude::*;
use serde::Serialize;

use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::raycast::{RayCaster, Surface};
use halls::Hall;

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// How reflectors stand.
    pub layout: Layout,
    /// Share of the reflectors that a revolution misses.
    pub missing_share: f64,
    /// False reflectors a revolution.
    pub false_ones: usize,
}

/// How reflectors stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// 60 reflectors in the warehouse hall.
    Warehouse,
    /// What is seen is of one hall, the map of a twin: the same columns and bays, other reflectors on them and on the walls.
    TwinHall,
    /// 60 reflectors, half of which are the others turned by half a turn about the middle of the hall.
    Symmetric,
    /// 1000 reflectors on a regular grid of sites, each displaced by a normal error of that standard deviation, m.
    Regular(f64),
}

impl Case {
    /// All cases.
    pub const ALL: [Self; 5] = [
        Self { name: "60 reflectors", layout: Layout::Warehouse, missing_share: 0.1, false_ones: 2 },
        Self { name: "half missing", layout: Layout::Warehouse, missing_share: 0.5, false_ones: 2 },
        Self { name: "symmetric", layout: Layout::Symmetric, missing_share: 0.1, false_ones: 2 },
        Self { name: "twin hall", layout: Layout::TwinHall, missing_share: 0.1, false_ones: 2 },
        Self { name: "1000 reflectors, 5 cm", layout: Layout::Regular(0.05), missing_share: 0.1, false_ones: 2 },
    ];
}

/// What became of the starts of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the case.
    pub case: &'static str,
    /// Number of starts.
    pub starts: usize,
    /// Share of the starts that were right within one, two and three revolutions.
    pub right: [f64; REVOLUTIONS],
    /// Starts with a wrong answer.
    pub wrong: usize,
    /// Share of the starts whose first revolution fits two poses.
    pub ambiguous: f64,
    /// Starts from which fewer than four landmarks can be seen at all, where no answer is given.
    pub blind: usize,
    /// Mean number of reflectors seen in a revolution, false ones included.
    pub seen: f64,
    /// Effort of a revolution's search in looks at mapped pairs: mean, and largest.
    pub effort: (f64, u32),
}

/// Revolutions after which a start is given up.
pub const REVOLUTIONS: usize = 3;

/// Starts in one hall.
const STARTS_A_HALL: u64 = 100;

/// Stated error of the survey on each axis, m.
const SURVEY_DEVIATION: f32 = 0.002;

/// Farthest reflector that is seen, m.
const FARTHEST: f64 = 30.0;
const RANGE_NOISE: f64 = 0.008;
const BEARING_NOISE: f64 = 0.05 * std::f64::consts::PI / 180.0;

/// An answer with a larger error of position (m) or heading (rad) is wrong.
const RIGHT: (f64, f64) = (0.1, std::f64::consts::PI / 180.0);

/// Effort between two looks at the counter.
const SLICE: u32 = 64;

/// What happened at one start.
#[derive(Default)]
struct Start {
    /// Revolution of the first answer, and whether it was right.
    answered: Option<(usize, bool)>,
    is_ambiguous: bool,
    is_blind: bool,
    seen: usize,
    effort: [u32; REVOLUTIONS],
}

/// Simulates `starts` starts of a case from a seed on; `done` is called after each.
#[must_use]
pub fn run(
    case: &Case,
    seed: u64,
    starts: u64,
    parameters: &RelocalizationParameters,
    done: impl Fn() + Sync,
) -> Outcome {
    let halls = starts.div_ceil(STARTS_A_HALL);
    let results: Vec<Vec<Start>> = (0..halls)
        .into_par_iter()
        .map(|number| {
            let hall_seed = seed.wrapping_mul(1_000_003).wrapping_add(number);
            let count = STARTS_A_HALL.min(starts - number * STARTS_A_HALL);
            run_hall(case, hall_seed, count, parameters, &done)
        })
        .collect();
    outcome(case.name, results.into_iter().flatten().collect())
}

/// Sums up starts.
fn outcome(case: &'static str, all: Vec<Start>) -> Outcome {
    let count = all.len().max(1) as f64;
    let right_within = |revolutions: usize| {
        let is_right = |start: &&Start| start.answered.is_some_and(|(at, is_right)| is_right && at < revolutions);
        all.iter().filter(is_right).count() as f64 / count
    };
    let effort = all.iter().flat_map(|start| start.effort).filter(|effort| *effort > 0);
    Outcome {
        case,
        starts: all.len(),
        right: [1, 2, 3].map(right_within),
        wrong: all.iter().filter(|start| start.answered.is_some_and(|(_, is_right)| !is_right)).count(),
        ambiguous: all.iter().filter(|start| start.is_ambiguous).count() as f64 / count,
        blind: all.iter().filter(|start| start.is_blind).count(),
        seen: all.iter().map(|start| start.seen as f64).sum::<f64>() / count,
        effort: (
            effort.clone().map(f64::from).sum::<f64>() / effort.clone().count().max(1) as f64,
            effort.max().unwrap_or(0),
        ),
    }
}

fn run_hall(
    case: &Case,
    seed: u64,
    starts: u64,
    parameters: &RelocalizationParameters,
    done: &(impl Fn() + Sync),
) -> Vec<Start> {
    let hall = Hall::new(case.layout, seed);
    let mapped = match case.layout {
        Layout::TwinHall => Hall::new(case.layout, seed ^ (1 << 40)).positions(),
        _ => hall.positions(),
    };
    let reflector = |(id, position): (u16, &Point)| Landmark::reflector(id, *position, SURVEY_DEVIATION);
    let mapped: Vec<Landmark> = (0..).zip(&mapped).map(reflector).collect();
    let map = SearchedMap::new(&mapped);
    let caster = RayCaster::new(&hall.world);
    let mut random = Random::new(seed, Stream::Kidnapping);
    let mut relocalizer = Box::new(ReflectorRelocalizer::<64>::new(*parameters));
    (0..starts)
        .map(|_| {
            let truth = hall.free_pose(&mut random);
            let start = run_start(case, &hall, &caster, &truth, &map.view(), &mut relocalizer, &mut random);
            done();
            start
        })
        .collect()
}

/// Landmarks that all look alike, and their index.
struct SearchedMap {
    map: Box<FixedMap<LANDMARKS>>,
    index: Box<ReflectorIndex>,
}

/// Most landmarks of a hall or a storage.
const LANDMARKS: usize = 1024;

impl SearchedMap {
    fn new(landmarks: &[Landmark]) -> Self {
        let (mut map, mut index) = (Box::new(FixedMap::new()), Box::new(ReflectorIndex::new()));
        // Halls and storages have no more landmarks than there is room for.
        let _ = map.extend(landmarks);
        index.build(map.view());
        Self { map, index }
    }

    fn view(&self) -> IndexedReflectors<'_> {
        self.index.of(self.map.view())
    }
}

fn run_start(
    case: &Case,
    hall: &Hall,
    caster: &RayCaster,
    truth: &Pose,
    map: &IndexedReflectors,
    relocalizer: &mut ReflectorRelocalizer<64>,
    random: &mut Random,
) -> Start {
    let mut snapshot = ReflectorSnapshot::<64>::new();
    let mut start = Start::default();
    let visible = visible(hall, caster, truth);
    start.is_blind = visible.len() < usize::from(RelocalizationParameters::default().fewest);
    for revolution in 0..REVOLUTIONS {
        let seen = observe(case, &visible, truth, random);
        if revolution == 0 {
            start.seen = seen.len();
        }
        for (position, range) in seen {
            snapshot.see(&position, range, &ReflectorNoise::default());
        }
        let can_be_right = case.layout != Layout::TwinHall;
        if search(&mut start, revolution, truth, &snapshot, map, relocalizer, can_be_right) {
            break;
        }
    }
    start
}

/// Searches after one revolution, and notes what comes out. Whether that is a pose.
fn search(
    start: &mut Start,
    revolution: usize,
    truth: &Pose,
    snapshot: &ReflectorSnapshot<64>,
    map: &IndexedReflectors,
    relocalizer: &mut ReflectorRelocalizer<64>,
    can_be_right: bool,
) -> bool {
    relocalizer.begin(snapshot, map);
    let answer = loop {
        match relocalizer.advance(map, SLICE) {
            RelocalizationProgress::Done(answer) => break answer,
            RelocalizationProgress::Searching => start.effort[revolution] += SLICE,
        }
    };
    match answer {
        ReflectorAnswer::Found(fix) => {
            let error = truth.between(&fix.pose);
            let is_right = can_be_right && error.position().norm() < RIGHT.0 && error.theta.abs() < RIGHT.1;
            start.answered = Some((revolution, is_right));
            true
        }
        ReflectorAnswer::Ambiguous(..) => {
            start.is_ambiguous |= revolution == 0;
            false
        }
        ReflectorAnswer::TooFew | ReflectorAnswer::Unknown => false,
    }
}

/// Positions of the reflectors that can be seen from a pose, m.
fn visible(hall: &Hall, caster: &RayCaster, truth: &Pose) -> Vec<Point> {
    let origin = truth.position();
    let is_visible = |(number, position): &(usize, Point)| {
        let offset = position - origin;
        let distance = offset.norm();
        distance <= FARTHEST
            && caster
                .first_hit(&origin, &(offset / distance), FARTHEST + 1.0)
                .is_some_and(|hit| hit.surface == Surface::Reflector(*number))
    };
    hall.positions().into_iter().enumerate().filter(is_visible).map(|(_, position)| position).collect()
}

/// What one revolution holds: positions in the vehicle's frame and ranges, m.
fn observe(case: &Case, visible: &[Point], truth: &Pose, random: &mut Random) -> Vec<(Point, f64)> {
    let mut seen = Vec::new();
    let mut push = |range: f64, bearing: f64| {
        let (sine, cosine) = bearing.sin_cos();
        seen.push((Point::new(range * cosine, range * sine), range));
    };
    for position in visible {
        let noise = (random.normal(), random.normal());
        if random.happens(case.missing_share) {
            continue;
        }
        let local = truth.inverse_transform(position);
        push(local.norm() + RANGE_NOISE * noise.0, local.y.atan2(local.x) + BEARING_NOISE * noise.1);
    }
    for _ in 0..case.false_ones {
        push(FARTHEST * random.uniform().sqrt(), std::f64::consts::TAU * random.uniform());
    }
    seen
}
