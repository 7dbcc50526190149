//! Places of the Moosmann drive recognised by their images, whole and with sectors hidden, beside Scan Context.
//!
//! Protocols: A, the map is every other key scan, 1 m apart, of the first 150 m, right is within 3 m; A10, nodes 10 m apart,
//! right is within 5.5 m; A10b, the same, and answers of 5.5 to 7.5 m count neither way. The other key scans of the whole
//! route ask; of those beyond the map there is no right answer.

mod support;

use std::cell::OnceCell;
use std::sync::OnceLock;

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{
    Alignment, Asked, Floor, Panorama, Place, PlaceImage, PlaceIndex, Pose, SECTORS, Span, Stored,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use support::moosmann::{Drive, RINGS};
use support::scan_context::ScanContext;

type Points = Vec<Option<[f32; 3]>>;
/// Something done to the points of a scan of that number.
type Change<'a> = dyn Fn(usize, &Points) -> Points + 'a;

#[derive(Clone, Copy)]
struct Protocol {
    name: &'static str,
    spacing: usize,
    /// Answers within this are right, m.
    right: f64,
    /// From here on they are wrong, m.
    wrong: f64,
}

const A: Protocol = Protocol { name: "A", spacing: 2, right: 3.0, wrong: 3.0 };
const A10: Protocol = Protocol { name: "A10", spacing: 10, right: 5.5, wrong: 5.5 };
const A10B: Protocol = Protocol { name: "A10b", spacing: 10, right: 5.5, wrong: 7.5 };

/// A scan, as both methods see it.
struct Signatures {
    image: PlaceImage,
    context: ScanContext,
}

/// A scan, as it is aligned.
struct View {
    panorama: Panorama,
    /// Levelled, with heights above the floor.
    points: Vec<[f32; 3]>,
}

/// All scans of the drive with something done to their points. Each is looked at when it is asked for: the map has few.
struct Scans<'a> {
    change: Box<Change<'a>>,
    signatures: Vec<OnceCell<Signatures>>,
    views: Vec<OnceCell<View>>,
}

impl<'a> Scans<'a> {
    fn new(change: impl Fn(usize, &Points) -> Points + 'a) -> Self {
        let (_, points) = drive().unwrap();
        let signatures = points.iter().map(|_| OnceCell::new()).collect();
        Self { change: Box::new(change), signatures, views: points.iter().map(|_| OnceCell::new()).collect() }
    }

    fn points(&self, key: usize) -> Points {
        let (_, points) = drive().unwrap();
        (self.change)(key, &points[key])
    }

    fn signatures(&self, key: usize) -> &Signatures {
        self.signatures[key].get_or_init(|| {
            let points = self.points(key);
            let cloud = Cloud::new(&points, RINGS).unwrap();
            let floor = Floor::find(&cloud).unwrap().without_small_slope();
            Signatures { image: PlaceImage::new(&cloud, &floor), context: ScanContext::new(&points) }
        })
    }

    fn view(&self, key: usize) -> &View {
        self.views[key].get_or_init(|| {
            let points = self.points(key);
            let cloud = Cloud::new(&points, RINGS).unwrap();
            let floor = Floor::find(&cloud).unwrap().without_small_slope();
            let panorama = Panorama::new(&cloud, &floor, Span::HDL64E);
            View { panorama, points: cloud.seen().map(|point| floor.levelled(point)).collect() }
        })
    }
}

fn drive() -> Option<&'static (Drive, Vec<Points>)> {
    static DRIVE: OnceLock<Option<(Drive, Vec<Points>)>> = OnceLock::new();
    let open = || {
        let drive = Drive::open("images of places")?;
        let points = drive.keys.iter().map(|key| drive.points(key.scan)).collect();
        Some((drive, points))
    };
    DRIVE.get_or_init(open).as_ref()
}

/// Recall at precision 1, and the best F1.
#[derive(Clone, Copy, Debug)]
struct Score {
    r1: f64,
    f1: f64,
}

