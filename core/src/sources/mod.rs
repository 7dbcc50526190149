//! What corrects the pose: one source a file. Each says what it needs, how it is observed, what its gate lets pass, and what
//! became of it; each has a switch.
//!
//! A new source is its file and one line in the list below. What has a model of its own and no landmarks comes in by
//! [`Aid`], also from outside this crate (`examples/own_source.rs`).

mod aid;
mod association;
mod contours;
mod contours_behind;
mod correction;
mod features;
mod gyro;
mod key_scans;
mod landmark_maps;
mod landmark_slots;
mod laser_odometry;
mod places;
mod reflectors;
mod sighting;
mod slot_parameters;
mod status;

pub use aid::{Aid, AidOutcome};
pub use association::{AssociationParameters, MapUse};
pub use contours::{Contours, FindContours, LendContours, NoContours, pose_by_contours};
pub use features::FeatureParameters;
pub use gyro::{AtRest, GyroMotion, GyroSource, NoTurn, RestSum};
pub use key_scans::KeyScanParameters;
pub use places::{FindPlaces, NoPlaces, Places};
pub use reflectors::ReflectorParameters;
pub use slot_parameters::SlamParameters;
pub use status::SourceStatus;

pub(crate) use aid::correct as correct_by_aid;
pub(crate) use association::{Believed, Comparison};
pub(crate) use contours::{ContourOutcome, see_contours};
pub(crate) use contours_behind::{ContoursBehind, LaserPlace, ScanBehind};
pub(crate) use correction::{Outcome, correct};
pub(crate) use features::{FeatureFinder, FindFeatures};
pub(crate) use key_scans::KeyScans;
pub(crate) use landmark_maps::{AddLandmarks, LandmarkMaps, LendLandmarks, MapViews, Maps};
pub use landmark_maps::{Lent, MapKeeping, Own};
pub(crate) use landmark_slots::LandmarkSlots;
pub use laser_odometry::BySurfaces;
pub(crate) use laser_odometry::{LaserAtStart, LaserOdometry};
pub(crate) use reflectors::see_reflectors;
pub use sighting::OBSERVATIONS;
pub(crate) use sighting::{Sighting, Workspace};

use serde::{Deserialize, Serialize};

use crate::maps::LandmarkKind;

/// Makes the list of sources, a switch for each, and what became of each.
///
/// The last of them has come after the format of logs: its switch stands behind the header ([`crate::record`]).
macro_rules! sources {
    ($($(#[$doc:meta])* $source:ident $field:ident;)+ [late] $(#[$late_doc:meta])* $late_source:ident $late:ident;) => {
        /// What can correct the pose.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Source {
            $($(#[$doc])* $source,)+
            $(#[$late_doc])* $late_source,
        }

        impl Source {
            /// All sources.
            pub const ALL: &[Self] = &[$(Self::$source),+, Self::$late_source];
        }

        /// Which sources may correct the pose.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct Switches {
            $($(#[$doc])* pub $field: bool,)+
            $(#[$late_doc])* #[serde(skip)] pub $late: bool,
        }

        impl Default for Switches {
            fn default() -> Self {
                Self::ALL
            }
        }

        impl Switches {
            /// All of them.
            pub const ALL: Self = Self { $($field: true,)+ $late: true };

            /// Whether a source may correct the pose.
            #[must_use]
            pub const fn of(&self, source: Source) -> bool {
                match source {
                    $(Source::$source => self.$field,)+
                    Source::$late_source => self.$late,
                }
            }
        }

        /// What became of each source.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct Statuses {
            $($(#[$doc])* pub $field: SourceStatus,)+
            $(#[$late_doc])* pub $late: SourceStatus,
        }

        impl Statuses {
            /// What became of a source.
            #[must_use]
            pub const fn of(&self, source: Source) -> &SourceStatus {
                match source {
                    $(Source::$source => &self.$field,)+
                    Source::$late_source => &self.$late,
                }
            }

            pub(crate) const fn of_mut(&mut self, source: Source) -> &mut SourceStatus {
                match source {
                    $(Source::$source => &mut self.$field,)+
                    Source::$late_source => &mut self.$late,
                }
            }
        }
    };
}

sources! {
    /// Reflectors that a laser finds, or that are found in its scans: `reflectors.rs`.
    Reflectors reflectors;
    /// Corners of the contours: `features.rs`.
    Corners corners;
    /// Ends of the contours: `features.rs`.
    EndPoints end_points;
    /// Scans of the distance behind: `key_scans.rs`.
    KeyScans key_scans;
    /// Surfaces of a kept map, `contours.rs`, or without one of the way behind: `contours_behind.rs`.
    Contours contours;
    /// Poses from outside: the pose begins anew at each.
    GivenPose given_pose;
    /// Models from outside: `aid.rs`.
    Aids aids;
    [late]
    /// The turn of each motion by a gyro: `gyro.rs`.
    Gyro gyro;
}

impl Source {
    /// The source of a landmark of that kind.
    #[must_use]
    pub const fn of_landmark(kind: LandmarkKind) -> Self {
        match kind {
            LandmarkKind::Reflector => Self::Reflectors,
            LandmarkKind::Corner => Self::Corners,
            LandmarkKind::EndPoint => Self::EndPoints,
        }
    }
}
