//! `agv lidar3d places find`.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use agv_host_sim::lidar3d::Source;
use agv_host_sim::lidar3d::place_map::{self, Answer, Limits, PlaceMap, StoredPlace};
use agv_host_sim::lidar3d::place_search::{FoundPlace, PlaceSearch, Sequence};
use agv_host_sim::lidar3d::refinement::{Alignment, Surfaces, Target};
use agv_host_sim::lidar3d::signatures::{Method, Signatures};
use agv_lidar3d::place::Agreement;
use anyhow::{Context, ensure};
use nalgebra::Vector3;
use serde_json::json;

use super::Drive;
use crate::command::lidar3d::arguments::SOURCES;
use crate::command::stop;

const HELP: &str = "\
Each scan is looked at by itself, with --sequence together with those of the way to it. By images of the places the ten most alike are chosen; each is aligned to the scan, and the
share of the floor plan that agrees decides (score; what is hidden from one of them counts half). An answer is 'found' if of what
both see (visible) more agrees than the map has taught that different places have in common, 'ambiguous' if another place agrees
nearly as well, else 'unsure'.

The other methods compare signatures alone: an answer is 'found' if its signature is nearer to that of the place than those of
any two different places are to each other. With the scans that the places are of, --refine aligns what is found to them,
point to plane; where that cannot tell the pose, it is that of the place. Places without poses are found by signatures alone.

The turn is how far the sensor has turned to the left since.

Examples:
  agv lidar3d places find street.places3d today.pcap --calibration db.xml
  agv lidar3d places find street.places3d velodyne_dist --every 10 --json
  agv lidar3d places find hall.places3d udp --sequence 4
  agv lidar3d places find street.places3d today.pcap --method enriched --refine drive.pcap

Keys of --json, one object a scan: scan, answer, place, place_scan, score, visible, distance, turn_deg, x_m, y_m,
heading_deg, share_on_surfaces, deviation_m. Score and visible are null for signatures, the distance for images, positions for places without poses,
and the last two for scans that --refine has not aligned.";

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum MethodName {
    /// Images, and the ten most alike aligned.
    Aligned,
    /// Normals, heights and ranges, 497 bytes.
    Enriched,
    /// Histogram of normals of the thesis, chi-square of counts.
    ChiSquare,
    /// Histogram of normals of the thesis, Sorensen.
    Sorensen,
    /// Chi-square of shares: does not depend on the number of points.
    NormalisedChiSquare,
    /// Sorensen of shares.
    NormalisedSorensen,
}

impl MethodName {
    /// The signatures that it compares; None if it aligns.
    fn signatures(self) -> Option<Method> {
        match self {
            Self::Aligned => None,
            Self::Enriched => Some(Method::Enriched),
            Self::ChiSquare => Some(Method::ChiSquare),
            Self::Sorensen => Some(Method::Sorensen),
            Self::NormalisedChiSquare => Some(Method::NormalisedChiSquare),
            Self::NormalisedSorensen => Some(Method::NormalisedSorensen),
        }
    }
}

/// Find out at which stored place each scan was taken.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Find {
    /// Places that 'agv lidar3d places index' has stored.
    places: PathBuf,
    #[command(flatten)]
    drive: Drive,
    /// What is compared; without it images, and of places without poses the enriched signature.
    #[arg(long)]
    method: Option<MethodName>,
    /// Signatures at a greater distance are unsure; learned from the places if absent.
    #[arg(long, requires = "method")]
    threshold: Option<f64>,
    /// Believe a signature only if the walls face the same way as well, against places that look alike.
    #[arg(long, requires = "method")]
    check: bool,
    /// The scans that the places are of: refines the poses of what signatures have found.
    #[arg(long, value_name = "SOURCE", value_parser = Source::parse, requires = "method")]
    refine: Option<Source>,
    /// So many scans of the way to each help to tell it, at least a metre apart.
    #[arg(long, value_name = "SCANS", default_value_t = 0, value_parser = clap::value_parser!(u8).range(..=50), conflicts_with = "method")]
    sequence: u8,
    /// Only every so many scans.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Print a JSON array.
    #[arg(long)]
    json: bool,
}