fn score(drive: &Drive, protocol: Protocol, distance: impl Fn(usize, usize) -> f64) -> Score {
    let keys = &drive.keys;
    let apart = |a: usize, b: usize| {
        let ([x, y], [u, v]) = (keys[a].position, keys[b].position);
        (x - u).hypot(y - v)
    };
    let map: Vec<usize> =
        (0..keys.len()).step_by(protocol.spacing).filter(|key| keys[*key].travelled <= 150.0).collect();
    let queries: Vec<usize> = (1..keys.len()).step_by(2).collect();
    let has_answer = |query: &&usize| map.iter().any(|node| apart(**query, *node) <= protocol.right);
    let answerable = queries.iter().filter(has_answer).count();
    let answer = |query: &usize| {
        let all = map.iter().map(|node| (distance(*query, *node), *node));
        let (distance, node) = all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        (distance, apart(*query, node))
    };
    let mut answers: Vec<(f64, f64)> =
        queries.iter().map(answer).filter(|(distance, _)| *distance < f64::MAX).collect();
    // Near-misses count neither way.
    answers.retain(|(_, apart)| *apart <= protocol.right || *apart > protocol.wrong);
    answers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut right, mut best) = (0.0, Score { r1: 0.0, f1: 0.0 });
    for (number, (_, apart)) in answers.iter().enumerate() {
        right += f64::from(u8::from(*apart <= protocol.right));
        let (precision, recall) = (right / (number + 1) as f64, right / answerable as f64);
        if precision >= 1.0 {
            best.r1 = recall;
        }
        best.f1 = best.f1.max(2.0 * precision * recall / (precision + recall).max(1e-9));
    }
    best
}

/// Turned counter-clockwise by `heading` degrees.
fn turned(points: &Points, heading: f32) -> Points {
    let (sin, cos) = heading.to_radians().sin_cos();
    points.iter().map(|point| point.map(|[x, y, z]| [x * cos - y * sin, x * sin + y * cos, z])).collect()
}

/// Without what lies within `width` degrees round a direction.
fn masked(points: &Points, (direction, width): (f32, f32)) -> Points {
    let hide = |[x, y, z]: [f32; 3]| {
        let off = (y.atan2(x).to_degrees() - direction + 540.0).rem_euclid(360.0) - 180.0;
        (off.abs() > width / 2.0).then_some([x, y, z])
    };
    points.iter().map(|point| point.and_then(hide)).collect()
}

/// Leaning by 3 deg about an axis.
fn tilted(points: &Points, axis: f32) -> Points {
    let (sin, cos) = 3.0_f32.to_radians().sin_cos();
    let (b, a) = axis.sin_cos();
    let turn = |[x, y, z]: [f32; 3]| {
        let (along, across) = (x * a + y * b, y * a - x * b);
        let (across, z) = (across * cos - z * sin, across * sin + z * cos);
        [along * a - across * b, along * b + across * a, z]
    };
    points.iter().map(|point| point.map(turn)).collect()
}

/// 16 of the 64 rings, the others seen nothing.
fn thinned(points: &Points) -> Points {
    let columns = points.len() / RINGS;
    let keep = |(at, point): (usize, &Option<[f32; 3]>)| if (at / columns).is_multiple_of(4) { *point } else { None };
    points.iter().enumerate().map(keep).collect()
}

fn both(map: &Scans, asked: &Scans, protocol: Protocol) -> [Score; 2] {
    let (drive, _) = drive().unwrap();
    let image = |query: usize, node: usize| {
        let likeness = map.signatures(node).image.likeness(&asked.signatures(query).image);
        likeness.map_or(f64::MAX, |likeness| f64::from(likeness.distance))
    };
    let context = |query: usize, node: usize| map.signatures(node).context.distance(&asked.signatures(query).context);
    [score(drive, protocol, image), score(drive, protocol, context)]
}

