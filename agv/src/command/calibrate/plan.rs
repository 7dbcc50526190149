//! `agv calibrate plan`.

use std::path::PathBuf;

use agv_core::geometry::Pose;
use agv_core::odometry::Tricycle;
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::calibrate::plan::{Means, Plan as Planned, plan};
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::output_file;
use agv_host_sim::simulate::path::Direction;
use agv_host_sim::simulate::scenario::{Scenario, believed_parameters};
use anyhow::{Context, ensure};
use serde::Serialize;

use super::super::output;
use super::Named;

const HELP: &str = "\
Examples:
  agv calibrate plan --area 14x11
  agv calibrate plan --area 14x11 --steering 18..50 --time 900 --scenario plan.toml
  agv simulate plan.toml --output drive.agvlog && agv calibrate drive.agvlog

Deviations are expected for 16 reflectors around the area, 64 revolutions at each stop, slip of 0.05 % at a metre and an
error of the steering angle of 0.01 deg in each segment; the wheelbase is held.
Keys of --json:
  n_seg, beta_deg, steering_deg [smallest, largest], duration_s, area_m [along, across], expected_std,
  segments [direction, steering_deg, wheel_way_m, ticks].";

/// Propose the arcs of a calibration drive, with the deviations to expect.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Plan {
    /// Free area: its two sides in m, as 14x11.
    #[arg(long, value_parser = area)]
    area: Area,
    /// Smallest and largest steering angle in deg, as 18..50.
    #[arg(long, default_value = "18..50", value_parser = steering)]
    steering: Steering,
    /// Longest duration, s.
    #[arg(long, default_value_t = 900.0, value_parser = positive)]
    time: f64,
    /// Speed of the driving wheel, m/s.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    speed: f64,
    /// Distance that the logical point keeps from the border of the area, m.
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    clearance: f64,
    /// What is known of the vehicle; a tricycle of 1.5 m else.
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Write a scenario that `agv simulate` drives.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Print one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug)]
struct Area([f64; 2]);

#[derive(Clone, Copy, Debug)]
struct Steering([f64; 2]);

fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "a positive number is expected".to_owned())
}

fn area(text: &str) -> Result<Area, String> {
    let sides = text.split_once('x').map(|(first, second)| [positive(first), positive(second)]);
    match sides {
        Some([Ok(first), Ok(second)]) => Ok(Area([first, second])),
        _ => Err("two lengths in m are expected, as 14x11".to_owned()),
    }
}

fn steering(text: &str) -> Result<Steering, String> {
    let angles = text.split_once("..").map(|(low, high)| [positive(low), positive(high)]);
    match angles {
        Some([Ok(low), Ok(high)]) if low < high && high < 85.0 => Ok(Steering([low, high])),
        _ => Err("two angles in deg below 85 are expected, the smaller first, as 18..50".to_owned()),
    }
}

#[derive(Serialize)]
struct Summary {
    n_seg: usize,
    beta_deg: f64,
    steering_deg: [f64; 2],
    duration_s: f64,
    area_m: [f64; 2],
    expected_std: Named,
    segments: Vec<Segment>,
}

#[derive(Serialize)]
struct Segment {
    direction: Direction,
    steering_deg: f64,
    wheel_way_m: f64,
    ticks: i64,
}

impl Plan {
    /// Runs the command.
    pub fn run(self) -> anyhow::Result<()> {
        let mut parameters = believed_parameters(&Scenario::default());
        if let Some(path) = &self.vehicle {
            ensure!(VehicleFile::read(path)?.apply(&mut parameters), "{}: this is not of a tricycle", path.display());
        }
        let agv_core::odometry::Vehicle::Tricycle(tricycle) = parameters.vehicle else {
            anyhow::bail!("only a tricycle can be calibrated");
        };
        let means = self.means(&tricycle, parameters.lasers.first());
        let planned = plan(&means)?;
        if let Some(path) = &self.scenario {
            let text = toml::to_string(&planned.scenario(&means, &tricycle))?;
            output_file::write(path, text).with_context(|| path.display().to_string())?;
        }
        let summary = summary(&planned, &means);
        if self.json {
            println!("{}", serde_json::to_string_pretty(&summary)?);
            return Ok(());
        }
        self.print(&planned, &summary);
        Ok(())
    }

    fn means(&self, tricycle: &Tricycle, laser: &Pose) -> Means {
        Means {
            vehicle: VehicleModel::nominal(tricycle, laser),
            area: self.area.0,
            clearance: self.clearance,
            steering: self.steering.0.map(f64::to_radians),
            time: self.time,
            speed: self.speed,
        }
    }

    fn print(&self, planned: &Planned, summary: &Summary) {
        println!("{:>4} {:<9} {:>12} {:>12} {:>12}", "", "sense", "steering deg", "way m", "ticks");
        for (index, segment) in summary.segments.iter().enumerate() {
            let sense = if segment.direction == Direction::Forward { "forward" } else { "backward" };
            println!(
                "{:>4} {sense:<9} {:>12.2} {:>12.3} {:>12}",
                index + 1,
                segment.steering_deg,
                segment.wheel_way_m,
                segment.ticks
            );
        }
        let [forward, backward, scale, _, _, x, y, heading] = planned.deviations;
        let row = |name: &str, value: String| [name.to_owned(), value];
        let mut rows = vec![
            row("arcs a phase", summary.n_seg.to_string()),
            row("angle of an arc", format!("{:.0} deg", summary.beta_deg)),
            row("duration", format!("{:.0} s", summary.duration_s)),
            row("area of the drive", format!("{:.1} x {:.1} m", summary.area_m[0], summary.area_m[1])),
            row("expected deviations", String::new()),
            row("  offset forward", format!("{:.4} deg", forward.to_degrees())),
            row("  offset backward", format!("{:.4} deg", backward.to_degrees())),
            row("  drive scale", format!("{:.2e} mm/tick", 1e3 * scale)),
            row("  laser x, y", format!("{:.3} mm, {:.3} mm", 1e3 * x, 1e3 * y)),
            row("  laser heading", format!("{:.4} deg", heading.to_degrees())),
        ];
        rows.extend(self.scenario.iter().map(|path| row("scenario", path.display().to_string())));
        output::print_rows(&rows);
    }
}

fn summary(planned: &Planned, means: &Means) -> Summary {
    let size = planned.bounds[1] - planned.bounds[0];
    let segment = |segment: &agv_host_sim::calibrate::design::PlannedSegment| Segment {
        direction: segment.direction,
        steering_deg: segment.steering.to_degrees(),
        wheel_way_m: segment.wheel_way,
        ticks: (segment.direction.sign() * segment.wheel_way / means.vehicle.drive_scale).round() as i64,
    };
    Summary {
        n_seg: planned.design.arcs,
        beta_deg: planned.design.turn.to_degrees(),
        steering_deg: planned.design.steering.map(f64::to_degrees),
        duration_s: planned.duration,
        area_m: [size.x, size.y],
        expected_std: Named::of(planned.deviations.map(|deviation| (deviation > 0.0).then_some(deviation))),
        segments: planned.segments.iter().map(segment).collect(),
    }
}
