//! `agv lidar3d bridge`.

use std::net::TcpListener;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use agv_core::measurement::Time;
use agv_host_sim::lidar3d::cloud_speed::CloudSpeed;
use agv_host_sim::lidar3d::place_map::{self, PlaceMap};
use agv_host_sim::lidar3d::place_search::PlaceSearch;
use agv_host_sim::lidar3d::projection::{Projected, Projection};
use agv_host_sim::lidar3d::{Revolution, Source};
use agv_host_sim::link::nav350::PORT;
use agv_host_sim::serve::nav350::{Drive, Nav350, Options, Turn};
use agv_host_sim::text_file;
use agv_lidar3d::cloud::{Cloud, RingOrder};
use agv_wire::nav350::SensorFrame;
use anyhow::{Context, ensure};
use nalgebra::Rotation3;
use serde_json::Value;

use super::arguments::{SOURCES, SensorArguments};
use crate::command::output::note;
use crate::command::stop;

const HELP: &str = "\
Each cloud becomes a turn of a planar laser: a level slice at the height of the sensor, every point moved to the time of its beam by the
speed that the clouds themselves tell, and reflectors where returns are bright. A controller connects to this machine instead of the
laser; its laser stands where the lidar stands, with the lidar's yaw. A recording is served at its own pace.

Examples:
  agv lidar3d bridge udp --mount mount.json
  agv lidar3d bridge udp --height 1.9 --bright 100 --places hall.places3d
  agv lidar3d bridge drive.pcap --height 1.9 --serve-port 2113";

/// Serve the clouds of a sensor as scans of a NAV350.
#[derive(clap::Args)]
#[command(after_help = HELP, after_long_help = format!("{SOURCES}\n\n{HELP}"))]
pub struct Bridge {
    /// udp[:PORT], or a capture or clouds that are served at their own pace.
    #[arg(value_name = "SOURCE", value_parser = Source::parse)]
    source: Source,
    #[command(flatten)]
    sensor: SensorArguments,
    /// Height, roll and pitch as 'agv lidar3d mount' has written them.
    #[arg(long, value_name = "JSON", required_unless_present = "height")]
    mount: Option<PathBuf>,
    /// Height of a level sensor above the floor, m.
    #[arg(long, value_name = "M", conflicts_with = "mount")]
    height: Option<f64>,
    /// Returns of more than this intensity are of reflectors; without it none are. Velodynes give reflectors more than 100.
    #[arg(long, value_name = "INTENSITY")]
    bright: Option<u16>,
    /// Tell the place of the first cloud that is recognised.
    #[arg(long, value_name = "FILE")]
    places: Option<PathBuf>,
    /// Port on which controllers are served.
    #[arg(long = "serve-port", default_value_t = PORT)]
    serve_port: u16,
}

/// Time between two clouds of files, which state none, s.
const INTERVAL: f64 = 0.1;

