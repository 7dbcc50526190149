//! Where a vehicle's lasers are mounted.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::measurement::{LASERS, LaserId};

/// The mount of each laser: its pose in R (K: l). What a laser without a mount measures is not used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Lasers([Option<Pose>; LASERS]);

impl Lasers {
    /// One laser.
    #[must_use]
    pub const fn one(mount: Pose) -> Self {
        let mut mounts = [None; LASERS];
        mounts[0] = Some(mount);
        Self(mounts)
    }

    /// The same with another one.
    #[must_use]
    pub fn with(mut self, laser: LaserId, mount: Pose) -> Self {
        self.set(laser, mount);
        self
    }

    /// The mount of a laser, if the vehicle has that one.
    #[must_use]
    pub fn mount(&self, laser: LaserId) -> Option<&Pose> {
        self.0.get(laser.index())?.as_ref()
    }

    /// The mount of the first laser; the origin of R if there is none.
    #[must_use]
    pub fn first(&self) -> &Pose {
        const ORIGIN: Pose = Pose { x: 0.0, y: 0.0, theta: 0.0 };
        self.mount(LaserId::FIRST).unwrap_or(&ORIGIN)
    }

    /// Mounts a laser.
    pub fn set(&mut self, laser: LaserId, mount: Pose) {
        if let Some(place) = self.0.get_mut(laser.index()) {
            *place = Some(mount);
        }
    }

    /// The mount of the first laser, to be changed.
    pub fn first_mut(&mut self) -> &mut Pose {
        let [first, ..] = &mut self.0;
        first.get_or_insert_default()
    }

    /// The lasers that the vehicle has, with their mounts.
    pub fn iter(&self) -> impl Iterator<Item = (LaserId, &Pose)> {
        let numbered = self.0.iter().enumerate();
        numbered.filter_map(|(number, mount)| Some((LaserId::new(number as u8)?, mount.as_ref()?)))
    }
}
