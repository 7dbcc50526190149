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
//! Of a vehicle with several wheels it holds settings by their names:
//!
//! ```toml
//! [settings]
//! "vehicle.track" = 0.612
//! "vehicle.wheel_1_scale" = 2.5e-5
//! ```
//!
//! Whatever is left out stays as it is.

use std::collections::BTreeMap;
use std::path::Path;

use agv_core::geometry::Pose;
use agv_core::localizer::{Parameters, bounds};
use agv_core::odometry::{Tricycle, Vehicle};
use agv_settings::Settings;
use agv_settings::leaf::{Leaf, Value};
use serde::{Deserialize, Serialize};

use crate::output_file;
use crate::text_file::{self, TextFileError};

/// Parameters of a tricycle and its laser, or settings of any vehicle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Settings that are numbers, by their names.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub settings: BTreeMap<String, f64>,
}

/// How the names of the settings of a vehicle and of its first laser begin.
const OF_VEHICLE: [&str; 2] = ["vehicle.", "laser."];

/// One line of the file.
struct Entry {
    name: &'static str,
    /// What the firmware's settings call it.
    setting: &'static str,
    value: Option<f64>,
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
            settings: BTreeMap::new(),
        }
    }

    /// The file for a vehicle of any kind, and its first laser.
    #[must_use]
    pub fn of_vehicle(parameters: &Parameters) -> Self {
        let settings = Settings::of(*parameters);
        let number = |leaf: &Leaf| match leaf.get(&settings) {
            Some(Value::Number(value)) if OF_VEHICLE.iter().any(|room| leaf.name.starts_with(room)) => {
                Some((leaf.name.to_owned(), value))
            }
            _ => None,
        };
        Self { settings: agv_settings::LEAVES.iter().filter_map(number).collect(), ..Self::default() }
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
                let line =
                    text.lines().position(|line| line.trim_start().starts_with(&name)).map_or(1, |line| line + 1);
                Err(TextFileError::of_line(path, line, format!("{name} must be {demand}")))
            }
            None => Ok(file),
        }
    }

    /// The first entry that no vehicle has, and what it must be.
    fn problem(&self) -> Option<(String, String)> {
        self.problem_of_tricycle().map(|(name, demand)| (name.to_owned(), demand)).or_else(|| {
            self.settings.iter().find_map(|(name, value)| {
                let demand = match Leaf::named(name) {
                    None => "the name of a setting".to_owned(),
                    Some(leaf) if !(leaf.bounds.0..=leaf.bounds.1).contains(value) => {
                        format!("from {} to {}, and is {value}", leaf.bounds.0, leaf.bounds.1)
                    }
                    Some(_) => return None,
                };
                Some((format!("\"{name}\""), demand))
            })
        })
    }

    fn problem_of_tricycle(&self) -> Option<(&'static str, String)> {
        self.entries().into_iter().find_map(|Entry { name, setting, value }| {
            let (value, (least, most)) = (value?, bounds(setting)?);
            let is_scale = name.ends_with("_per_tick");
            if is_scale && value == 0.0 {
                return Some((name, "anything but 0".to_owned()));
            }
            // Not a number is within no bounds.
            (!(least <= value && value <= most)).then(|| (name, format!("from {least} to {most}, and is {value}")))
        })
    }

    fn entries(&self) -> [Entry; 8] {
        let entry = |name, setting, value| Entry { name, setting, value };
        [
            entry("wheelbase_m", "vehicle.wheelbase", self.wheelbase_m),
            entry("drive_scale_m_per_tick", "vehicle.drive_scale", self.drive_scale_m_per_tick),
            entry("steering_scale_rad_per_tick", "vehicle.steering_scale", self.steering_scale_rad_per_tick),
            entry("steer_offset_forward_rad", "vehicle.steering_offset_forward", self.steer_offset_forward_rad),
            entry("steer_offset_backward_rad", "vehicle.steering_offset_backward", self.steer_offset_backward_rad),
            entry("laser_x_m", "laser.x", self.laser_x_m),
            entry("laser_y_m", "laser.y", self.laser_y_m),
            entry("laser_theta_rad", "laser.theta", self.laser_theta_rad),
        ]
    }

    /// Writes the file.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn write(&self, path: &Path) -> Result<(), TextFileError> {
        let io = |source| TextFileError::of_system(path, source);
        let text = toml::to_string(self).map_err(|error| io(std::io::Error::other(error)))?;
        output_file::write(path, text).map_err(io)
    }

    /// The same parameters as the firmware's settings call them: names of leaves, and values in their units.
    pub fn settings(&self) -> impl Iterator<Item = (&str, f64)> {
        let of_tricycle = self.entries().into_iter().filter_map(|entry| Some((entry.setting, entry.value?)));
        of_tricycle.chain(self.settings.iter().map(|(name, value)| (name.as_str(), *value)))
    }

    /// Puts the parameters in place of those of a log. False if the log is of another kind of vehicle.
    #[must_use]
    pub fn apply(&self, parameters: &mut Parameters) -> bool {
        if !self.settings.is_empty() {
            let mut settings = Settings::of(*parameters);
            let mut set = |(name, value): (&String, &f64)| {
                let leaf = Leaf::named(name).filter(|leaf| leaf.get(&settings).is_some());
                leaf.is_some_and(|leaf| leaf.set(&mut settings, Value::Number(*value)).is_ok())
            };
            if !self.settings.iter().all(&mut set) {
                return false;
            }
            *parameters = settings.parameters;
            if self.entries().iter().all(|entry| entry.value.is_none()) {
                return true;
            }
        }
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
