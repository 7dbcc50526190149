//! `agv lidar3d places`.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use agv_host_sim::import::poses;
use agv_host_sim::lidar3d::Source;
use agv_host_sim::lidar3d::place_map::{self, Answer, Limits, PlaceMap, StoredPlace};
use agv_host_sim::lidar3d::refinement::{Alignment, Surfaces, Target};
use agv_host_sim::lidar3d::signatures::{Method, Signatures, sensor_height};
use agv_lidar3d::cloud::{Cloud, RingOrder};
use agv_lidar3d::place::KeySignatures;
use anyhow::{Context, ensure};
use nalgebra::Vector3;
use serde_json::json;

use super::arguments::{SOURCES, SensorArguments};
use crate::command::evaluate::Lidar3dPlaces as Evaluate;
use crate::command::{output, progress, stop};

/// Store places as signatures of a few hundred bytes, and find out where a scan was taken.
#[derive(clap::Args)]
pub struct Places {
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand)]
enum Action {
    Index(Index),
    Find(Find),
    Evaluate(Evaluate),
}

impl Places {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        match self.action {
            Action::Index(command) => command.run(),
            Action::Find(command) => command.run(),
            Action::Evaluate(command) => command.run(),
        }
    }
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum MethodName {
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

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Enriched => Self::Enriched,
            MethodName::ChiSquare => Self::ChiSquare,
            MethodName::Sorensen => Self::Sorensen,
            MethodName::NormalisedChiSquare => Self::NormalisedChiSquare,
            MethodName::NormalisedSorensen => Self::NormalisedSorensen,
        }
    }
}

/// The source of the scans of a drive.
#[derive(clap::Args)]
pub struct Drive {
    /// Capture, folder of range images, or udp[:PORT].
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    pub source: Source,
    /// The sensor and its parameters.
    #[command(flatten)]
    pub sensor: SensorArguments,
}

impl Drive {
    /// Calls `take` with the number and the signatures of each whole revolution. The height of the sensor is that of
    /// `height`, or is determined from the first revolution. Returns it.
    pub fn for_each(
        self,
        height: Option<f32>,
        mut take: impl FnMut(usize, Signatures) -> ControlFlow<()>,
    ) -> anyhow::Result<f32> {
        let stop = stop::on_interrupt()?;
        self.for_each_scan(height, &stop, |scan, cloud, height| take(scan, Signatures::new(cloud, height)))
    }

