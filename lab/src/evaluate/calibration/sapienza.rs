//! The tricycle of the Sapienza University: parameters from encoders and from the laser's own odometry.

use std::path::Path;

use agv_core::calibration::{MountingSide, Offsets};
use agv_core::geometry::{Pose, difference};
use agv_core::measurement::{EncoderSample, Time};
use agv_core::odometry::{Tricycle, Vehicle};
use anyhow::Context;
use serde::Serialize;

use agv_host_sim::calibrate::closed_form::{self, ClosedForm};
use agv_host_sim::calibrate::counted::{Counted, CounterFault, count};
use agv_host_sim::calibrate::joint::{self, Free};
use agv_host_sim::calibrate::model::VehicleModel;
use agv_host_sim::calibrate::noise::NoiseModel;
use agv_host_sim::calibrate::odometry_path::OdometryPath;
use agv_host_sim::calibrate::refusal::Refusal;
use agv_host_sim::calibrate::window::Window;
use agv_host_sim::calibrate::windows::{LaserPose, WINDOW_SECONDS, windows};
use agv_host_sim::import::sapienza;
use agv_host_sim::recording::RecordedEvent;

/// Standard deviations; null where a method holds the parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Deviations {
    /// rad.
    pub steer_offset_forward_rad: f64,
    /// rad.
    pub steer_offset_backward_rad: f64,
    /// m for a tick.
    pub drive_scale_m: f64,
    /// m.
    pub wheelbase_m: Option<f64>,
    /// Of the steering ratio.
    pub steering_ratio: Option<f64>,
    /// m.
    pub laser_x_m: f64,
    /// m.
    pub laser_y_m: f64,
    /// rad.
    pub laser_theta_rad: f64,
}

/// What a method found in some windows, and how well the run is dead reckoned with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Windows.
    pub windows: usize,
    /// rad.
    pub steer_offset_forward_rad: f64,
    /// rad.
    pub steer_offset_backward_rad: f64,
    /// m for a tick.
    pub drive_scale_m: f64,
    /// m.
    pub wheelbase_m: f64,
    /// Steering angle over the nominal one.
    pub steering_ratio: f64,
    /// m.
    pub laser_x_m: f64,
    /// m.
    pub laser_y_m: f64,
    /// rad.
    pub laser_theta_rad: f64,
    /// Open loop over the whole run, aligned, m.
    pub ate_rmse_m: f64,
    /// The same of the heading, degrees.
    pub heading_rmse_deg: f64,
    /// Open loop over each quarter of the run, aligned: position, m.
    pub quarters_ate_rmse_m: [f64; 4],
    /// The same of the heading, degrees.
    pub quarters_heading_rmse_deg: [f64; 4],
    /// Standard deviations.
    pub std: Deviations,
}

/// A method, fitted on half of the run and checked on the other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HalfFit {
    /// On which quarters of the way it was fitted.
    pub fitted_on: &'static str,
    /// Open loop over each of these quarters: root of the mean square, m.
    pub fitted_ate_rmse_m: f64,
    /// Open loop over each of the other quarters, m.
    pub checked_ate_rmse_m: f64,
    /// The same of the heading, degrees.
    pub fitted_heading_rmse_deg: f64,
    /// The same.
    pub checked_heading_rmse_deg: f64,
    /// What was found.
    #[serde(flatten)]
    pub fit: Fit,
}

/// A method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Its name.
    pub method: &'static str,
    /// Fitted on the whole run.
    #[serde(flatten)]
    pub fit: Fit,
    /// Fitted on halves of it, where that half tells the parameters.
    pub halves: Vec<HalfFit>,
}

/// The run, ready for calibration.
pub struct Run {
    /// Nominal vehicle.
    pub nominal: Tricycle,
    /// Nominal laser.
    pub laser: Pose,
    /// Counters, mended.
    pub counted: Vec<Counted>,
    /// What was mended.
    pub faults: Vec<CounterFault>,
    /// Poses of the laser.
    pub poses: Vec<LaserPose>,
}

/// Ticks of a window that count as motion, as a way with the nominal scale, m.
const SHORTEST_WAY: f64 = 0.05;

/// Reads the run from its folder.
///
/// # Errors
/// If the data are not there.
pub fn read(folder: &Path) -> anyhow::Result<Run> {
    let recording = sapienza::read(&folder.join("dataset.txt"))?;
    let Vehicle::Tricycle(nominal) = recording.parameters.vehicle else {
        anyhow::bail!("the data are not of a tricycle");
    };
    let samples: Vec<EncoderSample> = recording
        .events
        .iter()
        .filter_map(|event| if let RecordedEvent::Encoders(sample) = event { Some(*sample) } else { None })
        .collect();
    let (counted, faults) = count(&samples, &nominal, true);
    let poses = recording
        .references
        .iter()
        .filter_map(|reference| {
            Some(LaserPose { time: reference.time, pose: Pose::new(reference.x, reference.y, reference.heading?) })
        })
        .collect();
    Ok(Run { nominal, laser: *recording.parameters.lasers.first(), counted, faults, poses })
}

