//! With which vehicle an experiment is made.

use agv_core::odometry::Vehicle;
use agv_host_sim::simulate::scenario::{MotionReport, Scenario, believed_parameters};
use serde::Serialize;

/// The vehicles, and what tells their motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum VehicleKind {
    /// One wheel that steers and drives.
    #[default]
    Tricycle,
    /// The same, whose own controller tells speed and steering angle.
    TricycleSpeed,
    /// A car whose own controller tells speed and steering angle.
    CarSpeed,
    /// Two driven wheels side by side.
    Differential,
    /// Two wheels that steer and drive.
    BiSteerable,
    /// A car with counters at its rear wheels.
    Ackermann,
    /// Three omnidirectional wheels.
    Omni3,
    /// Four omnidirectional wheels.
    Omni4,
    /// Four mecanum wheels.
    Mecanum,
    /// A vehicle whose own controller tells how far it has moved.
    Increments,
}

impl VehicleKind {
    /// What the simulated vehicle reports.
    #[must_use]
    pub const fn reports(self) -> MotionReport {
        match self {
            Self::Tricycle => MotionReport::Encoders,
            Self::TricycleSpeed => MotionReport::TricycleSpeed,
            Self::CarSpeed => MotionReport::Speed,
            Self::Differential => MotionReport::Differential,
            Self::BiSteerable => MotionReport::BiSteerable,
            Self::Ackermann => MotionReport::Ackermann,
            Self::Omni3 => MotionReport::ThreeOmnidirectional,
            Self::Omni4 => MotionReport::Omnidirectional,
            Self::Mecanum => MotionReport::Mecanum,
            Self::Increments => MotionReport::Increments,
        }
    }
}

/// A vehicle, with a gyro or without. The standard one is a tricycle without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, clap::Args)]
pub struct Equipment {
    /// The vehicle.
    #[arg(long, value_enum, default_value = "tricycle")]
    pub vehicle: VehicleKind,
    /// Whether it has a gyro, of the usual grade.
    #[arg(long)]
    pub gyro: bool,
    /// True slip of each wheel, m for a square root of a metre; what is stated of it stays [default: 0.003].
    #[arg(long, value_name = "SLIP", value_parser = slip)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip: Option<f64>,
    /// True error of the gyro's scale, share; the seed chooses its sign, and what is stated of it stays [default: 0.002].
    #[arg(long, value_name = "SHARE", value_parser = scale_error)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gyro_scale_error: Option<f64>,
}

/// A slip that a wheel can have.
fn slip(text: &str) -> Result<f64, String> {
    let slip: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=0.1).contains(&slip) { Ok(slip) } else { Err("a slip is from 0 to 0.1".to_owned()) }
}

/// An error that a gyro's scale can have, share.
///
/// # Errors
/// In words, if it is no number, or larger.
pub fn scale_error(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=0.1).contains(&share) { Ok(share) } else { Err("an error of the scale is from 0 to 0.1".to_owned()) }
}

impl Equipment {
    /// Lets a scenario be driven with it.
    pub fn apply(self, scenario: &mut Scenario) {
        scenario.vehicle.reports = self.vehicle.reports();
        scenario.gyro.fitted = self.gyro;
        if let Some(slip) = self.slip {
            scenario.odometry.slip = slip;
        }
        if let Some(share) = self.gyro_scale_error {
            scenario.gyro.scale_error = share;
        }
    }

    /// What the localiser believes of the standard vehicle of its kind.
    #[must_use]
    pub fn believed(self) -> Vehicle {
        let mut scenario = Scenario::default();
        self.apply(&mut scenario);
        believed_parameters(&scenario).vehicle
    }
}
