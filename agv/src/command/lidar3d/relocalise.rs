//! The vehicle finds out where a drive begins: `agv replay --relocalise`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use agv_core::geometry::Pose;
use agv_core::localizer::PoseFix;
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::lidar3d::Source;
use agv_host_sim::lidar3d::place_map;
use agv_host_sim::lidar3d::place_search::PlaceSearch;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::{find_start, find_start_by_contours};
use anyhow::{Context, bail};

use super::arguments::SensorArguments;
use super::places::Drive;
use crate::command::stop;

/// Standard deviations of the pose that an alignment finds, m and rad.
const POSITION_DEVIATION: f64 = 0.2;
const HEADING_DEVIATION: f64 = 1.0 * std::f64::consts::PI / 180.0;
/// Scans that are looked at for a place, at the most.
const SCANS: usize = 20;

/// Where the vehicle is at the start, from what its sensors see.
#[derive(clap::Args)]
pub struct Relocalisation {
    /// Find the place where the drive begins; poses that the log tells are not used.
    #[arg(long, value_name = "SENSOR")]
    relocalise: Option<By>,
    /// Places with poses that 'agv lidar3d places index' has stored.
    #[arg(long, value_name = "FILE", requires = "relocalise", required_if_eq("relocalise", "lidar3d"))]
    places: Option<PathBuf>,
    /// Scans that were taken as the drive began: capture or folder of range images.
    #[arg(
        long,
        value_name = "SOURCE",
        value_parser = Source::parse,
        requires = "relocalise",
        required_if_eq("relocalise", "lidar3d")
    )]
    scans: Option<Source>,
    /// Pose of that sensor on the vehicle, seen from the logical point: X,Y,HEADING in m, m and deg.
    #[arg(long, value_name = "POSE", default_value = "0,0,0", value_parser = pose, allow_hyphen_values = true)]
    mount: Pose,
    #[command(flatten)]
    sensor: SensorArguments,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum By {
    /// The reflectors of the map, as the controller does it.
    Reflectors,
    /// The surfaces of a map of contours, as the controller does it.
    Contours,
    /// Multi-beam lidar.
    Lidar3d,
}

fn pose(text: &str) -> Result<Pose, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, heading]) if [x, y, heading].iter().all(|value| value.is_finite()) => {
            Ok(Pose::new(x, y, heading.to_radians()))
        }
        _ => Err("three numbers are expected".to_owned()),
    }
}

impl Relocalisation {
    /// Whether it is asked for.
    pub fn is_wanted(&self) -> bool {
        self.relocalise.is_some()
    }

    /// Replaces the poses that a recording tells by the one that is found. Does nothing if nobody asks.
    pub fn apply(&self, recording: &mut Recording, contours: Option<&ContourMap>) -> anyhow::Result<()> {
        let (before, fix) = match (self.relocalise, &self.places, &self.scans) {
            (Some(By::Reflectors), _, _) => {
                let (event, fix) = find_start(recording).context("the vehicle does not find itself")?;
                (event + 1, fix)
            }
            (Some(By::Contours), _, _) => {
                let map = contours.context("--relocalise contours: no map of contours is given (--map)")?;
                let map = map.view();
                let (event, fix) =
                    find_start_by_contours(recording, &map).context("the vehicle does not find itself")?;
                (event + 1, fix)
            }
            (Some(By::Lidar3d), Some(path), Some(source)) => (0, self.fix(recording, path, source)?),
            _ => return Ok(()),
        };
        let place = recording.events.iter().take(before).filter(|event| !event.is_told()).count();
        recording.events.retain(|event| !event.is_told());
        recording.events.insert(place, RecordedEvent::SetPose(fix));
        Ok(())
    }

    /// The pose of the logical point at the first event of a log, by a multi-beam lidar.
    fn fix(&self, recording: &Recording, path: &Path, source: &Source) -> anyhow::Result<PoseFix> {
        let map = place_map::read(path)?;
        let named = || format!("{}: the places have no poses", path.display());
        let search = PlaceSearch::new(&map).with_context(named)?;
        let (mut found, mut asked) = (None, 0);
        let drive = Drive { source: source.clone(), sensor: self.sensor.clone() };
        let stop = stop::on_interrupt()?;
        drive.for_each(Some(map.standing), &stop, |_, cloud, _| {
            asked += 1;
            found = search.find(cloud).filter(|answer| answer.is_believed && !answer.is_ambiguous);
            if found.is_some() || asked >= SCANS { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let Some(found) = found else { bail!("{}: none of {asked} scans is of a stored place", source.name()) };
        let [x, y, heading] = found.pose;
        let sensor = Pose::new(x, y, heading);
        let time = recording.events.iter().filter_map(RecordedEvent::time).min();
        Ok(PoseFix {
            time: time.context("the log has no events")?,
            pose: sensor.compose(&self.mount.inverse()),
            position_deviation: POSITION_DEVIATION,
            heading_deviation: HEADING_DEVIATION,
        })
    }
}