/// The best ten of the images, aligned: of a scan and a node the distance between them, m, and the score.
fn aligned(map: &Scans, asked: &Scans, protocol: Protocol) -> Vec<Vec<Option<(f64, f64)>>> {
    let (drive, _) = drive().unwrap();
    let keys = &drive.keys;
    let nodes: Vec<usize> =
        (0..keys.len()).step_by(protocol.spacing).filter(|key| keys[*key].travelled <= 150.0).collect();
    let stored: Vec<Option<Stored>> =
        (0..keys.len()).map(|key| nodes.contains(&key).then(|| Stored::new(&map.view(key).panorama))).collect();
    let mut seconds = Vec::new();
    let mut found = vec![vec![None; keys.len()]; keys.len()];
    for query in (1..keys.len()).step_by(2) {
        let alike = |node: &usize| Some((map.signatures(*node).image.likeness(&asked.signatures(query).image)?, *node));
        let mut best: Vec<_> = nodes.iter().filter_map(alike).collect();
        best.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        let view = asked.view(query);
        let scan = Asked::new(&view.panorama, view.points.iter().copied());
        for (likeness, node) in best.into_iter().take(10) {
            let headings = likeness.headings();
            let began = std::time::Instant::now();
            let alignment = stored[node].as_ref().unwrap().align(&scan, &headings, 6.0);
            seconds.push(began.elapsed().as_secs_f64());
            found[query][node] = alignment.map(|Alignment { pose: Pose { place: [x, y], .. }, agreement }| {
                (f64::from(x.hypot(y)), f64::from(agreement.score))
            });
        }
    }
    seconds.sort_by(f64::total_cmp);
    println!("  {} alignments, {:.1} ms at the median", seconds.len(), 1e3 * seconds[seconds.len() / 2]);
    found
}

/// One less the greatest score. Answers from where none is right are none.
fn verified(aligned: &[Vec<Option<(f64, f64)>>], protocol: Protocol) -> Score {
    let (drive, _) = drive().unwrap();
    score(drive, protocol, |query, node| {
        let near = aligned[query][node].filter(|(apart, _)| *apart <= protocol.right);
        near.map_or(f64::MAX, |(_, score)| 1.0 - score)
    })
}

fn report(condition: &str, protocol: Protocol, [image, context]: [Score; 2]) {
    println!(
        "{} {condition}: image {:.3} / {:.3}, Scan Context {:.3} / {:.3}",
        protocol.name, image.r1, image.f1, context.r1, context.f1
    );
}

#[test]
fn whole_scans_are_recognised_better_than_by_scan_context() {
    if drive().is_none() {
        return;
    }
    let whole = Scans::new(|_, points| points.clone());
    for (protocol, least) in [(A, [0.93, 0.98]), (A10, [0.807, 0.947]), (A10B, [0.94, 0.97])] {
        let [image, context] = both(&whole, &whole, protocol);
        report("clean", protocol, [image, context]);
        assert!(image.r1 >= least[0] && image.f1 >= least[1], "{image:?}");
        if protocol.name == "A10" {
            // What the paper's method reaches here, so that the peer is one.
            assert!(context.r1 >= 0.775 && context.f1 >= 0.917, "{context:?}");
        }
    }
    let aligned = aligned(&whole, &whole, A10);
    for protocol in [A10, A10B] {
        let found = verified(&aligned, protocol);
        println!("{} clean, ten aligned: {:.3} / {:.3}", protocol.name, found.r1, found.f1);
        assert!(found.r1 >= 0.98 && found.f1 >= 0.99, "{found:?}");
    }
}

/// What is done to the scans of the map and to those that are asked for.
struct Stress {
    name: &'static str,
    /// Width of the sector that is hidden, deg, and in whose scans.
    width: f32,
    is_map_masked: bool,
    /// Heading of the asked scans against the map's, deg, of that number.
    heading: fn(usize) -> f32,
    /// What else is done to the asked scans.
    change: fn(usize, &Points) -> Points,
}

