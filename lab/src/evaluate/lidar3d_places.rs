//! How well signatures of multi-beam scans recognise places.
//!
//! Protocol A: the map is every other key scan, 1 m apart, of the first 150 m; queries are the others of the whole route;
//! an answer within 3 m is right. A10: the nodes of the map are 10 m apart, right is within 5.5 m. A10b: the same, and answers
//! of 5.5 to 7.5 m, near-misses of the same street, count neither way. A query beyond the map has no right answer. Poses, computed by another program, are used to choose key scans and to judge, never to answer.

use std::path::Path;
use std::time::Instant;

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{
    Asked, AskedImage, DIRECTIONS, Floor, Histogram, Neighbours, Panorama, PlaceImage, Span, Stored, chi_square,
    from_key_scans,
};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::Serialize;

use agv_host_sim::import::range_image::{RangeImageError, RangeImages};
use agv_host_sim::lidar3d::place_map::APART;
use agv_host_sim::lidar3d::signatures::{Method, Signatures, sensor_height};
use agv_host_sim::lidar3d::view::View;

const SEED: u64 = 1;
/// Places that are aligned, and the farthest that an alignment is looked for, m.
const CANDIDATES: usize = 10;
const REACH: f32 = 6.0;

/// Which scans are the map, and which answers are right.
#[derive(Clone, Copy)]
struct Protocol {
    name: &'static str,
    /// Key scans from one node to the next.
    spacing: usize,
    /// Answers within this are right, m.
    right: f64,
    /// From here on they are wrong, m.
    wrong: f64,
}

const PROTOCOLS: [Protocol; 3] = [
    Protocol { name: "A", spacing: 2, right: 3.0, wrong: 3.0 },
    Protocol { name: "A10", spacing: 10, right: 5.5, wrong: 5.5 },
    Protocol { name: "A10b", spacing: 10, right: 5.5, wrong: 7.5 },
];

/// What a method achieves by one protocol.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Name of the method.
    pub method: &'static str,
    /// Name of the protocol.
    pub protocol: &'static str,
    /// Whether the queries have every second column only.
    pub half_columns: bool,
    /// Share of the queries within the map that are answered rightly before the first wrong answer.
    pub recall_at_full_precision: f64,
    /// Best harmonic mean of precision and recall over all thresholds.
    pub max_f1: f64,
    /// Precision with the threshold that was learned from the map alone; None of alignments, which learn it in `PlaceIndex`.
    pub learned_precision: Option<f64>,
    /// Recall with it.
    pub learned_recall: Option<f64>,
    /// Time for a signature, ms.
    pub signature_ms: f64,
    /// Time for a comparison, us.
    pub compare_us: f64,
    /// Share of the true pairs whose turn is found within 2 degrees; each query is turned by a random angle.
    pub orientation_within_2_deg: f64,
    /// Size of a signature.
    pub bytes: usize,
    /// Queries.
    pub queries: usize,
    /// Queries that have a right answer.
    pub answerable: usize,
}

/// The signatures of a scan and what they cost.
struct Described {
    signatures: Signatures,
    /// The thesis's histogram of fitted planes.
    planes: Histogram,
    view: View,
    /// Points above the floor.
    points: Vec<[f32; 3]>,
    /// Seconds for the histogram, for the enriched signature with it, for the histogram of planes, and for the view.
    seconds: [f64; 4],
}

/// What is measured.
#[derive(Clone, Copy)]
enum Experiment {
    Method(Method),
    /// A method of the thesis with the check of the walls against look-alike places.
    Checked(Method),
    /// The thesis's histogram of fitted planes, chi-square of counts.
    Planes,
    /// Images of places.
    Image,
    /// The ten places whose images are most alike, aligned.
    Aligned,
}

impl Experiment {
    fn all() -> impl Iterator<Item = Self> {
        let checked = Method::ALL.into_iter().filter(|method| *method != Method::Enriched);
        let methods = Method::ALL.into_iter().map(Self::Method);
        methods.chain(checked.map(Self::Checked)).chain([Self::Planes, Self::Image, Self::Aligned])
    }

