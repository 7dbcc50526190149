//! The tricycle of the Sapienza University: parameters from encoders and from the laser's own odometry.

use std::path::Path;

use agv_core::calibration::{MountingSide, Offsets};
use agv_core::geometry::{Pose, difference};
use agv_core::measurement::{EncoderSample, Time};
use agv_core::odometry::{Tricycle, Vehicle};
use anyhow::Context;
use serde::Serialize;

use crate::calibrate::closed_form::{self, ClosedForm};
use crate::calibrate::counted::{Counted, CounterFault, count};
use crate::calibrate::joint::{self, Free};
use crate::calibrate::model::VehicleModel;
use crate::calibrate::noise::NoiseModel;
use crate::calibrate::odometry_path::OdometryPath;
use crate::calibrate::window::Window;
use crate::calibrate::windows::{LaserPose, WINDOW_SECONDS, windows};
use crate::import::sapienza;
use crate::recording::RecordedEvent;

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

/// What a method found, and how well the whole run is dead reckoned with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the method.
    pub method: &'static str,
    /// On which windows it was fitted.
    pub fitted_on: &'static str,
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
    Ok(Run { nominal, laser: recording.parameters.laser, counted, faults, poses })
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
                Quarters::FirstAndThird => quarter % 2 == 0,
                Quarters::SecondAndFourth => quarter % 2 == 1,
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

    fn outcome(
        &self,
        method: &'static str,
        fitted_on: &'static str,
        windows: usize,
        model: &VehicleModel,
        std: Deviations,
    ) -> Outcome {
        let [whole, quarters @ ..] = self.open_loop(model);
        Outcome {
            method,
            fitted_on,
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
/// If the data are not there or tell too little.
pub fn run(folder: &Path) -> anyhow::Result<Vec<Outcome>> {
    let run = read(folder)?;
    let mut outcomes = Vec::new();
    for (quarters, fitted_on) in [
        (Quarters::All, "all"),
        (Quarters::FirstAndThird, "quarters 1 and 3"),
        (Quarters::SecondAndFourth, "quarters 2 and 4"),
    ] {
        let windows = run.windows(quarters);
        for (method, offsets, is_wheelbase_free) in [
            ("stc", Offsets::Common, false),
            ("atc", Offsets::ForEachSense, false),
            ("atc_wheelbase", Offsets::ForEachSense, true),
        ] {
            let form = ClosedForm { offsets, is_wheelbase_free, side: Some(MountingSide::Front) };
            let found = closed_form::steering_ratio(&windows, &run.nominal, &form, RATIOS)
                .and_then(|ratio| Ok((closed_form::solve(&windows, &run.nominal, &form, ratio)?, ratio)));
            // Half of the run may hold one sense of travel only.
            let Ok((calibration, ratio)) = found else { continue };
            let (intrinsic, laser) = (calibration.intrinsic.deviations(), calibration.extrinsic.deviations());
            let std = Deviations {
                steer_offset_forward_rad: intrinsic.x,
                steer_offset_backward_rad: intrinsic.y,
                drive_scale_m: calibration.drive_scale_deviation(is_wheelbase_free),
                wheelbase_m: is_wheelbase_free.then_some(calibration.extrinsic.wheelbase_deviation),
                steering_ratio: None,
                laser_x_m: laser.x,
                laser_y_m: laser.y,
                laser_theta_rad: laser.z,
            };
            let model = closed_form::model(&calibration, ratio);
            outcomes.push(run.outcome(method, fitted_on, windows.len(), &model, std));
            if !is_wheelbase_free {
                continue;
            }
            let free = Free { offsets_differ: true, wheelbase: true, steering_ratio: true };
            let noise = NoiseModel { slip: 1e-3, steering: 1e-3, laser: 1.0 };
            let fit = joint::fit(&windows, &model, free, &noise).with_context(|| format!("fitted on {fitted_on}"))?;
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
            outcomes.push(run.outcome("joint", fitted_on, windows.len(), &fit.model, std));
        }
    }
    Ok(outcomes)
}