const SAME: fn(usize, &Points) -> Points = |_, points| points.clone();
const AHEAD: fn(usize) -> f32 = |_| 0.0;
const REVERSED: fn(usize) -> f32 = |_| 180.0;
/// As good as random: the golden angle.
const RANDOM: fn(usize) -> f32 = |number| (137.507_76 * number as f32) % 360.0;

const STRESSES: [Stress; 8] = {
    const fn masks(name: &'static str, width: f32, is_map_masked: bool, heading: fn(usize) -> f32) -> Stress {
        Stress { name, width, is_map_masked, heading, change: SAME }
    }
    const fn change(name: &'static str, change: fn(usize, &Points) -> Points) -> Stress {
        Stress { name, width: 0.0, is_map_masked: false, heading: AHEAD, change }
    }
    [
        masks("60 deg hidden in the question", 60.0, false, AHEAD),
        masks("120 deg hidden in the question", 120.0, false, AHEAD),
        masks("60 deg in both, reversed", 60.0, true, REVERSED),
        masks("120 deg in both, reversed", 120.0, true, REVERSED),
        masks("60 deg in both, random heading", 60.0, true, RANDOM),
        masks("120 deg in both, random heading", 120.0, true, RANDOM),
        change("tilt 3 deg", |number, points| tilted(points, 2.4 * number as f32)),
        change("16 of 64 rings", |_, points| thinned(points)),
    ]
};

/// Means of two scores over so many directions of a mask, of the scans of the map and those that are asked for.
fn under(stress: &Stress, directions: usize, scores: impl Fn(&Scans, &Scans) -> [Score; 2]) -> [Score; 2] {
    let mut mean = [Score { r1: 0.0, f1: 0.0 }; 2];
    let directions = if stress.width > 0.0 { directions } else { 1 };
    for number in 0..directions {
        let mask = (360.0 / directions as f32 * number as f32, stress.width);
        let map = Scans::new(|_, points| if stress.is_map_masked { masked(points, mask) } else { points.clone() });
        let asked = Scans::new(|number, points| {
            masked(&turned(&(stress.change)(number, points), (stress.heading)(number)), mask)
        });
        for (mean, score) in mean.iter_mut().zip(scores(&map, &asked)) {
            mean.r1 += score.r1 / directions as f64;
            mean.f1 += score.f1 / directions as f64;
        }
    }
    mean
}

#[test]
fn changed_scans_are_recognised_at_least_as_well_as_by_scan_context() {
    if drive().is_none() {
        return;
    }
    for stress in &STRESSES {
        let scores = under(stress, 8, |map, asked| both(map, asked, A10));
        report(stress.name, A10, scores);
        let [image, context] = scores;
        assert!(image.r1 >= context.r1 && image.f1 >= context.f1, "{}: {image:?} {context:?}", stress.name);
    }
}

/// Masks are looked at in four directions; `AGV_STRESS_DIRECTIONS=8` makes the table of the book.
#[test]
fn changed_scans_are_verified() {
    if drive().is_none() {
        return;
    }
    let directions = std::env::var("AGV_STRESS_DIRECTIONS").map_or(4, |count| count.parse().unwrap());
    for stress in &STRESSES {
        let [found, with_near] = under(stress, directions, |map, asked| {
            let aligned = aligned(map, asked, A10);
            [A10, A10B].map(|protocol| verified(&aligned, protocol))
        });
        for (protocol, found) in [(A10, found), (A10B, with_near)] {
            println!("{} {}, ten aligned: {:.3} / {:.3}", protocol.name, stress.name, found.r1, found.f1);
        }
        // By A10 up to three questions of 57 are lost whose nearest place the reference has 5.2 to 5.5 m away.
        assert!(found.r1 >= 0.8 && found.f1 >= 0.97, "{}: {found:?}", stress.name);
        assert!(with_near.r1 >= 0.93 && with_near.f1 >= 0.97, "{}: {with_near:?}", stress.name);
    }
}