    fn name(self) -> &'static str {
        match self {
            Self::Method(method) => method.name(),
            Self::Checked(method) => method.checked_name(),
            Self::Planes => "thesis chi-square, plane fit",
            Self::Image => "image",
            Self::Aligned => "image, ten aligned",
        }
    }

    fn is_checked(self) -> bool {
        matches!(self, Self::Checked(_))
    }

    fn bytes(self) -> usize {
        match self {
            Self::Method(method) => method.bytes(),
            Self::Checked(method) => method.bytes() + DIRECTIONS,
            Self::Planes => Method::ChiSquare.bytes(),
            Self::Image => PlaceImage::BYTES,
            Self::Aligned => PlaceImage::BYTES + Panorama::BYTES,
        }
    }

    fn distance(self, one: &Described, other: &Described) -> f64 {
        match self {
            Self::Method(method) | Self::Checked(method) => method.distance(&one.signatures, &other.signatures),
            Self::Planes => chi_square(&one.planes, &other.planes),
            Self::Image | Self::Aligned => {
                let likeness = other.view.image.likeness(&one.view.image);
                likeness.map_or(f64::MAX, |likeness| f64::from(likeness.distance))
            }
        }
    }

    /// Seconds for the signature of a scan.
    fn seconds(self, described: &Described) -> f64 {
        let [histogram, enriched, planes, view] = described.seconds;
        match self {
            Self::Method(Method::Enriched) => enriched,
            Self::Method(_) | Self::Checked(_) => histogram,
            Self::Planes => planes,
            Self::Image | Self::Aligned => view,
        }
    }
}

impl Described {
    fn new(points: &[Option<[f32; 3]>], rings: usize, sensor_height: f32, span: Span) -> Option<Self> {
        let cloud = Cloud::new(points, rings)?;
        let (signatures, [histogram, enriched]) = Signatures::timed(&cloud, sensor_height);
        let start = Instant::now();
        let planes = Histogram::of_planes(&cloud, &Neighbours::default());
        let planes_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let floor = Floor::find(&cloud).map_or(Floor::level(sensor_height), Floor::without_small_slope);
        let view = View::new(&cloud, &floor, span);
        let seconds = [histogram, enriched, planes_seconds, start.elapsed().as_secs_f64()];
        let points = cloud.seen().map(|point| floor.levelled(point)).collect();
        Some(Self { signatures, planes, view, points, seconds })
    }
}

fn turned(points: &[Option<[f32; 3]>], turn: f32) -> Vec<Option<[f32; 3]>> {
    let (sin, cos) = turn.sin_cos();
    points.iter().map(|point| point.map(|[x, y, z]| [x * cos - y * sin, x * sin + y * cos, z])).collect()
}

/// A key scan.
struct Key {
    position: [f64; 2],
    heading: f64,
    travelled: f64,
    scan: usize,
}

/// Measures all methods on the Moosmann route. `folder` holds `velodyne_dist` and `kiss_icp_poses_derived.txt`; `progress`
/// is called after each scan with how many there are.
///
/// # Errors
/// See [`RangeImageError`].
pub fn moosmann(folder: &Path, mut progress: impl FnMut(usize)) -> Result<Vec<Outcome>, RangeImageError> {
    let images = RangeImages::open(&folder.join("velodyne_dist"))?;
    let keys = key_scans(&folder.join("kiss_icp_poses_derived.txt"), images.files.len())?;
    let rings = images.elevations.len();
    let span = Span::of_elevations(images.elevations.iter().map(|elevation| *elevation as f32));
    let span = span.unwrap_or(Span::HDL64E);
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut height = None;
    let mut whole = Vec::new();
    let mut half = Vec::new();
    let mut asked_turn = Vec::new();
    let mut turns = Vec::new();
    for key in &keys {
        let points = images.points(key.scan)?;
        let height = *height.get_or_insert_with(|| sensor_height(&points));
        let columns = images.rotations.len();
        let halved: Vec<_> = points.chunks_exact(columns).flat_map(|row| row.iter().step_by(2).copied()).collect();
        let turn: f32 = random.random_range(-3.1..3.1);
        turns.push(f64::from(turn));
        whole.extend(Described::new(&points, rings, height, span));
        half.extend(Described::new(&halved, rings, height, span));
        asked_turn.extend(Described::new(&turned(&points, turn), rings, height, span).map(|found| found.signatures));
        progress(keys.len());
    }
    let mut outcomes = Vec::new();
    for protocol in PROTOCOLS {
        let map: Vec<usize> =
            (0..keys.len()).step_by(protocol.spacing).filter(|index| keys[*index].travelled <= 150.0).collect();
        let queries: Vec<usize> = (1..keys.len()).step_by(2).collect();
        for half_columns in [false, true] {
            for experiment in Experiment::all() {
                let asked = if half_columns { &half } else { &whole };
                let test = Test { keys: &keys, map: &map, queries: &queries, stored: &whole, asked, protocol };
                let mut outcome = test.run(experiment);
                outcome.protocol = protocol.name;
                outcome.half_columns = half_columns;
                outcome.orientation_within_2_deg = orientation(&test, &asked_turn, &turns);
                outcomes.push(outcome);
            }
        }
    }
    Ok(outcomes)
}

