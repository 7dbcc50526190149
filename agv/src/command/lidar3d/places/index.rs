//! `agv lidar3d places index`.

use std::ops::ControlFlow;
use std::path::PathBuf;

use agv_host_sim::import::poses;
use agv_host_sim::lidar3d::place_map::{self, PlaceMap, StoredPlace};
use agv_host_sim::lidar3d::place_search::PlaceSearch;
use agv_host_sim::lidar3d::signatures::Signatures;
use agv_host_sim::lidar3d::view::{Standing, View};
use agv_lidar3d::place::KeySignatures;
use anyhow::ensure;
use serde_json::json;

use super::Drive;
use crate::command::lidar3d::arguments::SOURCES;
use crate::command::{import_summary, output, progress, stop};

const HELP: &str = "\
With poses, a scan becomes a place if it is further than --shift from the place before, and from places that look alike it is
learnt which answers may be believed. Without, it becomes one if its signature differs more from that of the place before than
the first scans do among themselves (thesis M, 5.1.5).

Examples:
  agv lidar3d places index drive.pcap --calibration db.xml --poses poses.txt --output street.places3d
  agv lidar3d places index drive.pcap --poses poses.txt --height 1.9 --output hall.places3d
  agv lidar3d places index velodyne_dist --output street.places3d --json

Keys of --json: scans, places, sensor_height_m, limit; the last is null without poses.";

/// Store the places of a drive.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Index {
    #[command(flatten)]
    drive: Drive,
    /// Pose of the sensor at each scan: a line of twelve numbers, three rows of rotation and translation, m.
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// Distance between two places, m, where poses are known.
    #[arg(long, default_value_t = 2.0)]
    shift: f64,
    /// Height of a level sensor above the floor, m; without it, height and leaning are found in each scan.
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    height: Option<f32>,
    /// File to write; an older one is replaced.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl Index {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!(self.shift >= 0.0 && self.shift.is_finite(), "--shift must not be negative");
        ensure!(self.height.is_none_or(|height| height > 0.0 && height < 50.0), "--height must be from 0 to 50 m");
        let poses = self.poses.as_deref().map(poses::read_all).transpose()?;
        let account = poses.as_ref().map(|found| found.account.clone()).unwrap_or_default();
        let poses = poses.map(|found| found.poses);
        let mut places: Vec<StoredPlace> = Vec::new();
        let (mut scans, mut missing, mut rings) = (0, None, 0);
        let mut keys = KeySignatures::default();
        let stop = stop::on_interrupt()?;
        let eye = self.drive.for_each(self.height.map(Standing::Given), &stop, |scan, cloud, eye| {
            scans += 1;
            rings = cloud.rings();
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
            let last = places.last().and_then(|place| place.pose);
            let is_far = |[x, y, _]: [f64; 3]| last.is_none_or(|last| (x - last[0]).hypot(y - last[1]) >= self.shift);
            // Of scans with poses that are near to the last place nothing is wanted.
            if pose.is_some_and(|pose| !is_far(pose)) {
                return ControlFlow::Continue(());
            }
            let signatures = Signatures::new(cloud, eye.standing.height());
            if pose.is_some() || keys.is_key(&signatures.counts) {
                let view = View::new(cloud, &eye.standing.floor(cloud), eye.span);
                places.push(StoredPlace { scan, pose, signatures, view });
            }
            ControlFlow::Continue(())
        })?;
        if let (Some(count), Some(path)) = (missing, &self.poses) {
            anyhow::bail!("{}: it holds {count} poses, fewer than there are scans", path.display());
        }
        let mut map = PlaceMap { standing: eye.standing, rings, span: eye.span, limit: None, places };
        // Places of which none has a neighbour teach nothing.
        map.limit = learnt_limit(&map).filter(|limit| *limit > 0.0);
        let mut warnings = account.warnings();
        if map.limit.is_none() && poses.is_some() {
            let count = map.places.len();
            warnings.push(format!(
                "which answers may be believed could not be learnt from {count} places: 'find' by aligned scans will refuse them; index more of the drive, or check the poses"
            ));
        }
        place_map::write(&self.output, &map)?;
        let height = map.standing.height();
        if self.json {
            let summary =
                json!({ "scans": scans, "places": map.places.len(), "sensor_height_m": height, "limit": map.limit });
            println!("{summary}");
            account.notes().iter().for_each(|text| output::note(&format!("note: {text}")));
            warnings.iter().for_each(|text| output::note(&format!("warning: {text}")));
        } else {
            output::print_rows(&[
                ["scans".to_owned(), scans.to_string()],
                ["places".to_owned(), map.places.len().to_string()],
                ["sensor height".to_owned(), format!("{height:.2} m")],
                ["believed from".to_owned(), map.limit.map_or("-".to_owned(), |limit| format!("{limit:.2}"))],
            ]);
            import_summary::print_words(account.notes(), &warnings);
        }
        Ok(())
    }
}

/// From which agreement of what is visible on answers are believed; None without poses.
fn learnt_limit(map: &PlaceMap) -> Option<f32> {
    let search = PlaceSearch::new(map)?;
    let bar = progress::bar("look-alikes", 0);
    let limit = search.learnt_limit(|places| {
        bar.set_length(places as u64);
        bar.inc(1);
    });
    bar.finish_and_clear();
    Some(limit)
}