/// Images that are put together of sectors of others, in runs of random length, turned at random.
fn mixed(images: &[&PlaceImage], count: usize, seed: u64) -> Vec<PlaceImage> {
    const RINGS: usize = (PlaceImage::BYTES - 8) / SECTORS;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let bytes: Vec<_> = images.iter().map(|image| image.to_bytes()).collect();
    let known =
        |bytes: &[u8; PlaceImage::BYTES], sector: usize| bytes[SECTORS * RINGS + sector / 8] >> (sector % 8) & 1;
    let mut mix = || {
        let mut all = [0; PlaceImage::BYTES];
        let mut sector = 0;
        while sector < SECTORS {
            let of = &bytes[random.random_range(0..bytes.len())];
            let turn = random.random_range(0..SECTORS);
            for _ in 0..random.random_range(4..20) {
                if sector < SECTORS {
                    let from = (sector + turn) % SECTORS;
                    all[sector * RINGS..(sector + 1) * RINGS].copy_from_slice(&of[from * RINGS..(from + 1) * RINGS]);
                    all[SECTORS * RINGS + sector / 8] |= known(of, from) << (sector % 8);
                    sector += 1;
                }
            }
        }
        PlaceImage::from_bytes(&all).unwrap()
    };
    (0..count).map(|_| mix()).collect()
}

/// Of 100,000 places 4,000 are compared as a whole, and ten of these are aligned. The others are put together of the very images
/// that are asked for, so some come before the right one; and where a third of each ring is hidden, the key of the 4,000 changes.
#[test]
fn the_right_place_is_aligned_among_a_hundred_thousand() {
    let Some((drive, _)) = drive() else { return };
    let keys = &drive.keys;
    let whole = Scans::new(|_, points| points.clone());
    let nodes: Vec<usize> = (0..keys.len()).step_by(10).filter(|key| keys[*key].travelled <= 150.0).collect();
    let images: Vec<&PlaceImage> = (0..keys.len()).map(|key| &whole.signatures(key).image).collect();
    let others = mixed(&images, 100_000, 1);
    let panorama = &whole.view(0).panorama;
    let place = |image, x| Place { pose: Pose { place: [x, 0.0], heading: 0.0 }, image, panorama };
    let mut places: Vec<Place> = nodes.iter().map(|node| place(images[*node], 0.0)).collect();
    let few = PlaceIndex::new(places.clone(), 6.0);
    places.extend(others.iter().map(|image| place(image, 1000.0)));
    let many = PlaceIndex::new(places, 6.0);
    let apart = |query: usize, node: usize| {
        let ([x, y], [u, v]) = (keys[query].position, keys[node].position);
        (x - u).hypot(y - v)
    };
    let asked: Vec<usize> =
        (1..keys.len()).step_by(2).filter(|query| nodes.iter().any(|node| apart(*query, *node) <= A10.right)).collect();
    let found = |index: &PlaceIndex, scans: &Scans| {
        let is_right =
            |query: usize, place: usize| nodes.get(place).is_some_and(|node| apart(query, *node) <= A10.right);
        let has_right = |query: &&usize| {
            index.candidates(&scans.signatures(**query).image).into_iter().any(|place| is_right(**query, place))
        };
        asked.iter().filter(has_right).count()
    };
    let masked = Scans::new(|number, points| masked(&turned(points, 180.0), (37.0 * number as f32, 120.0)));
    for (condition, scans, lost) in [("clean", &whole, 7), ("120 deg hidden, reversed", &masked, 32)] {
        let [alone, among] = [found(&few, scans), found(&many, scans)];
        println!("{condition}: right among ten {alone} of {}, among 100,000 others {among}", asked.len());
        assert!(among + lost >= alone && alone > 50, "{condition}");
    }
}
