//! `agv lidar3d calibrate`.

use std::path::{Path, PathBuf};

use agv_host_sim::lidar3d::kind::Kind;
use agv_host_sim::lidar3d::{SetupOptions, Source, setup, stand};
use agv_host_sim::output_file;
use agv_host_sim::report::{Page, PointSet, Table, scatter_chart};
use agv_lidar3d::calibration::{Calibration, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::intrinsic::{self, Adjustment, Residual, Target};
use anyhow::{Context, bail, ensure};
use serde_json::json;

use super::arguments::{SOURCES, SensorArguments};
use super::held;
use crate::command::{output, progress, stop};

const HELP: &str = "\
Each SOURCE is one stand of the sensor before the same wall, or any other plane that is at most 45 degrees off upright; of
each, one revolution is used. D_corr, theta, alpha and the offsets of all lasers are found together with the planes; the
mean of alpha, which no plane can show, stays as it is, and so does what the scans hardly show: upright walls say little of
theta. A laser that saw too little of the planes is not changed. Where nothing is gained, nothing is written.

Examples:
  agv lidar3d calibrate stand*.pcap --calibration factory.xml --output found.xml
  agv lidar3d calibrate stand*.pcap --calibration factory.xml --output found.yaml --report report --json

Keys of --json: stands, lasers, not_observed, held {distance, elevation, rotation, vertical_offset, horizontal_offset: lasers},
  noise_m, range_error_m, rounds, worst_deviation {distance_m, elevation_deg, rotation_deg}, points [distance_m, deviation_m],
  factory {distance_m, elevation_deg, rotation_deg}, walls [stand, points, range_error_m, thickness_before_m, thickness_after_m, sum_of_squares_before_m2, sum_of_squares_after_m2].";

/// Find the parameters of all lasers from scans of a plane.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Calibrate {
    /// Scans of the plane, one stand each.
    #[arg(value_name = "SOURCE", value_parser = Source::parse, required = true)]
    sources: Vec<Source>,
    #[command(flatten)]
    sensor: SensorArguments,
    /// What is made small.
    #[arg(long, default_value = "along-beam")]
    residual: ResidualKind,
    /// Calibration file to write, .xml or .yaml; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Write a page with pictures to DIR/index.html.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
pub enum ResidualKind {
    /// Distance to the plane along the beam.
    AlongBeam,
    /// Distance to the plane at right angles (thesis M, equation 3.7).
    Perpendicular,
}

impl From<ResidualKind> for Residual {
    fn from(kind: ResidualKind) -> Self {
        match kind {
            ResidualKind::AlongBeam => Self::AlongBeam,
            ResidualKind::Perpendicular => Self::Perpendicular,
        }
    }
}

/// How a wall looks before and after.
#[derive(serde::Serialize)]
struct Wall {
    stand: String,
    points: usize,
    range_error_m: f64,
    thickness_before_m: f64,
    thickness_after_m: f64,
    sum_of_squares_before_m2: f64,
    sum_of_squares_after_m2: f64,
}

/// What the scans of the stands show.
struct Stands {
    names: Vec<String>,
    /// Parameters before the calibration.
    start: Vec<Laser>,
    targets: Vec<Target>,
}

impl Calibrate {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let write = writer(&self.output)?;
        let options = self.sensor.options();
        let stands = read_stands(&self.sources, &options)?;
        let Stands { names, start, targets } = &stands;
        let found = intrinsic::calibrate(start, options.offsets, self.residual.into(), targets)?;
        // What the file states beside the lasers stays as it is.
        let resolution = match &options.calibration {
            Some(path) => setup::read_calibration(path)?.distance_resolution,
            None => None,
        };
        let calibration = Calibration { distance_resolution: resolution, lasers: found.lasers.clone() };
        output_file::write(&self.output, write(&calibration)).with_context(|| self.output.display().to_string())?;
        let walls = walls(names, targets, options.offsets, (start, &found));
        let points_known = held::point_deviations(&found, options.offsets);
        if let Some(folder) = &self.report {
            let path = folder.join("index.html");
            let page = page(&stands, &found, &walls, options.offsets)?;
            page.write(&path).with_context(|| path.display().to_string())?;
        }
        if self.json {
            println!("{}", serde_json::to_string_pretty(&summary(&found, &walls, &points_known))?);
        } else {
            print(&found, &walls, &points_known);
        }
        Ok(())
    }
}