    /// As [`Self::for_each`], with the points and the height of the sensor.
    fn for_each_scan(
        self,
        height: Option<f32>,
        stop: &AtomicBool,
        mut take: impl FnMut(usize, &Cloud<'_>, f32) -> ControlFlow<()>,
    ) -> anyhow::Result<f32> {
        let name = self.source.name();
        let source = self.source.open(&self.sensor.options(), stop)?;
        let setup = source.setup()?;
        let order = RingOrder::new(&setup.lasers);
        let bar = progress::bar("signatures", source.length().unwrap_or(0));
        let (mut number, mut height, mut columns) = (0, height, None);
        source.revolutions(stop, |revolution| {
            bar.inc(1);
            if !revolution.is_whole {
                return ControlFlow::Continue(());
            }
            let points = revolution.organised(&order, *columns.get_or_insert_with(|| revolution.columns().max(1)));
            let Some(cloud) = Cloud::new(&points, order.rings()) else { return ControlFlow::Continue(()) };
            let height = *height.get_or_insert_with(|| sensor_height(&points));
            number += 1;
            take(number - 1, &cloud, height)
        })?;
        bar.finish_and_clear();
        height.with_context(|| format!("{name}: there is no whole revolution"))
    }
}

const INDEX_HELP: &str = "\
With poses, a scan becomes a place if it is further than --shift from the place before. Without, it becomes one if its
signature differs more from that of the place before than the first scans do among themselves (thesis M, 5.1.5).

Examples:
  agv lidar3d places index drive.pcap --calibration db.xml --poses poses.txt --output street.places3d
  agv lidar3d places index velodyne_dist --output street.places3d --json

Keys of --json: scans, places, sensor_height_m.";

/// Store the places of a drive.
#[derive(clap::Args)]
#[command(after_help = INDEX_HELP, after_long_help = format!("{SOURCES}\n\n{INDEX_HELP}"))]
struct Index {
    #[command(flatten)]
    drive: Drive,
    /// Pose of the sensor at each scan: a line of twelve numbers, three rows of rotation and translation, m.
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Distance between two places, m, where poses are known.
    #[arg(long, default_value_t = 2.0)]
    shift: f64,
    /// File to write; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl Index {
    fn run(self) -> anyhow::Result<()> {
        ensure!(self.shift >= 0.0 && self.shift.is_finite(), "--shift must not be negative");
        let poses = self.poses.as_deref().map(poses::read).transpose()?;
        let mut places: Vec<StoredPlace> = Vec::new();
        let (mut scans, mut missing) = (0, None);
        let mut keys = KeySignatures::default();
        let sensor_height = self.drive.for_each(None, |scan, signatures| {
            scans += 1;
            let pose = match &poses {
                None => None,
                Some(poses) => match poses.get(scan) {
                    Some(pose) => Some(*pose),
                    None => {
                        missing = Some(poses.len());
                        return ControlFlow::Break(());
                    }
                },
            };
            let is_place = match pose {
                Some([x, y, _]) => places
                    .last()
                    .and_then(|place| place.pose)
                    .is_none_or(|last| (x - last[0]).hypot(y - last[1]) >= self.shift),
                None => keys.is_key(&signatures.counts),
            };
            if is_place {
                places.push(StoredPlace { scan, pose, signatures });
            }
            ControlFlow::Continue(())
        })?;
        if let (Some(count), Some(path)) = (missing, &self.poses) {
            anyhow::bail!("{}: it holds {count} poses, fewer than there are scans", path.display());
        }
        let map = PlaceMap { sensor_height, places };
        place_map::write(&self.output, &map)?;
        if self.json {
            println!("{}", json!({ "scans": scans, "places": map.places.len(), "sensor_height_m": sensor_height }));
        } else {
            output::print_rows(&[
                ["scans".to_owned(), scans.to_string()],
                ["places".to_owned(), map.places.len().to_string()],
                ["sensor height".to_owned(), format!("{sensor_height:.2} m")],
            ]);
        }
        Ok(())
    }
}

const FIND_HELP: &str = "\
Each scan is looked at by itself. An answer is 'found' if its signature is nearer to that of the place than those of any two
different places are to each other, else 'unsure'. The turn is how far the sensor has turned to the left since. With the
scans that the places are of, --refine aligns what is found to them, point to plane; where that cannot tell the pose, it is
that of the place.

Examples:
  agv lidar3d places find street.places3d today.pcap --calibration db.xml
  agv lidar3d places find street.places3d today.pcap --calibration db.xml --refine drive.pcap
  agv lidar3d places find street.places3d velodyne_dist --every 10 --json

Keys of --json, one object a scan: scan, answer, place, place_scan, distance, turn_deg, x_m, y_m, heading_deg, share_on_surfaces,
deviation_m; positions are null for places without poses, the last two for scans that were not aligned.";

/// Find out at which stored place each scan was taken.
#[derive(clap::Args)]
#[command(after_help = FIND_HELP, after_long_help = format!("{SOURCES}\n\n{FIND_HELP}"))]
struct Find {
    /// Places that 'agv lidar3d places index' has stored.
    places: PathBuf,
    #[command(flatten)]
    drive: Drive,
    /// What is compared.
    #[arg(long, default_value = "enriched")]
    method: MethodName,
    /// Answers at a greater distance are unsure; learned from the places if absent.
    #[arg(long)]
    threshold: Option<f64>,
    /// Believe an answer only if the walls face the same way as well, against places that look alike.
    #[arg(long)]
    check: bool,
    /// The scans that the places are of: refines the poses of what is found.
    #[arg(long, value_name = "SOURCE", value_parser = Source::parse)]
    refine: Option<Source>,
    /// Only every so many scans.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Print a JSON array.
    #[arg(long)]
    json: bool,
}

impl Find {
    fn run(self) -> anyhow::Result<()> {
        let map = place_map::read(&self.places)?;
        let method = Method::from(self.method);
        let named = |path: &Path| path.display().to_string();
        let threshold = self.threshold.or_else(|| map.threshold(method)).with_context(|| {
            format!(
                "{}: the places are too few or too near to each other to learn a threshold; state --threshold",
                named(&self.places)
            )
        })?;
        let limits = Limits { distance: threshold, facing: if self.check { map.facing_threshold() } else { None } };
        let sensor = self.drive.sensor.clone();
        let mut answers = Vec::new();
        let stop = stop::on_interrupt()?;
        self.drive.for_each_scan(Some(map.sensor_height), &stop, |scan, cloud, height| {
            if scan % self.every as usize != 0 {
                return ControlFlow::Continue(());
            }
            if let Some(answer) = map.find(method, &limits, &Signatures::new(cloud, height)) {
                let is_aligned = self.refine.is_some() && answer.is_believed;
                let surfaces = is_aligned.then(|| Surfaces::new(cloud).thinned());
                answers.push(Found { scan, answer, surfaces, alignment: None });
            }
            ControlFlow::Continue(())
        })?;
        if let Some(source) = self.refine {
            refine(&map, Drive { source, sensor }, &stop, &mut answers)?;
        }
        if self.json {
            let objects: Vec<_> = answers.iter().map(|found| found.object(&map.places)).collect();
            println!("{}", serde_json::to_string_pretty(&objects)?);
            return Ok(());
        }
        println!("scan   answer  place  distance     turn        x        y");
        for found in answers {
            let Found { scan, answer, .. } = &found;
            let name = if answer.is_believed { "found" } else { "unsure" };
            let [x, y, _] = found.pose(&map.places[answer.place]).unwrap_or([f64::NAN; 3]);
            let at = if x.is_nan() { String::new() } else { format!(" {x:>8.2} {y:>8.2}") };
            let (place, distance, turn) = (answer.place, answer.distance, found.turn().to_degrees());
            println!("{scan:<6} {name:<7} {place:>5} {distance:>9.4} {turn:>7.1}°{at}");
        }
        Ok(())
    }
}

/// What was found for a scan.
struct Found {
    scan: usize,
    answer: Answer,
    /// Points that are still to be aligned.
    surfaces: Option<Surfaces>,
    alignment: Option<Alignment>,
}

impl Found {
    fn object(&self, places: &[StoredPlace]) -> serde_json::Value {
        let Self { scan, answer, alignment, .. } = self;
        let place = &places[answer.place];
        let pose = self.pose(place);
        json!({
            "scan": scan,
            "answer": if answer.is_believed { "found" } else { "unsure" },
            "place": answer.place,
            "place_scan": place.scan,
            "distance": answer.distance,
            "turn_deg": self.turn().to_degrees(),
            "x_m": pose.map(|pose| pose[0]),
            "y_m": pose.map(|pose| pose[1]),
            "heading_deg": pose.map(|pose| pose[2].to_degrees()),
            "share_on_surfaces": alignment.map(|alignment| alignment.share),
            "deviation_m": alignment.map(|alignment| alignment.deviation),
        })
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
    drive.for_each_scan(Some(map.sensor_height), stop, |scan, cloud, _| {
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