/// Windows of which quarters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quarters {
    /// All of the run.
    All,
    /// First and third.
    FirstAndThird,
    /// Second and fourth.
    SecondAndFourth,
}

impl Run {
    /// The quarter of the way, from 0 to 3, in which each pose lies.
    fn quarter(&self, time: Time) -> usize {
        // The way in ticks, forth and back.
        let mut way = 0.0;
        let ways: Vec<f64> = self
            .counted
            .windows(2)
            .map(|pair| {
                way += (pair[1].ticks - pair[0].ticks).abs();
                way
            })
            .collect();
        let place = self.counted.partition_point(|sample| sample.time < time).saturating_sub(1);
        let here = ways.get(place).or(ways.last()).copied().unwrap_or(0.0);
        ((4.0 * here / way.max(1.0)) as usize).min(3)
    }

    /// Windows whose middle lies in those quarters.
    #[must_use]
    pub fn windows(&self, quarters: Quarters) -> Vec<Window> {
        let all = windows(&self.counted, &self.poses, SHORTEST_WAY / self.nominal.drive_scale);
        let is_wanted = |window: &Window| {
            let quarter = self.quarter(window.start.offset(0.5 * window.end.since(window.start)));
            match quarters {
                Quarters::All => true,
                Quarters::FirstAndThird => quarter == 0 || quarter == 2,
                Quarters::SecondAndFourth => quarter == 1 || quarter == 3,
            }
        };
        all.into_iter().filter(is_wanted).collect()
    }

    /// Open loop with that model: aligned error of the laser's position (m) and heading (degrees), of the whole run and
    /// of each quarter.
    #[must_use]
    pub fn open_loop(&self, model: &VehicleModel) -> [(f64, f64); 5] {
        let times: Vec<Time> = self.poses.iter().map(|pose| pose.time).collect();
        let path = OdometryPath::new(&self.counted, model);
        let reckoned: Vec<Pose> = times.iter().map(|time| path.laser_at(*time)).collect();
        let quarters: Vec<usize> = times.iter().map(|time| self.quarter(*time)).collect();
        let error = |wanted: &dyn Fn(usize) -> bool| {
            let pairs: Vec<(Pose, Pose)> = reckoned
                .iter()
                .zip(&self.poses)
                .zip(&quarters)
                .filter(|(_, quarter)| wanted(**quarter))
                .map(|((reckoned, pose), _)| (*reckoned, pose.pose))
                .collect();
            aligned_error(&pairs)
        };
        [
            error(&|_| true),
            error(&|quarter| quarter == 0),
            error(&|quarter| quarter == 1),
            error(&|quarter| quarter == 2),
            error(&|quarter| quarter == 3),
        ]
    }

    fn fit(&self, windows: usize, model: &VehicleModel, std: Deviations) -> Fit {
        let [whole, quarters @ ..] = self.open_loop(model);
        Fit {
            windows,
            steer_offset_forward_rad: model.offset_forward,
            steer_offset_backward_rad: model.offset_backward,
            drive_scale_m: model.drive_scale,
            wheelbase_m: model.wheelbase,
            steering_ratio: model.steering_ratio,
            laser_x_m: model.laser.x,
            laser_y_m: model.laser.y,
            laser_theta_rad: model.laser.theta,
            ate_rmse_m: whole.0,
            heading_rmse_deg: whole.1,
            quarters_ate_rmse_m: quarters.map(|quarter| quarter.0),
            quarters_heading_rmse_deg: quarters.map(|quarter| quarter.1),
            std,
        }
    }
}

impl HalfFit {
    fn new(fitted_on: &'static str, is_fitted: [bool; 4], fit: Fit) -> Self {
        let mean = |values: &[f64; 4], wanted: bool| {
            let squares =
                values.iter().zip(is_fitted).filter(|(_, fitted)| *fitted == wanted).map(|(value, _)| value * value);
            (squares.sum::<f64>() / 2.0).sqrt()
        };
        Self {
            fitted_on,
            fitted_ate_rmse_m: mean(&fit.quarters_ate_rmse_m, true),
            checked_ate_rmse_m: mean(&fit.quarters_ate_rmse_m, false),
            fitted_heading_rmse_deg: mean(&fit.quarters_heading_rmse_deg, true),
            checked_heading_rmse_deg: mean(&fit.quarters_heading_rmse_deg, false),
            fit,
        }
    }
}