fn read_stands(sources: &[Source], options: &SetupOptions) -> anyhow::Result<Stands> {
    let stop = stop::on_interrupt()?;
    let bar = progress::bar("reading", sources.len() as u64);
    let mut start: Option<Vec<Laser>> = None;
    let mut stands = Stands { names: Vec::new(), start: Vec::new(), targets: Vec::new() };
    for (number, source) in sources.iter().enumerate() {
        let name = source.name();
        let source = source.clone().open(options, &stop)?;
        let setup = source.setup().with_context(|| name.clone())?;
        ensure!(
            matches!(setup.kind, Kind::Velodyne(_)),
            "{name}: only a Velodyne is calibrated; this is a {}",
            setup.kind.name()
        );
        let lasers = setup.lasers;
        let returns = stand::returns(source, &stop).with_context(|| name.clone())?;
        let target = intrinsic::segment(&lasers, options.offsets, &returns, number as u64);
        stands.targets.push(target.with_context(|| name.clone())?);
        stands.names.push(name);
        start.get_or_insert(lasers);
        bar.inc(1);
    }
    bar.finish_and_clear();
    stands.start = start.unwrap_or_default();
    Ok(stands)
}

fn not_observed(found: &Adjustment) -> Vec<usize> {
    (0..found.lasers.len()).filter(|laser| found.deviations[*laser].is_none()).collect()
}

/// Largest standard deviations: distance, m; elevation and rotation, deg.
fn worst_deviation(found: &Adjustment) -> [f64; 3] {
    let worst =
        |value: fn(&intrinsic::Deviation) -> f64| found.deviations.iter().flatten().map(value).fold(0.0, f64::max);
    [
        worst(|deviation| deviation.distance),
        worst(|deviation| deviation.elevation.to_degrees()),
        worst(|deviation| deviation.rotation.to_degrees()),
    ]
}

fn summary(found: &Adjustment, walls: &[Wall], points_known: &[held::PointDeviation]) -> serde_json::Value {
    let not_observed = not_observed(found);
    let [distance, elevation, rotation] = worst_deviation(found);
    json!({
        "stands": found.common_range_errors.len(),
        "lasers": found.lasers.len() - not_observed.len(),
        "not_observed": not_observed,
        "held": held::object(found),
        "noise_m": found.noise,
        "range_error_m": found.range_error,
        "points": points_known,
        "factory": {
            "distance_m": found.start_deviation.distance,
            "elevation_deg": found.start_deviation.elevation.to_degrees(),
            "rotation_deg": found.start_deviation.rotation.to_degrees(),
        },
        "rounds": found.rounds,
        "worst_deviation": { "distance_m": distance, "elevation_deg": elevation, "rotation_deg": rotation },
        "walls": walls,
    })
}

fn print(found: &Adjustment, walls: &[Wall], points_known: &[held::PointDeviation]) {
    let not_observed = not_observed(found);
    let [distance, elevation, rotation] = worst_deviation(found);
    let total = |value: fn(&Wall) -> f64| walls.iter().map(value).sum::<f64>();
    let (before, after) = (total(|wall| wall.sum_of_squares_before_m2), total(|wall| wall.sum_of_squares_after_m2));
    let points: usize = walls.iter().map(|wall| wall.points).sum();
    let thickness = |sum: f64| 1000.0 * (sum / points.max(1) as f64).sqrt();
    let mut rows = vec![
        ["stands".to_owned(), found.common_range_errors.len().to_string()],
        ["lasers".to_owned(), (found.lasers.len() - not_observed.len()).to_string()],
        ["noise".to_owned(), format!("{:.1} mm", 1000.0 * found.noise)],
        [
            "standard deviations".to_owned(),
            format!("at most {:.2} mm, theta {elevation:.4} deg, alpha {rotation:.4} deg", 1000.0 * distance),
        ],
        held::point_row(points_known),
        ["walls".to_owned(), format!("{:.1} -> {:.1} mm thick", thickness(before), thickness(after))],
    ];
    rows.extend(contradiction(walls));
    rows.extend(held::rows(found));
    if !not_observed.is_empty() {
        rows.push(["not observed".to_owned(), not_observed.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")]);
    }
    output::print_rows(&rows);
}

fn writer(path: &Path) -> anyhow::Result<fn(&Calibration) -> String> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("xml") => Ok(Calibration::to_db_xml),
        Some("yaml" | "yml") => Ok(Calibration::to_ros_yaml),
        _ => bail!("{}: the name does not end in .xml or .yaml", path.display()),
    }
}

