//! The parameters of a vehicle as a file: what calibration finds, and what replay and the firmware's settings take.
//!
//! ```toml
//! wheelbase_m = 1.5
//! drive_scale_m_per_tick = 0.00024975
//! steering_scale_rad_per_tick = 9.58737992429e-5
//! steer_offset_forward_rad = -0.0127
//! steer_offset_backward_rad = -0.0135
//! laser_x_m = 0.389
//! laser_y_m = 0.003
//! laser_theta_rad = 0.007
//! ```
//!
//! Whatever is left out stays as it is.

use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::odometry::{Tricycle, Vehicle};
use serde::{Deserialize, Serialize};

use crate::text_file::{self, TextFileError};

/// Parameters of a tricycle and its laser.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleFile {
    /// Distance from the rear axle to the steering axis (K: L).
    pub wheelbase_m: Option<f64>,
    /// Way of the driving wheel for one tick (K: s_w).
    pub drive_scale_m_per_tick: Option<f64>,
    /// Steering angle for one tick.
    pub steering_scale_rad_per_tick: Option<f64>,
    /// Steering offset forward (K: alpha_F).
    pub steer_offset_forward_rad: Option<f64>,
    /// Steering offset backward (K: alpha_B).
    pub steer_offset_backward_rad: Option<f64>,
    /// Pose of S in R (K: l).
    pub laser_x_m: Option<f64>,
    /// The same.
    pub laser_y_m: Option<f64>,
    /// The same.
    pub laser_theta_rad: Option<f64>,
}

impl VehicleFile {
    /// The file for a vehicle.
    #[must_use]
    pub fn of(tricycle: &Tricycle, laser: &Pose) -> Self {
        Self {
            wheelbase_m: Some(tricycle.wheelbase),
            drive_scale_m_per_tick: Some(tricycle.drive_scale),
            steering_scale_rad_per_tick: Some(tricycle.steering_scale),
            steer_offset_forward_rad: Some(tricycle.steering_offset_forward),
            steer_offset_backward_rad: Some(tricycle.steering_offset_backward),
            laser_x_m: Some(laser.x),
            laser_y_m: Some(laser.y),
            laser_theta_rad: Some(laser.theta),
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, has an unknown name, or a value that no vehicle has.
    pub fn read(path: &Path) -> Result<Self, TextFileError> {
        let text = text_file::read(path, "a file of vehicle parameters")?;
        let file: Self = toml::from_str(&text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
            TextFileError::of_line(path, before.matches('\n').count() + 1, error.message().replace('\n', ", "))
        })?;
        match file.problem() {
            Some((name, demand)) => {
                let line = text.lines().position(|line| line.trim_start().starts_with(name)).map_or(1, |line| line + 1);
                Err(TextFileError::of_line(path, line, format!("{name} must be {demand}")))
            }
            None => Ok(file),
        }
    }

    fn problem(&self) -> Option<(&'static str, &'static str)> {
        let positive = [("wheelbase_m", self.wheelbase_m), ("drive_scale_m_per_tick", self.drive_scale_m_per_tick)];
        let finite = [
            ("steering_scale_rad_per_tick", self.steering_scale_rad_per_tick),
            ("steer_offset_forward_rad", self.steer_offset_forward_rad),
            ("steer_offset_backward_rad", self.steer_offset_backward_rad),
            ("laser_x_m", self.laser_x_m),
            ("laser_y_m", self.laser_y_m),
            ("laser_theta_rad", self.laser_theta_rad),
        ];
        let is_bad = |value: Option<f64>| value.is_some_and(|value| !(value.is_finite() && value.abs() < 1000.0));
        let not_positive = |value: Option<f64>| is_bad(value) || value.is_some_and(|value| value <= 0.0);
        let first = positive.iter().find(|(_, value)| not_positive(*value)).map(|(name, _)| (*name, "positive"));
        first.or_else(|| finite.iter().find(|(_, value)| is_bad(*value)).map(|(name, _)| (*name, "a finite number")))
    }

    /// Writes the file.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn write(&self, path: &Path) -> Result<(), TextFileError> {
        let io = |source| TextFileError::of_system(path, source);
        let text = toml::to_string(self).map_err(|error| io(std::io::Error::other(error)))?;
        std::fs::write(path, text).map_err(io)
    }

    /// The same parameters as the firmware's settings call them: names of leaves, and values in their units.
    pub fn settings(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let named = [
            ("vehicle.wheelbase", self.wheelbase_m),
            ("vehicle.drive_scale", self.drive_scale_m_per_tick),
            ("vehicle.steering_scale", self.steering_scale_rad_per_tick),
            ("vehicle.steering_offset_forward", self.steer_offset_forward_rad),
            ("vehicle.steering_offset_backward", self.steer_offset_backward_rad),
            ("laser.x", self.laser_x_m),
            ("laser.y", self.laser_y_m),
            ("laser.theta", self.laser_theta_rad),
        ];
        named.into_iter().filter_map(|(name, value)| Some((name, value?)))
    }

    /// Puts the parameters in place of those of a log. False if the log is not of a tricycle.
    #[must_use]
    pub fn apply(&self, parameters: &mut Parameters) -> bool {
        let Vehicle::Tricycle(tricycle) = &mut parameters.vehicle else {
            return false;
        };
        let laser = parameters.lasers.first_mut();
        for (place, value) in [
            (&mut tricycle.wheelbase, self.wheelbase_m),
            (&mut tricycle.drive_scale, self.drive_scale_m_per_tick),
            (&mut tricycle.steering_scale, self.steering_scale_rad_per_tick),
            (&mut tricycle.steering_offset_forward, self.steer_offset_forward_rad),
            (&mut tricycle.steering_offset_backward, self.steer_offset_backward_rad),
            (&mut laser.x, self.laser_x_m),
            (&mut laser.y, self.laser_y_m),
            (&mut laser.theta, self.laser_theta_rad),
        ] {
            *place = value.unwrap_or(*place);
        }
        true
    }
}