struct Test<'a> {
    keys: &'a [Key],
    map: &'a [usize],
    queries: &'a [usize],
    stored: &'a [Described],
    asked: &'a [Described],
    protocol: Protocol,
}

impl Test<'_> {
    /// The node that is nearest to a query, and its distance.
    fn nearest(&self, experiment: Experiment, query: usize) -> Option<(f64, usize)> {
        let distance = |&node: &usize| (experiment.distance(&self.asked[query], &self.stored[node]), node);
        self.map.iter().map(distance).filter(|(distance, _)| *distance < f64::MAX).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Of the best by their images the one that agrees most when it is aligned; answers that lie farther away than right ones
    /// are none.
    fn aligned(&self, query: usize) -> Option<(f64, usize)> {
        let asked = &self.asked[query];
        let image = AskedImage::new(&asked.view.image);
        let likeness = |&node: &usize| Some((image.likeness(&self.stored[node].view.image)?, node));
        let mut alike: Vec<_> = self.map.iter().filter_map(likeness).collect();
        alike.sort_by(|a, b| a.0.distance.total_cmp(&b.0.distance));
        let scan = Asked::new(&asked.view.panorama, asked.points.iter().copied());
        let found = alike.into_iter().take(CANDIDATES).filter_map(|(likeness, node)| {
            let found = Stored::new(&self.stored[node].view.panorama).align(&scan, &likeness.headings(), REACH)?;
            let is_near = f64::from(found.pose.place[0].hypot(found.pose.place[1])) <= self.protocol.right;
            is_near.then_some((1.0 - f64::from(found.agreement.score), node))
        });
        found.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn apart(&self, one: usize, other: usize) -> f64 {
        let (a, b) = (self.keys[one].position, self.keys[other].position);
        (a[0] - b[0]).hypot(a[1] - b[1])
    }

    /// The node of the map that is nearest to a query, if it is near enough to be right.
    fn truth(&self, query: usize) -> Option<usize> {
        let nearest = self.map.iter().copied().min_by(|a, b| self.apart(query, *a).total_cmp(&self.apart(query, *b)));
        nearest.filter(|node| self.apart(query, *node) <= self.protocol.right)
    }

    fn run(&self, experiment: Experiment) -> Outcome {
        let is_checked = experiment.is_checked();
        let places: Vec<[f64; 2]> = self.map.iter().map(|node| self.keys[*node].position).collect();
        let facing = |one: usize, other: usize| {
            let [one, other] = [one, other].map(|place| &self.stored[self.map[place]].signatures.facing);
            f64::from(one.distance(other))
        };
        let check = if is_checked { from_key_scans(&places, APART, facing).unwrap_or(0.0) } else { f64::MAX };
        let start = Instant::now();
        let mut found = Vec::new();
        for &query in self.queries {
            let nearest = match experiment {
                Experiment::Aligned => self.aligned(query),
                _ => self.nearest(experiment, query),
            };
            found.extend(nearest.map(|(distance, node)| (distance, query, node)));
        }
        let compare_us = start.elapsed().as_secs_f64() * 1e6 / (self.queries.len() * self.map.len()) as f64;
        let answerable = self.queries.iter().filter(|query| self.truth(**query).is_some()).count();
        let is_like = |query: usize, node: usize| {
            let [one, other] = [&self.asked[query], &self.stored[node]].map(|described| &described.signatures.facing);
            !is_checked || f64::from(one.distance(other)) < check
        };
        let is_right = |query: usize, node: usize| {
            let apart = self.apart(query, node);
            (apart <= self.protocol.right || apart > self.protocol.wrong).then_some(apart <= self.protocol.right)
        };
        let mut answers: Vec<(f64, bool)> = found
            .into_iter()
            .filter(|(_, query, node)| is_like(*query, *node))
            .filter_map(|(distance, query, node)| Some((distance, is_right(query, node)?)))
            .collect();
        let threshold = from_key_scans(&places, APART, |one, other| {
            experiment.distance(&self.stored[self.map[one]], &self.stored[self.map[other]])
        })
        .unwrap_or(0.0);
        answers.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (recall_at_full_precision, max_f1) = best_scores(&answers, answerable);
        let learned = answers.partition_point(|(distance, _)| *distance < threshold);
        let is_aligned = matches!(experiment, Experiment::Aligned);
        let (learned_precision, learned_recall) = (!is_aligned).then(|| score(&answers[..learned], answerable)).unzip();
        let mut seconds: Vec<f64> = self.asked.iter().map(|described| experiment.seconds(described)).collect();
        seconds.sort_by(f64::total_cmp);
        Outcome {
            method: experiment.name(),
            protocol: "",
            half_columns: false,
            recall_at_full_precision,
            max_f1,
            learned_precision,
            learned_recall,
            signature_ms: 1e3 * seconds[seconds.len() / 2],
            compare_us,
            orientation_within_2_deg: 0.0,
            bytes: experiment.bytes(),
            queries: self.queries.len(),
            answerable,
        }
    }
}

/// Precision and recall of answers, each with its distance and whether it is right.
fn score(answers: &[(f64, bool)], answerable: usize) -> (f64, f64) {
    let right = answers.iter().filter(|(_, is_right)| *is_right).count();
    let precision = if answers.is_empty() { 1.0 } else { right as f64 / answers.len() as f64 };
    (precision, right as f64 / answerable.max(1) as f64)
}

/// Over all thresholds of the distance: the recall at full precision, and the largest F1.
fn best_scores(answers: &[(f64, bool)], answerable: usize) -> (f64, f64) {
    // Answers at the same distance are given together.
    let thresholds = (1..=answers.len()).filter(|n| *n == answers.len() || answers[*n].0 > answers[n - 1].0);
    let (mut recall_at_full_precision, mut max_f1) = (0.0f64, 0.0f64);
    for given in thresholds {
        let (precision, recall) = score(&answers[..given], answerable);
        if precision >= 1.0 {
            recall_at_full_precision = recall_at_full_precision.max(recall);
        }
        if precision + recall > 0.0 {
            max_f1 = max_f1.max(2.0 * precision * recall / (precision + recall));
        }
    }
    (recall_at_full_precision, max_f1)
}

/// Share of the true pairs whose turn is found within 2 degrees. `turned` are the queries, each turned by its angle.
fn orientation(test: &Test<'_>, turned: &[Signatures], turns: &[f64]) -> f64 {
    let pairs: Vec<(usize, usize)> =
        test.queries.iter().filter_map(|query| Some((*query, test.truth(*query)?))).collect();
    let found = pairs.iter().filter(|(query, node)| {
        let found = turned[*query].turn_since(&test.stored[*node].signatures);
        let truth = test.keys[*query].heading - test.keys[*node].heading - turns[*query];
        let error = (found - truth + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        error.abs() <= 2f64.to_radians()
    });
    found.count() as f64 / pairs.len().max(1) as f64
}

/// One scan every metre of the way.
fn key_scans(path: &Path, scans: usize) -> Result<Vec<Key>, RangeImageError> {
    let text = std::fs::read_to_string(path).map_err(|source| RangeImageError::Io { path: path.to_owned(), source })?;
    let mut keys: Vec<Key> = Vec::new();
    let mut last: Option<[f64; 2]> = None;
    let mut travelled = 0.0;
    for (scan, line) in text.lines().enumerate().take(scans) {
        let values: Vec<f64> = line.split_whitespace().filter_map(|value| value.parse().ok()).collect();
        let [r00, _, _, x, r10, _, _, y, ..] = values[..] else {
            let reason = format!("line {} is no pose", scan + 1);
            return Err(RangeImageError::Foreign { path: path.to_owned(), reason });
        };
        if let Some([a, b]) = last {
            travelled += (x - a).hypot(y - b);
        }
        last = Some([x, y]);
        if keys.last().is_none_or(|key| travelled - key.travelled >= 1.0) {
            keys.push(Key { position: [x, y], heading: r10.atan2(r00), travelled, scan });
        }
    }
    Ok(keys)
}