fn walls(names: &[String], targets: &[Target], offsets: Offsets, (start, found): (&[Laser], &Adjustment)) -> Vec<Wall> {
    let wall = |((name, target), range_error): ((&String, &Target), &f64)| {
        let [before, after] =
            [start, &found.lasers].map(|lasers| intrinsic::flatness(lasers, offsets, &target.returns));
        let (before, after) = (before?, after?);
        Some(Wall {
            stand: name.clone(),
            points: before.points,
            range_error_m: *range_error,
            thickness_before_m: before.thickness(),
            thickness_after_m: after.thickness(),
            sum_of_squares_before_m2: before.sum_of_squares,
            sum_of_squares_after_m2: after.sum_of_squares,
        })
    };
    names.iter().zip(targets).zip(&found.common_range_errors).filter_map(wall).collect()
}

/// Ranges of two scans that differ by more than this contradict each other, m.
const CONTRADICTION: f64 = 0.01;

/// What the scans say against each other: the two whose ranges differ most.
fn contradiction(walls: &[Wall]) -> Option<[String; 2]> {
    let by = |a: &&Wall, b: &&Wall| a.range_error_m.total_cmp(&b.range_error_m);
    let (least, most) = (walls.iter().min_by(by)?, walls.iter().max_by(by)?);
    let apart = most.range_error_m - least.range_error_m;
    (apart > CONTRADICTION).then(|| {
        let text = format!("{:.0} mm longer in {} than in {}", 1000.0 * apart, most.stand, least.stand);
        ["ranges contradict".to_owned(), text]
    })
}

/// Points of a wall in a picture, at the most.
const DRAWN: usize = 3000;

fn page(stands: &Stands, found: &Adjustment, walls: &[Wall], offsets: Offsets) -> anyhow::Result<Page> {
    let mut page = Page::new("Calibration of a multi-beam lidar");
    page.section("Walls");
    let row = |wall: &Wall| {
        let millimetres = |value: f64| format!("{:.1}", 1000.0 * value);
        let (before, after) = (millimetres(wall.thickness_before_m), millimetres(wall.thickness_after_m));
        vec![wall.stand.clone(), wall.points.to_string(), before, after]
    };
    page.table(&Table {
        heading: ["stand", "points", "before, mm", "after, mm"].map(str::to_owned).to_vec(),
        rows: walls.iter().map(row).collect(),
    });
    let Stands { start, targets, .. } = stands;
    if let Some(target) = targets.get(targets.len() / 2) {
        let off = |lasers: &[Laser]| -> Vec<(f64, f64)> {
            let points = || target.returns.iter().filter_map(|seen| seen.point(lasers, offsets));
            let Some(plane) = intrinsic::Plane::fit(points()) else { return Vec::new() };
            let step = (target.returns.len() / DRAWN).max(1);
            let seen = target.returns.iter().zip(points()).step_by(step);
            seen.map(|(seen, point)| (seen.laser as f64, 1000.0 * plane.distance_of(point))).collect()
        };
        let (before, after) = (off(start), off(&found.lasers));
        let sets = [PointSet { name: "before", points: &before }, PointSet { name: "after", points: &after }];
        let chart = scatter_chart(["number of the laser", "distance from the plane of best fit, mm"], &sets, None)?;
        page.figure(&chart, "Points of one wall, laser by laser, before and after.");
    }
    page.section("Lasers");
    page.paragraph("Changes of the parameters, and the standard deviations of what was found.");
    page.table(&laser_table(start, found));
    Ok(page)
}

fn laser_table(start: &[Laser], found: &Adjustment) -> Table {
    let row = |(number, ((old, new), known)): (usize, ((&Laser, &Laser), &Option<intrinsic::Deviation>))| {
        let change = |old: f64, new: f64, scale: f64, digits: usize| format!("{:.digits$}", scale * (new - old));
        let degrees = 1f64.to_degrees();
        let mut row = vec![
            number.to_string(),
            change(old.distance, new.distance, 1000.0, 2),
            change(old.elevation, new.elevation, degrees, 4),
            change(old.rotation, new.rotation, degrees, 4),
        ];
        row.extend(match known {
            Some(known) => [
                format!("{:.2}", 1000.0 * known.distance),
                format!("{:.4}", known.elevation.to_degrees()),
                format!("{:.4}", known.rotation.to_degrees()),
            ],
            None => ["not observed".to_owned(), String::new(), String::new()],
        });
        row
    };
    let lasers = start.iter().zip(&found.lasers).zip(&found.deviations).enumerate();
    Table {
        heading: ["laser", "D mm", "theta deg", "alpha deg", "+- mm", "+- deg", "+- deg"].map(str::to_owned).to_vec(),
        rows: lasers.map(row).collect(),
    }
}
