//! How hard the world is in which a vehicle in order drives.

use agv_core::odometry::OdometryNoise;
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{FloorOptions, Scenario, SystematicErrors};
use serde::Serialize;

/// The world of a vehicle in order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum NominalWorld {
    /// Motion with the noise that the default settings state; a laser with systematic errors, survey errors that near reflectors share, and a
    /// floor of waves.
    #[default]
    Hard,
    /// Half of the stated slip and a quarter of the walk of the heading; a laser and a survey with independent errors alone, on a plane.
    Easy,
}

/// Systematic errors of a laser are drawn within these: an assessor's values, as the data sheet of the NAV350 is not public. m, share, m,
/// and deg of both harmonics of the bearing.
const RANGE_BIAS: f64 = 0.010;
const RANGE_SCALE: f64 = 0.0005;
const INCIDENCE: f64 = 0.005;
const HARMONICS_DEG: [f64; 2] = [0.05, 0.02];

/// Error of the survey that near reflectors share, and the distance over which they do, m: of a total station that is set up anew in each
/// aisle.
const CORRELATED_SURVEY: f64 = 0.005;
const SURVEY_LENGTH: f64 = 10.0;

/// A floor of class FM2 (Concrete Society TR34, 4th edition, table 3.1): in 95 % the heights of places 3 m apart differ by 6.5 mm at most.
/// With the covariance of the floor's waves over that length, the deviation of the difference is the height's times
/// sqrt(2 (1 - exp(-1/2))), and 6.5 mm are 1.96 of them.
const FLOOR: FloorOptions = FloorOptions { deviation: 0.0065 / 1.96 / 0.887_1, length: 3.0, laser_height: 2.5 };

impl NominalWorld {
    /// Makes a scenario as hard as that.
    pub fn apply(self, scenario: &mut Scenario) {
        if self == Self::Easy {
            return;
        }
        let stated = OdometryNoise::default();
        scenario.odometry.slip = stated.slip;
        scenario.odometry.side_slip = stated.side_slip;
        scenario.odometry.yaw_walk_deg = stated.yaw.to_degrees();
        let mut random = Random::new(scenario.seed, Stream::Nominal);
        let mut within = |most: f64| random.between(-most, most);
        scenario.laser.systematic = SystematicErrors {
            range_bias: within(RANGE_BIAS),
            range_scale: within(RANGE_SCALE),
            incidence: within(INCIDENCE),
            first_harmonic_deg: within(HARMONICS_DEG[0]).abs(),
            first_phase_deg: within(180.0),
            second_harmonic_deg: within(HARMONICS_DEG[1]).abs(),
            second_phase_deg: within(180.0),
        };
        scenario.reflectors.correlated_survey = CORRELATED_SURVEY;
        scenario.reflectors.survey_length = SURVEY_LENGTH;
        scenario.floor = FLOOR;
    }
}