impl Find {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let map = place_map::read(&self.places)?;
        let has_poses = !map.places.is_empty() && map.places.iter().all(|place| place.pose.is_some());
        let usual = if has_poses { MethodName::Aligned } else { MethodName::Enriched };
        let rows = match self.method.unwrap_or(usual).signatures() {
            None => self.aligned(&map)?,
            Some(method) => self.by_signatures(&map, method)?,
        };
        if self.json {
            let objects: Vec<_> = rows.iter().map(|row| row.object(&map.places)).collect();
            println!("{}", serde_json::to_string_pretty(&objects)?);
            return Ok(());
        }
        println!("scan   answer     place    score  visible distance     turn        x        y");
        for row in rows {
            let at = row.pose.map_or_else(String::new, |[x, y, _]| format!(" {x:>8.2} {y:>8.2}"));
            let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.4}"));
            let score = number(row.agreement.map(|agreement| agreement.score.into()));
            let visible = number(row.agreement.map(|agreement| agreement.visible.into()));
            let distance = number(row.distance);
            let Row { scan, answer, place, turn, .. } = row;
            let turn = turn.to_degrees();
            println!("{scan:<6} {answer:<10} {place:>5} {score:>8} {visible:>8} {distance:>8} {turn:>7.1}°{at}");
        }
        Ok(())
    }

    fn is_wanted(&self, scan: usize) -> bool {
        scan.is_multiple_of(self.every as usize)
    }

    fn aligned(&self, map: &PlaceMap) -> anyhow::Result<Vec<Row>> {
        ensure!(
            self.threshold.is_none() && !self.check && self.refine.is_none(),
            "--threshold, --check and --refine are for methods that compare signatures"
        );
        let named = || format!("{}: the places have no poses", self.places.display());
        let search = PlaceSearch::new(map).with_context(named)?;
        ensure!(
            map.limit.is_some_and(|limit| limit > 0.0),
            "{}: which answers may be believed was not learnt when the places were indexed: they were too few, or their poses are wrong; index \
             them again, or name a --method that compares signatures",
            self.places.display()
        );
        let mut rows = Vec::new();
        let mut sequence = Sequence::new(self.sequence.into());
        let stop = stop::on_interrupt()?;
        self.drive().for_each(Some(map.standing), &stop, |scan, cloud, _| {
            if self.is_wanted(scan)
                && let Some(found) = search.find_next(cloud, &mut sequence)
            {
                rows.push(Row::of_alignment(scan, &found, &map.places[found.place]));
            }
            ControlFlow::Continue(())
        })?;
        Ok(rows)
    }

    fn drive(&self) -> Drive {
        Drive { source: self.drive.source.clone(), sensor: self.drive.sensor.clone() }
    }

    fn by_signatures(&self, map: &PlaceMap, method: Method) -> anyhow::Result<Vec<Row>> {
        let named = |path: &Path| path.display().to_string();
        let threshold = self.threshold.or_else(|| map.threshold(method)).with_context(|| {
            format!(
                "{}: the places are too few or too near to each other to learn a threshold; state --threshold",
                named(&self.places)
            )
        })?;
        let limits = Limits { distance: threshold, facing: if self.check { map.facing_threshold() } else { None } };
        let mut answers = Vec::new();
        let stop = stop::on_interrupt()?;
        self.drive().for_each(Some(map.standing), &stop, |scan, cloud, eye| {
            if !self.is_wanted(scan) {
                return ControlFlow::Continue(());
            }
            if let Some(answer) = map.find(method, &limits, &Signatures::new(cloud, eye.standing.height())) {
                let is_aligned = self.refine.is_some() && answer.is_believed;
                let surfaces = is_aligned.then(|| Surfaces::new(cloud).thinned());
                answers.push(Found { scan, answer, surfaces, alignment: None });
            }
            ControlFlow::Continue(())
        })?;
        if let Some(source) = &self.refine {
            refine(map, Drive { source: source.clone(), sensor: self.drive.sensor.clone() }, &stop, &mut answers)?;
        }
        Ok(answers.iter().map(|found| found.row(&map.places)).collect())
    }
}

