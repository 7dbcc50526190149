//! Observations as a filter compares them.

use agv_core::filter::{Cartesian, Ekf, Landmark, Linearisation, Observation, Slots};
use agv_core::geometry::{Point, Pose};
use agv_core::measurement::LaserId;
use nalgebra::Matrix2x3;

/// What a vehicle at `pose` with its sensor at `mount` makes of an observation of a landmark that is not in the state.
pub fn linearise(
    observation: &Observation,
    pose: &Pose,
    mount: &Pose,
    position: &Point,
    variance: f64,
) -> Option<Linearisation<2>> {
    let state = Ekf::new(*pose, 0.0, 0.0);
    state.observe(
        &state.viewpoint(LaserId::FIRST, mount),
        observation,
        &Landmark::Known { position: *position, variance },
    )
}

/// What a filter makes of a position that is seen from `mount`.
pub fn observe<S: Slots>(
    filter: &Ekf<S>,
    mount: &Pose,
    seen: &Cartesian,
    landmark: Landmark,
) -> Option<Linearisation<2>> {
    filter.observe(&filter.viewpoint(LaserId::FIRST, mount), &Observation::Cartesian(*seen), &landmark)
}

/// The derivatives by the pose.
pub fn by_pose(linearisation: &Linearisation<2>) -> Matrix2x3<f64> {
    Matrix2x3::from_columns(&linearisation.by_pose)
}
