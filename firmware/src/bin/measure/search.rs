//! What it costs to find a pose among reflectors that look alike.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::EFFORT_A_REVOLUTION;
use agv_core::maps::{FixedMap, Landmark};
use agv_core::relocalization::{
    ReflectorAnswer, ReflectorIndex, ReflectorNoise, ReflectorRelocalizer, ReflectorSnapshot, RelocalizationParameters,
    RelocalizationProgress,
};
use agv_firmware::board::an500::stopwatch::Stopwatch;
use heapless::Vec;
use static_cell::StaticCell;

use crate::Count;

static INDEX: StaticCell<ReflectorIndex> = StaticCell::new();
static RELOCALIZER: StaticCell<ReflectorRelocalizer> = StaticCell::new();

/// Reflectors are seen up to here, m.
const FARTHEST: f64 = 30.0;

/// Numbers that look like chance.
struct Chance(u32);

impl Chance {
    /// The next number, from 0 to 1: Numerical Recipes' quick generator.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }
}

/// Counts what a revolution adds to searches among 60 reflectors anywhere in a hall of 60 m x 40 m, and among 1000 on a grid that is irregular by 5 cm.
pub fn count(stopwatch: &Stopwatch, map: &mut FixedMap<1000>) -> [Count; 2] {
    let index = INDEX.init_with(ReflectorIndex::new);
    let relocalizer = RELOCALIZER.init_with(|| ReflectorRelocalizer::new(RelocalizationParameters::default()));
    let mut chance = Chance(1);
    let scattered: Vec<Landmark, 1000> = (0..60)
        .map(|id| Landmark::reflector(id, Point::new(60.0 * chance.next(), 40.0 * chance.next()), 0.002))
        .collect();
    let few = searches("a revolution's search among 60 reflectors", stopwatch, map, &scattered, 3, index, relocalizer);
    let on_grid: Vec<Landmark, 1000> = (0..1000_u16)
        .map(|id| {
            let stray = Point::new(chance.next() - 0.5, chance.next() - 0.5) * 0.17;
            let site = Point::new(f64::from(id % 40) * 2.3, f64::from(id / 40) * 2.9);
            Landmark::reflector(id, site + stray, 0.002)
        })
        .collect();
    let many =
        searches("a revolution's search among 1000 reflectors", stopwatch, map, &on_grid, 15, index, relocalizer);
    [few, many]
}

/// Searches at ten places, where one of `hidden` reflectors is seen and two false ones.
fn searches(
    name: &'static str,
    stopwatch: &Stopwatch,
    map: &mut FixedMap<1000>,
    reflectors: &[Landmark],
    hidden: usize,
    index: &mut ReflectorIndex,
    relocalizer: &mut ReflectorRelocalizer,
) -> Count {
    map.clear();
    map.extend(reflectors).expect("a thousand reflectors fit");
    index.build(map.view());
    let indexed = index.of(map.view());
    let mut chance = Chance(2);
    let mut count = Count::new(name);
    for place in 0..10 {
        let truth = Pose::new(15.0 + 30.0 * chance.next(), 10.0 + 20.0 * chance.next(), 6.0 * chance.next());
        let mut snapshot = ReflectorSnapshot::new();
        let near = reflectors.iter().map(|landmark| truth.inverse_transform(&landmark.position()));
        for seen in near.filter(|seen| seen.norm() < FARTHEST).skip(place).step_by(hidden).take(24) {
            let noise = Point::new(chance.next() - 0.5, chance.next() - 0.5) * 0.02;
            snapshot.see(&(seen + noise), seen.norm(), &ReflectorNoise::default());
        }
        for _ in 0..2 {
            let nothing = Point::new(20.0 * chance.next() - 10.0, 20.0 * chance.next() - 10.0);
            snapshot.see(&nothing, nothing.norm(), &ReflectorNoise::default());
        }
        let mut progress = RelocalizationProgress::Searching;
        count.add(stopwatch.count(|| {
            relocalizer.begin(&snapshot, &indexed);
            progress = relocalizer.advance(&indexed, EFFORT_A_REVOLUTION);
        }));
        while progress == RelocalizationProgress::Searching {
            count.add(stopwatch.count(|| progress = relocalizer.advance(&indexed, EFFORT_A_REVOLUTION)));
        }
        let RelocalizationProgress::Done(ReflectorAnswer::Found(fix)) = progress else {
            panic!("the vehicle finds itself at place {place} among {} reflectors", reflectors.len())
        };
        assert!((fix.pose.position() - truth.position()).norm() < 0.1, "the pose is the true one");
    }
    count
}
