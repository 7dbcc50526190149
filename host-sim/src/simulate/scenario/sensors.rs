//! The laser, and what it finds.

use serde::{Deserialize, Serialize};

use super::{PoseOptions, SystematicErrors};
use agv_core::geometry::Pose;

/// The laser.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaserOptions {
    /// Whether the localiser is given scans.
    pub scans: bool,
    /// Believed mounting, S in R.
    pub mounting: PoseOptions,
    /// Beams a revolution.
    pub beams: u32,
    /// Revolutions a second.
    pub frequency: f64,
    /// Standard deviation of a range up to 30 m, m.
    pub range_noise: f64,
    /// Standard deviation of a range beyond 30 m, m.
    pub far_range_noise: f64,
    /// Standard deviation of a beam's direction.
    pub bearing_noise_deg: f64,
    /// Errors that do not change.
    pub systematic: SystematicErrors,
    /// Nearest return, m.
    pub nearest: f64,
    /// Farthest return, m.
    pub farthest: f64,
    /// From the last beam to the arrival of the scan, s.
    pub latency: f64,
    /// Whether strengths are reported; returns of foil are bright.
    pub intensities: bool,
    /// Share of the beams on an edge that report a distance between its two sides, 0 to 1.
    pub mixed_share: f64,
    /// Width of a beam, for mixing.
    pub divergence_deg: f64,
    /// Share of the beams that are lost, 0 to 1.
    pub lost_share: f64,
    /// Where the window is dirty.
    pub dirty_sectors: Vec<DirtySector>,
    /// How the laser moves on its mounting while the vehicle drives.
    pub knocks: Vec<Knock>,
    /// How much older what it measures is than the time that it states.
    pub ages: Vec<DataAge>,
}

/// How much of something has come that begins then and takes so long, 0 to 1; times in s.
fn grown(time: f64, from: f64, lasts: f64) -> f64 {
    if time < from {
        0.0
    } else if time >= from + lasts {
        1.0
    } else {
        (time - from) / lasts
    }
}

impl LaserOptions {
    /// When that was measured which the laser states for `time`, both s after the drive's first event.
    #[must_use]
    pub fn measured(&self, time: f64) -> f64 {
        time - self.ages.iter().map(|age| age.seconds * grown(time, age.from, age.lasts)).sum::<f64>()
    }

    /// The mounting (S in R) `time` s after the drive's first event, of a laser that was mounted at `mounting`.
    #[must_use]
    pub fn moved(&self, mounting: &Pose, time: f64) -> Pose {
        self.knocks.iter().fold(*mounting, |mounting, knock| mounting.compose(&knock.at(time)))
    }
}

/// A laser whose data are older than the time that it states, from then on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataAge {
    /// When it begins, s after the drive's first event.
    pub from: f64,
    /// How long it takes to come to that, s; 0 for a step.
    #[serde(default)]
    pub lasts: f64,
    /// How old, s; below 0 for data that are younger.
    pub seconds: f64,
}

/// A laser that moves on its mounting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Knock {
    /// When it begins, s after the drive's first event.
    pub from: f64,
    /// How long it takes, s; 0 for a blow.
    #[serde(default)]
    pub lasts: f64,
    /// In how many blows; 0 for one motion.
    #[serde(default)]
    pub steps: u32,
    /// Forward, in S, m.
    #[serde(default)]
    pub x: f64,
    /// To the left, in S, m.
    #[serde(default)]
    pub y: f64,
    /// Counter-clockwise.
    #[serde(default)]
    pub heading_deg: f64,
}

impl Knock {
    /// How far the laser has moved by then, in S.
    fn at(&self, time: f64) -> Pose {
        let mut share = grown(time, self.from, self.lasts);
        if self.steps > 0 {
            share = libm::ceil(share * f64::from(self.steps)) / f64::from(self.steps);
        }
        Pose::new(share * self.x, share * self.y, share * self.heading_deg.to_radians())
    }
}

impl Default for LaserOptions {
    fn default() -> Self {
        Self {
            scans: true,
            mounting: PoseOptions { x: 0.9, y: 0.0, heading_deg: 0.0 },
            beams: 1440,
            frequency: 8.0,
            range_noise: 0.010,
            far_range_noise: 0.025,
            bearing_noise_deg: 0.02,
            systematic: SystematicErrors::default(),
            nearest: 0.5,
            farthest: 70.0,
            latency: 0.010,
            intensities: false,
            mixed_share: 0.0,
            divergence_deg: 0.25,
            lost_share: 0.0,
            dirty_sectors: Vec::new(),
            knocks: Vec::new(),
            ages: Vec::new(),
        }
    }
}

/// A part of the laser's window that lets some beams through.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirtySector {
    /// Where it starts, in S, counter-clockwise.
    pub from_deg: f64,
    /// Where it ends, in S.
    pub to_deg: f64,
    /// Share of its beams that are lost, 0 to 1.
    pub lost_share: f64,
}

/// Detection and survey of reflectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReflectorOptions {
    /// Standard deviation of a range, m.
    pub range_noise: f64,
    /// Standard deviation of a bearing.
    pub bearing_noise_deg: f64,
    /// None is detected beyond this distance, m.
    pub farthest: f64,
    /// Probability that a visible reflector is missed in a revolution.
    pub missing_share: f64,
    /// False reflectors for each detected one; each stands on a surface in a random direction.
    pub false_share: f64,
    /// Standard deviation of a surveyed position along each axis, m.
    pub survey_deviation: f64,
    /// Standard deviation of an error of surveyed positions along each axis that near ones share, m.
    pub correlated_survey: f64,
    /// Distance over which it is correlated, m.
    pub survey_length: f64,
    /// From the end of the revolution to the arrival of its reflectors, s.
    pub latency: f64,
}

impl Default for ReflectorOptions {
    fn default() -> Self {
        Self {
            range_noise: 0.008,
            bearing_noise_deg: 0.05,
            farthest: 30.0,
            missing_share: 0.0,
            false_share: 0.01,
            survey_deviation: 0.002,
            correlated_survey: 0.0,
            survey_length: 10.0,
            latency: 0.010,
        }
    }
}
