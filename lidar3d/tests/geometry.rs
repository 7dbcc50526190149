//! The geometric model against finite differences, and there and back.

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::{Offsets, inverse, jacobian, offset_jacobian, point};
use proptest::prelude::*;

fn laser() -> impl Strategy<Value = Laser> {
    (-0.5..2.0, -0.5..0.2, -0.2..0.2, -0.3..0.3, -0.05..0.05).prop_map(
        |(distance, elevation, rotation, vertical_offset, horizontal_offset)| Laser {
            distance,
            elevation,
            rotation,
            vertical_offset,
            horizontal_offset,
            is_enabled: true,
            full: None,
        },
    )
}

fn offsets() -> impl Strategy<Value = Offsets> {
    prop_oneof![Just(Offsets::Orthogonal), Just(Offsets::Alternate)]
}

proptest! {
    #[test]
    fn derivatives_are_those_of_finite_differences(
        laser in laser(), offsets in offsets(), azimuth in 0.0..6.2, distance in 1.0..100.0,
    ) {
        const STEP: f64 = 1e-6;
        let stated = jacobian(&laser, offsets, azimuth, distance);
        let [vertical, horizontal] = offset_jacobian(&laser, offsets, azimuth);
        for parameter in 0..5 {
            let moved = |by: f64| {
                let mut laser = laser;
                let parameters = [
                    &mut laser.distance,
                    &mut laser.elevation,
                    &mut laser.rotation,
                    &mut laser.vertical_offset,
                    &mut laser.horizontal_offset,
                ];
                *parameters.into_iter().nth(parameter).unwrap() += by;
                point(&laser, offsets, azimuth, distance)
            };
            let (ahead, behind) = (moved(STEP), moved(-STEP));
            for axis in 0..3 {
                let found = (ahead[axis] - behind[axis]) / (2.0 * STEP);
                let [a, b, c] = stated[axis];
                let stated = [a, b, c, vertical[axis], horizontal[axis]][parameter];
                prop_assert!((found - stated).abs() < 1e-6 * distance.max(1.0));
            }
        }
    }

    #[test]
    fn the_inverse_model_gives_angle_and_distance_back(
        laser in laser(), offsets in offsets(), azimuth in -3.0..3.0, distance in 2.0..100.0,
    ) {
        let (found, far) = inverse(&laser, offsets, point(&laser, offsets, azimuth, distance)).unwrap();
        let turned = (found - azimuth).rem_euclid(std::f64::consts::TAU);
        prop_assert!(turned.min(std::f64::consts::TAU - turned) < 1e-9);
        prop_assert!((far - distance).abs() < 1e-9);
    }
}

#[test]
fn a_level_beam_straight_ahead_sees_its_offsets_as_coordinates() {
    let laser = Laser { distance: 0.5, vertical_offset: 0.2, horizontal_offset: -0.026, ..Laser::default() };
    let [x, y, z] = point(&laser, Offsets::Orthogonal, 0.0, 9.5);
    assert!((x - 10.0).abs() < 1e-12 && (y + 0.026).abs() < 1e-12 && (z - 0.2).abs() < 1e-12);
    // A quarter turn clockwise looks to the right.
    let [x, y, _] = point(&laser, Offsets::Orthogonal, std::f64::consts::FRAC_PI_2, 9.5);
    assert!((x + 0.026).abs() < 1e-12 && (y + 10.0).abs() < 1e-12);
}
