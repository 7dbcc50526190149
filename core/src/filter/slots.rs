//! What the state of a filter has room for.

use core::fmt::Debug;

use nalgebra::{ArrayStorage, SVector};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::arrays;
use crate::geometry::{Point, Pose};

/// A value with which memory begins.
pub trait Empty: Clone + Debug {
    /// It says nothing.
    const EMPTY: Self;
}

impl Empty for f64 {
    const EMPTY: Self = 0.0;
}

impl<T: Clone + Debug> Empty for Option<T> {
    const EMPTY: Self = None;
}

impl<const SIZE: usize> Empty for SVector<f64, SIZE> {
    const EMPTY: Self = Self::from_array_storage(ArrayStorage([[0.0; SIZE]]));
}

/// Memory for a number of values that is known when it is compiled.
pub trait Storage<T>: Clone + Debug + AsRef<[T]> + AsMut<[T]> {
    /// Memory in which nothing is yet.
    fn empty() -> Self;

    /// Memory as it was serialized.
    ///
    /// # Errors
    /// Those of the deserializer, and one where there is another number of values.
    fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>
    where
        T: Deserialize<'de>;
}

impl<T: Empty, const SIZE: usize> Storage<T> for [T; SIZE] {
    #[inline(always)]
    fn empty() -> Self {
        [const { T::EMPTY }; SIZE]
    }

    fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>
    where
        T: Deserialize<'de>,
    {
        arrays::deserialize(deserializer)
    }
}

/// [`Storage`] as a field that is serialized.
pub(crate) mod storage {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Storage, arrays};

    pub fn serialize<T: Serialize, S: Serializer>(values: &impl Storage<T>, serializer: S) -> Result<S::Ok, S::Error> {
        arrays::serialize(values, serializer)
    }

    pub fn deserialize<'de, T: Deserialize<'de>, A: Storage<T>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<A, D::Error> {
        A::deserialize(deserializer)
    }
}

/// A pose that was copied when it was the present one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PastPose {
    /// Pose of R in W.
    pub pose: Pose,
    /// Position for the Jacobians, m.
    pub anchor: Point,
}

/// A landmark in the state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StateLandmark {
    /// Position in W, m.
    pub position: Point,
    /// Position for the Jacobians, m.
    pub anchor: Point,
}

/// Room of a filter's state: the pose, and what depends on it. A slot that is free has neither variance nor correlation.
pub trait Slots: Clone + Debug {
    /// Scale and steering of the odometry, yaw of the laser: three numbers, or none.
    type Biases: Storage<f64>;
    /// One value for each past pose.
    type PerPose<T: Empty>: Storage<T>;
    /// One value for each landmark that is found, or seen again, while driving.
    type PerLandmark<T: Empty>: Storage<T>;
    /// Position of the pose for the Jacobians: one, or none if it is that of the pose.
    type Anchor: Storage<Point>;
    /// Lower triangle of the covariance.
    type Covariance: Storage<f64>;
    /// A row of `SIZE` numbers for each state.
    type Rows<const SIZE: usize>: Storage<SVector<f64, SIZE>>;
    /// Number of states.
    const STATES: usize;
}

/// The pose alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseOnly;

impl Slots for PoseOnly {
    type Biases = [f64; 0];
    type PerPose<T: Empty> = [T; 0];
    type PerLandmark<T: Empty> = [T; 0];
    type Anchor = [Point; 0];
    type Covariance = [f64; 6];
    type Rows<const SIZE: usize> = [SVector<f64, SIZE>; 3];
    const STATES: usize = 3;
}

/// The pose, three biases, `POSES` past poses and `LANDMARKS` landmarks: `STATES` is [`slot_states`] of them, and `ENTRIES`
/// is [`packed_entries`] of that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseAndSlots<const POSES: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize>;

impl<const POSES: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize> Slots
    for PoseAndSlots<POSES, LANDMARKS, STATES, ENTRIES>
{
    type Biases = [f64; 3];
    type PerPose<T: Empty> = [T; POSES];
    type PerLandmark<T: Empty> = [T; LANDMARKS];
    type Anchor = [Point; 1];
    type Covariance = [f64; ENTRIES];
    type Rows<const SIZE: usize> = [SVector<f64, SIZE>; STATES];
    const STATES: usize = {
        assert!(STATES == slot_states(POSES, LANDMARKS) && ENTRIES == packed_entries(STATES));
        STATES
    };
}

/// Entries of the lower triangle of a square matrix with that many rows.
#[must_use]
pub const fn packed_entries(states: usize) -> usize {
    states * (states + 1) / 2
}

/// First of the past poses' states.
const POSES_FROM: usize = 6;

/// States of a filter with room for that many past poses and landmarks.
#[must_use]
pub const fn slot_states(poses: usize, landmarks: usize) -> usize {
    POSES_FROM + 3 * poses + 2 * landmarks
}

/// First state of a past pose.
pub(super) const fn pose_state(slot: usize) -> usize {
    POSES_FROM + 3 * slot
}
