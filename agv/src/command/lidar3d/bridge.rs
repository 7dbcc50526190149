//! `agv lidar3d bridge`.

use std::net::TcpListener;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use agv_core::geometry::Pose;
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
laser (nav350.address, nav350.port); its laser stands where the lidar stands, with the lidar's yaw in radians (laser.x, laser.y,
laser.theta). A recording is served at its own pace.

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
/// Revolutions that may wait for the one before.
const WAITING: usize = 2;

impl Bridge {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let Standing { height, levelling, mount } = self.standing()?;
        let places = self.places.as_deref().map(place_map::read).transpose()?;
        let stop = stop::on_interrupt()?;
        let is_live = self.source.is_live();
        let listener =
            TcpListener::bind(("0.0.0.0", self.serve_port)).with_context(|| format!("port {}", self.serve_port))?;
        if is_live {
            note(&format!("waiting for a sensor on {}", self.source.name()));
        }
        let source = self.source.clone().open(&self.sensor.options(), &stop)?;
        let setup = source.setup()?;
        let frame = SensorFrame::default();
        note(&format!("serving {} on port {}", self.source.name(), listener.local_addr()?.port()));
        let server = Nav350::new(Drive::live(frame), Options::default());
        let shift = source.began().map(|began| server.now() - began.elapsed().as_secs_f64());
        let mut scans = Scans {
            projection: Projection { levelling, height, bright: self.bright, frame },
            speed: CloudSpeed::new(levelling, height),
            place: FirstPlace { order: RingOrder::new(&setup.lasers), map: places, mount },
            shift,
            number: 0,
        };
        let is_over = AtomicBool::new(false);
        let mut left_out = 0;
        let (number, served) = std::thread::scope(|scope| {
            let serving = scope.spawn(|| server.serve(&listener, &is_over));
            let (sender, receiver) = mpsc::sync_channel::<Revolution>(WAITING);
            let (server, stop) = (&server, &stop);
            let showing = scope.spawn(move || {
                receiver.iter().for_each(|revolution| scans.show(revolution, server, stop));
                scans.number
            });
            let read = source.revolutions(stop, |revolution| {
                // A sensor does not wait, and what it sends meanwhile would be lost.
                let is_taken = if !revolution.is_whole {
                    true
                } else if is_live {
                    sender.try_send(revolution).is_ok()
                } else {
                    sender.send(revolution).is_ok()
                };
                left_out += u32::from(!is_taken);
                if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            drop(sender);
            let number = showing.join().unwrap_or(0);
            is_over.store(true, Ordering::Relaxed);
            let serving = serving.join().unwrap_or(Ok(()));
            (number, read.map(|_| serving))
        });
        served??;
        ensure!(number > 0, "{}: there is no whole revolution", self.source.name());
        if left_out > 0 {
            note(&format!("{left_out} revolutions were left out: this machine is too slow for them"));
        }
        Ok(())
    }

    /// How the sensor stands.
    fn standing(&self) -> anyhow::Result<Standing> {
        if let Some(height) = self.height {
            ensure!(height > 0.0 && height < 50.0, "--height must be from 0 to 50 m");
            return Ok(Standing { height, levelling: Rotation3::identity(), mount: None });
        }
        let path = self.mount.as_deref().unwrap_or(Path::new(""));
        let text = text_file::read(path, "a mount (JSON)")?;
        let value: Value = serde_json::from_str(&text)
            .with_context(|| format!("{}: this is no mount that 'agv lidar3d mount' has written", path.display()))?;
        let known = |key: &str| value.get(key).and_then(|known| known.get("value")).and_then(Value::as_f64);
        let needed = |key: &str| known(key).with_context(|| format!("{}: {key} is left open", path.display()));
        let (height, roll, pitch) = (needed("height_m")?, needed("roll_deg")?, needed("pitch_deg")?);
        let mount = known("x_m").zip(known("y_m")).zip(known("yaw_deg"));
        Ok(Standing {
            height,
            levelling: Rotation3::from_euler_angles(roll.to_radians(), pitch.to_radians(), 0.0),
            mount: mount.map(|((x, y), yaw)| Pose::new(x, y, yaw.to_radians())),
        })
    }
}

/// How the sensor stands on the vehicle.
struct Standing {
    /// Above the floor, m.
    height: f64,
    /// What makes its points level.
    levelling: Rotation3<f64>,
    /// Its pose on the vehicle, if it is known.
    mount: Option<Pose>,
}

/// Makes turns of revolutions.
struct Scans {
    projection: Projection,
    speed: CloudSpeed,
    place: FirstPlace,
    /// From the time of the source to that of the server, s; that of a recording is known with its first turn.
    shift: Option<f64>,
    number: u32,
}

impl Scans {
    /// Shows a revolution to the controllers once its turn has ended.
    fn show(&mut self, mut revolution: Revolution, server: &Nav350, stop: &AtomicBool) {
        self.number += 1;
        if revolution.start == Time::default() {
            revolution.start = Time::from_seconds(INTERVAL * f64::from(self.number));
        }
        let seen = self.projection.project(&revolution, self.speed.speed(&revolution));
        let end = seen.scan.start.offset(seen.scan.beam_interval * seen.scan.ranges.len() as f64);
        let end = end.since(Time::default());
        let shift = *self.shift.get_or_insert(server.now() - end);
        while !stop.load(Ordering::Relaxed) {
            let early = end + shift - server.now();
            if early <= 0.0 {
                break;
            }
            std::thread::sleep(Duration::from_secs_f64(early.min(0.05)));
        }
        server.see(turn(seen, &self.projection.frame, shift));
        self.place.look(&revolution);
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
    mount: Option<Pose>,
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
            let sensor = Pose::new(x, y, heading);
            let (name, pose) = match &self.mount {
                Some(mount) => ("vehicle", sensor.compose(&mount.inverse())),
                None => ("sensor", sensor),
            };
            note(&format!(
                "the {name} is at {:.2} {:.2} m, {:.4} rad; agreement {:.2}",
                pose.x, pose.y, pose.theta, found.agreement.visible
            ));
            self.map = None;
        }
    }
}
