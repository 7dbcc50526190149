//! In what a drive in the standard block storage may differ from the standard one.

use serde::Serialize;

use agv_host_sim::simulate::people::PersonShape;
use agv_host_sim::simulate::scenario::{DirtySector, PersonOptions, Scenario, WorldOptions};

/// One thing that is worse than in the standard drive, or better.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Disturbance {
    /// The standard drive.
    #[default]
    None,
    /// The start pose is known exactly, to 0.1 mm and 0.001 deg: what remains is drift.
    PerfectStart,
    /// The range noise is 20 mm.
    RangeNoise,
    /// The steering offset is wrong by 0.5 deg.
    SteeringOffset,
    /// The way of the drive is wrong by 1 %.
    Scale,
    /// Half of the laser's window lets nothing through: every second sector of 30 deg.
    HalfWindow,
    /// Half of the beams on edges report a distance between both sides.
    MixedPixels,
    /// Three people walk in the aisle and at the end of the lane.
    People,
    /// A quarter of the pallets stands 20 cm from where it stood when the map was made.
    MovedPallets,
    /// The laser's yaw is wrong by 0.1 deg.
    LaserYaw,
}

/// Sectors of the window, every second of them dirty.
const SECTORS: u8 = 12;

impl Disturbance {
    /// All of them, the standard drive first.
    pub const ALL: [Self; 10] = [
        Self::None,
        Self::PerfectStart,
        Self::RangeNoise,
        Self::SteeringOffset,
        Self::Scale,
        Self::HalfWindow,
        Self::MixedPixels,
        Self::People,
        Self::MovedPallets,
        Self::LaserYaw,
    ];

    /// Its name, as the JSON has it.
    #[must_use]
    pub fn name(self) -> String {
        serde_json::to_value(self).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
    }

    /// What disturbs the drive by which the map is made: what moves comes later.
    pub(super) fn of_the_mapping_drive(self) -> Self {
        match self {
            Self::People | Self::MovedPallets | Self::PerfectStart => Self::None,
            other => other,
        }
    }

    /// Disturbs a drive.
    pub(super) fn apply(self, scenario: &mut Scenario) {
        match self {
            Self::None => {}
            Self::PerfectStart => {
                scenario.start.position_deviation = 1e-4;
                scenario.start.heading_deviation_deg = 1e-3;
            }
            Self::RangeNoise => scenario.laser.range_noise = 0.02,
            Self::SteeringOffset => scenario.vehicle.truth.steering_offset_error_deg = 0.5,
            Self::Scale => scenario.vehicle.truth.drive_scale_error = 0.01,
            Self::HalfWindow => {
                let width = 360.0 / f64::from(SECTORS);
                let dirty = (0..SECTORS).step_by(2).map(|sector| {
                    let from_deg = f64::from(sector) * width;
                    DirtySector { from_deg, to_deg: from_deg + width, lost_share: 1.0 }
                });
                scenario.laser.dirty_sectors = dirty.collect();
            }
            Self::MixedPixels => scenario.laser.mixed_share = 0.5,
            Self::People => scenario.people = people(),
            Self::MovedPallets => {
                if let WorldOptions::BlockStorage(storage) = &mut scenario.world {
                    storage.moved_share = 0.25;
                    storage.moved_by = 0.2;
                }
            }
            Self::LaserYaw => scenario.vehicle.truth.laser_error.heading_deg = 0.1,
        }
    }
}

/// Ways that no vehicle crosses on P1 to P4.
fn people() -> Vec<PersonOptions> {
    let ways: [&[[f64; 2]]; 3] =
        [&[[-7.2, -5.0], [-6.7, 5.0]], &[[-2.5, 2.5], [-1.0, 6.0]], &[[9.55, -0.6], [9.75, 0.6]]];
    ways.map(|way| PersonOptions { way: way.to_vec(), speed: 1.2, phase: None, shape: PersonShape::default() }).into()
}