impl Bridge {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let (height, levelling) = self.standing()?;
        let places = self.places.as_deref().map(place_map::read).transpose()?;
        let stop = stop::on_interrupt()?;
        let source = self.source.clone().open(&self.sensor.options(), &stop)?;
        let setup = source.setup()?;
        let frame = SensorFrame::default();
        let projection = Projection { levelling, height, bright: self.bright, frame };
        let listener =
            TcpListener::bind(("0.0.0.0", self.serve_port)).with_context(|| format!("port {}", self.serve_port))?;
        note(&format!("serving {} on port {}", self.source.name(), listener.local_addr()?.port()));
        let server = Nav350::new(Drive::live(frame), Options::default());
        let is_over = AtomicBool::new(false);
        let mut pace = Pace { is_live: matches!(self.source, Source::Live(_)), shift: None };
        let mut place = FirstPlace { order: RingOrder::new(&setup.lasers), map: places };
        let mut speed = CloudSpeed::new(levelling, height);
        let mut number = 0;
        let served = std::thread::scope(|scope| {
            let serving = scope.spawn(|| server.serve(&listener, &is_over));
            let read = source.revolutions(&stop, |mut revolution| {
                if !revolution.is_whole {
                    return ControlFlow::Continue(());
                }
                number += 1;
                if revolution.start == Time::default() {
                    revolution.start = Time::from_seconds(INTERVAL * f64::from(number));
                }
                place.look(&revolution);
                let seen = projection.project(&revolution, speed.speed(&revolution));
                pace.wait(&seen, &server, &stop);
                server.see(turn(seen, &frame, pace.shift.unwrap_or(0.0)));
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            is_over.store(true, Ordering::Relaxed);
            let serving = serving.join().unwrap_or(Ok(()));
            read.map(|_| serving)
        });
        served??;
        ensure!(number > 0, "{}: there is no whole revolution", self.source.name());
        Ok(())
    }

    /// Height, m, and what makes points level.
    fn standing(&self) -> anyhow::Result<(f64, Rotation3<f64>)> {
        if let Some(height) = self.height {
            ensure!(height > 0.0 && height < 50.0, "--height must be from 0 to 50 m");
            return Ok((height, Rotation3::identity()));
        }
        let path = self.mount.as_deref().unwrap_or(Path::new(""));
        let text = text_file::read(path, "a mount (JSON)")?;
        let value: Value = serde_json::from_str(&text)
            .with_context(|| format!("{}: this is no mount that 'agv lidar3d mount' has written", path.display()))?;
        let number = |key: &str| {
            let known = value.get(key).and_then(|known| known.get("value")).and_then(Value::as_f64);
            known.with_context(|| format!("{}: {key} is left open", path.display()))
        };
        let (roll, pitch) = (number("roll_deg")?.to_radians(), number("pitch_deg")?.to_radians());
        Ok((number("height_m")?, Rotation3::from_euler_angles(roll, pitch, 0.0)))
    }
}

/// When clouds are served.
struct Pace {
    is_live: bool,
    /// From the time of the source to that of the server, s.
    shift: Option<f64>,
}

impl Pace {
    /// Waits until a recorded turn has ended. Of a live one the least delay ever seen is taken for that of the network.
    fn wait(&mut self, seen: &Projected, server: &Nav350, stop: &AtomicBool) {
        let end = seen.scan.start.offset(seen.scan.beam_interval * seen.scan.ranges.len() as f64);
        let shift = server.now() - end.since(Time::default());
        self.shift = Some(match self.shift {
            Some(known) if self.is_live => known.min(shift),
            Some(known) => known,
            None => shift,
        });
        while !self.is_live && !stop.load(Ordering::Relaxed) {
            let early = end.since(Time::default()) + self.shift.unwrap_or(0.0) - server.now();
            if early <= 0.0 {
                break;
            }
            std::thread::sleep(Duration::from_secs_f64(early.min(0.05)));
        }
    }
}

/// A turn in the time of the server.
fn turn(seen: Projected, frame: &SensorFrame, shift: f64) -> Turn {
    let moved = |time: Time| time.offset(shift);
    let mut turn = Turn::of(&seen.scan, frame);
    turn.start = moved(turn.start);
    turn.reflectors = seen.reflectors.observations;
    for reflector in &mut turn.reflectors {
        reflector.time = moved(reflector.time);
    }
    turn
}

/// Looks where the sensor is until it knows.
struct FirstPlace {
    order: RingOrder,
    map: Option<PlaceMap>,
}

impl FirstPlace {
    fn look(&mut self, revolution: &Revolution) {
        let Some(map) = &self.map else { return };
        let points = revolution.organised(&self.order, revolution.columns().max(1));
        let found = PlaceSearch::new(map)
            .zip(Cloud::new(&points, self.order.rings()))
            .and_then(|(search, cloud)| search.find(&cloud))
            .filter(|found| found.is_believed && !found.is_ambiguous);
        if let Some(found) = found {
            let [x, y, heading] = found.pose;
            note(&format!(
                "the sensor is at {x:.2} {y:.2} m, {:.1} deg; agreement {:.2}",
                heading.to_degrees(),
                found.score
            ));
            self.map = None;
        }
    }
}