/// Root mean square of positions (m) and headings (degrees) after the best rigid alignment of the positions.
fn aligned_error(pairs: &[(Pose, Pose)]) -> (f64, f64) {
    let mut registration = agv_core::calibration::Registration::default();
    for (reckoned, reference) in pairs {
        registration.add(&reference.position(), &reckoned.position());
    }
    let Some(alignment) = registration.solve() else {
        return (f64::NAN, f64::NAN);
    };
    let mean = |error: &dyn Fn(&Pose, &Pose) -> f64| {
        let squares =
            pairs.iter().map(|(reckoned, reference)| error(&alignment.pose.compose(reckoned), reference).powi(2));
        (squares.sum::<f64>() / pairs.len() as f64).sqrt()
    };
    (
        mean(&|aligned, reference| (aligned.position() - reference.position()).norm()),
        mean(&|aligned, reference| difference(aligned.theta, reference.theta)).to_degrees(),
    )
}

/// Between which factors of the nominal steering scale the true one is searched.
const RATIOS: [f64; 2] = [0.05, 20.0];

/// All methods, each fitted on the whole run, on the first and third quarter of the way, and on the others.
///
/// # Errors
/// If the data are not there or the whole run tells too little.
pub fn run(folder: &Path) -> anyhow::Result<Vec<Outcome>> {
    let run = read(folder)?;
    let all = run.windows(Quarters::All);
    let halves = [
        ("quarters 1 and 3", [true, false, true, false], run.windows(Quarters::FirstAndThird)),
        ("quarters 2 and 4", [false, true, false, true], run.windows(Quarters::SecondAndFourth)),
    ];
    let outcome = |method: &Method| {
        let (model, std) = method.solve(&run.nominal, &all).with_context(|| method.name.to_owned())?;
        // Half of the run may hold too little.
        let half = |(fitted_on, is_fitted, windows): &(&'static str, [bool; 4], Vec<Window>)| {
            let (model, std) = method.solve(&run.nominal, windows).ok()?;
            Some(HalfFit::new(fitted_on, *is_fitted, run.fit(windows.len(), &model, std)))
        };
        let halves = halves.iter().filter_map(half).collect();
        Ok(Outcome { method: method.name, fit: run.fit(all.len(), &model, std), halves })
    };
    METHODS.iter().map(outcome).collect()
}

struct Method {
    name: &'static str,
    offsets: Offsets,
    is_wheelbase_free: bool,
    is_joint: bool,
}

const METHODS: [Method; 4] = [
    Method { name: "stc", offsets: Offsets::Common, is_wheelbase_free: false, is_joint: false },
    Method { name: "atc", offsets: Offsets::ForEachSense, is_wheelbase_free: false, is_joint: false },
    Method { name: "atc_wheelbase", offsets: Offsets::ForEachSense, is_wheelbase_free: true, is_joint: false },
    Method { name: "joint", offsets: Offsets::ForEachSense, is_wheelbase_free: true, is_joint: true },
];

/// Where the estimate of the noise begins: a light robot with rubber wheels on a smooth floor.
const NOISE: NoiseModel = NoiseModel { slip: 1e-3, steering: 1e-3, laser: 1.0 };

impl Method {
    fn solve(&self, nominal: &Tricycle, windows: &[Window]) -> anyhow::Result<(VehicleModel, Deviations)> {
        let form = ClosedForm {
            offsets: self.offsets,
            is_wheelbase_free: self.is_wheelbase_free,
            side: Some(MountingSide::Front),
        };
        let ratio = closed_form::steering_ratio(windows, nominal, &form, RATIOS).map_err(Refusal::from)?;
        let calibration = closed_form::solve(windows, nominal, &form, ratio).map_err(Refusal::from)?;
        let model = closed_form::model(&calibration, ratio);
        if self.is_joint {
            let free = Free { offsets_differ: true, wheelbase: true, steering_ratio: true };
            let fit = joint::fit(windows, &model, free, &NOISE)?;
            let [forward, backward, scale, wheelbase, ratio, x, y, heading] =
                fit.deviations.map(|deviation| deviation * (WINDOW_SECONDS.len() as f64).sqrt());
            let std = Deviations {
                steer_offset_forward_rad: forward,
                steer_offset_backward_rad: backward,
                drive_scale_m: scale,
                wheelbase_m: Some(wheelbase),
                steering_ratio: Some(ratio),
                laser_x_m: x,
                laser_y_m: y,
                laser_theta_rad: heading,
            };
            return Ok((fit.model, std));
        }
        let (intrinsic, laser) = (calibration.intrinsic.deviations(), calibration.extrinsic.deviations());
        let std = Deviations {
            steer_offset_forward_rad: intrinsic.x,
            steer_offset_backward_rad: intrinsic.y,
            drive_scale_m: calibration.drive_scale_deviation(self.is_wheelbase_free),
            wheelbase_m: self.is_wheelbase_free.then_some(calibration.extrinsic.wheelbase_deviation),
            steering_ratio: None,
            laser_x_m: laser.x,
            laser_y_m: laser.y,
            laser_theta_rad: laser.z,
        };
        Ok((model, std))
    }
}