/// What is told of a scan.
struct Row {
    scan: usize,
    answer: &'static str,
    place: usize,
    agreement: Option<Agreement>,
    distance: Option<f64>,
    /// Since the place, rad.
    turn: f64,
    /// x, y (m) and heading (rad) of the sensor, if that of the place is known.
    pose: Option<[f64; 3]>,
    refined: Option<Alignment>,
}

impl Row {
    fn of_alignment(scan: usize, found: &FoundPlace, place: &StoredPlace) -> Self {
        let answer = match (found.is_believed, found.is_ambiguous) {
            (true, false) => "found",
            (true, true) => "ambiguous",
            (false, _) => "unsure",
        };
        let turn = found.pose[2] - place.pose.map_or(0.0, |[_, _, heading]| heading);
        let turn = turn.sin().atan2(turn.cos());
        let (agreement, pose) = (Some(found.agreement), Some(found.pose));
        Self { scan, answer, place: found.place, agreement, distance: None, turn, pose, refined: None }
    }

    fn object(&self, places: &[StoredPlace]) -> serde_json::Value {
        let pose = self.pose;
        json!({
            "scan": self.scan,
            "answer": self.answer,
            "place": self.place,
            "place_scan": places[self.place].scan,
            "score": self.agreement.map(|agreement| agreement.score),
            "visible": self.agreement.map(|agreement| agreement.visible),
            "distance": self.distance,
            "turn_deg": self.turn.to_degrees(),
            "x_m": pose.map(|pose| pose[0]),
            "y_m": pose.map(|pose| pose[1]),
            "heading_deg": pose.map(|pose| pose[2].to_degrees()),
            "share_on_surfaces": self.refined.map(|alignment| alignment.share),
            "deviation_m": self.refined.map(|alignment| alignment.deviation),
        })
    }
}

/// What signatures have found for a scan.
struct Found {
    scan: usize,
    answer: Answer,
    /// Points that are still to be aligned.
    surfaces: Option<Surfaces>,
    alignment: Option<Alignment>,
}

impl Found {
    fn row(&self, places: &[StoredPlace]) -> Row {
        Row {
            scan: self.scan,
            answer: if self.answer.is_believed { "found" } else { "unsure" },
            place: self.answer.place,
            agreement: None,
            distance: Some(self.answer.distance),
            turn: self.turn(),
            pose: self.pose(&places[self.answer.place]),
            refined: self.alignment,
        }
    }

    /// By which the sensor has turned to the left since, rad.
    fn turn(&self) -> f64 {
        self.alignment.map_or(self.answer.turn, |alignment| alignment.turn())
    }

    /// x, y (m) and heading (rad) of the sensor, if that of the place is known.
    fn pose(&self, place: &StoredPlace) -> Option<[f64; 3]> {
        let [x, y, heading] = place.pose?;
        let shift = self.alignment.map_or(Vector3::zeros(), |alignment| alignment.pose.translation.vector);
        let (sin, cos) = heading.sin_cos();
        Some([x + cos * shift.x - sin * shift.y, y + sin * shift.x + cos * shift.y, heading + self.turn()])
    }
}

/// Aligns what was found to the scans of the places.
fn refine(map: &PlaceMap, drive: Drive, stop: &AtomicBool, answers: &mut [Found]) -> anyhow::Result<()> {
    let name = drive.source.name();
    let mut of_scan: BTreeMap<usize, Vec<&mut Found>> = BTreeMap::new();
    for found in answers.iter_mut().filter(|found| found.surfaces.is_some()) {
        of_scan.entry(map.places[found.answer.place].scan).or_default().push(found);
    }
    drive.for_each(Some(map.standing), stop, |scan, cloud, _| {
        let wanted = of_scan.remove(&scan).unwrap_or_default();
        if let Some(target) = (!wanted.is_empty()).then(|| Target::new(Surfaces::new(cloud))).flatten() {
            for found in wanted {
                let surfaces = found.surfaces.take();
                found.alignment = surfaces.and_then(|surfaces| target.align(&surfaces, found.answer.turn));
            }
        }
        if of_scan.is_empty() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    let is_stopped = stop.load(Ordering::Relaxed);
    ensure!(is_stopped || of_scan.is_empty(), "{name}: it has fewer scans than the places are of");
    Ok(())
}
