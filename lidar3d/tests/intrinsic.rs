//! Intrinsic calibration on planes whose points are made by the inverse model, so that the truth is known.

use agv_lidar3d::calibration::Laser;
use agv_lidar3d::geometry::{Offsets, point};
use agv_lidar3d::intrinsic::{
    AdjustmentError, Deviation, Plane, Residual, Return, SegmentationError, Target, calibrate, calibrate_near,
    flatness, segment,
};
use proptest::prelude::*;

fn lasers() -> Vec<Laser> {
    (0..8)
        .map(|number| {
            let step = f64::from(number);
            Laser {
                distance: 1.0 + 0.05 * step,
                elevation: 0.03 - 0.05 * step,
                rotation: 0.02 * (step % 4.0) - 0.03,
                vertical_offset: 0.2,
                horizontal_offset: if number % 2 == 0 { 0.026 } else { -0.026 },
                is_enabled: true,
                full: None,
            }
        })
        .collect()
}

/// Without noise; every beam within 60 deg of straight ahead that meets the plane.
fn scan(lasers: &[Laser], offsets: Offsets, normal: [f64; 3], distance: f64) -> Target {
    let plane = Plane { normal, distance };
    let mut returns = Vec::new();
    for (laser, parameters) in lasers.iter().enumerate() {
        for column in -60..=60 {
            let azimuth = f64::from(column).to_radians();
            let origin = plane.distance_of(point(parameters, offsets, azimuth, 0.0));
            let rate = plane.distance_of(point(parameters, offsets, azimuth, 1.0)) - origin;
            let far = -origin / rate;
            if (0.5..60.0).contains(&far) {
                returns.push(Return { laser, azimuth, distance: far });
            }
        }
    }
    Target { returns, plane }
}

fn unit(yaw: f64, pitch: f64) -> [f64; 3] {
    [yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin()]
}

fn stands(lasers: &[Laser], offsets: Offsets) -> Vec<Target> {
    let tilts = [0.0, 0.15, -0.15, 0.3, 0.5];
    let distances = [3.0, 6.0, 12.0, 22.0];
    let at = |distance| tilts.map(|tilt| scan(lasers, offsets, unit(0.4 * tilt - 0.1, -tilt), distance));
    distances.into_iter().flat_map(at).collect()
}

fn disturbed(lasers: &[Laser], by: &[[f64; 3]]) -> Vec<Laser> {
    let move_one = |(laser, by): (&Laser, &[f64; 3])| Laser {
        distance: laser.distance + by[0],
        elevation: laser.elevation + by[1],
        rotation: laser.rotation + by[2],
        ..*laser
    };
    lasers.iter().zip(by).map(move_one).collect()
}

fn disturbance() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let one = (-0.03..0.03, -0.003..0.003, -0.008..0.008)
        .prop_map(|(distance, elevation, rotation)| [distance, elevation, rotation]);
    prop::collection::vec(one, 8)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn disturbed_lasers_come_back_up_to_a_yaw(
        by in disturbance(),
        offsets in prop_oneof![Just(Offsets::Orthogonal), Just(Offsets::Alternate)],
        residual in prop_oneof![Just(Residual::AlongBeam), Just(Residual::Perpendicular)],
    ) {
        let truth = lasers();
        let start = disturbed(&truth, &by);
        let found = calibrate(&start, offsets, residual, &stands(&truth, offsets)).unwrap();
        let gauge = by.iter().map(|by| by[2]).sum::<f64>() / by.len() as f64;
        for (truth, found) in truth.iter().zip(&found.lasers) {
            prop_assert!((found.distance - truth.distance).abs() < 1e-4);
            prop_assert!((found.elevation - truth.elevation).abs() < 1e-4);
            prop_assert!((found.rotation - truth.rotation - gauge).abs() < 1e-4);
        }
        prop_assert!(found.deviations.iter().all(Option::is_some));
    }
}

#[test]
fn a_laser_that_saw_nothing_stays_and_has_no_deviation() {
    let truth = lasers();
    let mut targets = stands(&truth, Offsets::Orthogonal);
    for target in &mut targets {
        target.returns.retain(|seen| seen.laser != 3);
    }
    let start = disturbed(&truth, &[[0.02, 0.001, 0.003]; 8]);
    let found = calibrate(&start, Offsets::Orthogonal, Residual::AlongBeam, &targets).unwrap();
    assert_eq!(found.lasers[3], start[3]);
    assert_eq!(found.deviations[3], None);
    assert!((found.lasers[4].distance - truth[4].distance).abs() < 1e-4);
}

#[test]
fn one_plane_does_not_determine_the_lasers() {
    let truth = lasers();
    let outcome = |targets: &[Target]| calibrate(&truth, Offsets::Orthogonal, Residual::AlongBeam, targets).err();
    assert_eq!(outcome(&[]), Some(AdjustmentError::NoPoints));
    let one = scan(&truth[..1], Offsets::Orthogonal, unit(0.0, 0.0), 8.0);
    let found = calibrate(&truth, Offsets::Orthogonal, Residual::AlongBeam, &[one]);
    match found {
        Err(error) => assert_eq!(error, AdjustmentError::Undetermined),
        // Theta is stated to be unknown: more than a tenth of a degree for each millimetre of noise.
        Ok(found) => assert!(found.deviations[0].unwrap().elevation / found.noise > 0.1_f64.to_radians() / 0.001),
    }
}

#[test]
fn what_one_plane_does_not_show_stays_near_what_is_known() {
    let truth = lasers();
    let start = disturbed(&truth, &[[0.01, 0.001, 0.002], [-0.01, -0.001, 0.001]].repeat(4));
    let one = scan(&truth, Offsets::Orthogonal, unit(0.1, -0.2), 8.0);
    let prior = Deviation { distance: 0.02, elevation: 0.002, rotation: 0.005, ..Deviation::FACTORY };
    let flat = |lasers: &[Laser]| flatness(lasers, Offsets::Orthogonal, &one.returns).unwrap().thickness();
    let (before, targets) = (flat(&start), [one.clone()]);
    let found = calibrate_near(&start, Offsets::Orthogonal, Residual::AlongBeam, &prior, &targets).unwrap();
    for (start, found) in start.iter().zip(&found.lasers) {
        assert!((start.distance - found.distance).abs() < 0.04, "{start:?} {found:?}");
        assert!((start.elevation - found.elevation).abs() < 0.004, "{start:?} {found:?}");
        assert!((start.rotation - found.rotation).abs() < 0.01, "{start:?} {found:?}");
    }
    assert!(flat(&found.lasers) < 0.2 * before, "{} {before}", flat(&found.lasers));
}

#[test]
fn a_target_is_cut_out_of_its_surroundings() {
    let truth = lasers();
    let wall = scan(&truth, Offsets::Orthogonal, unit(0.1, -0.2), 8.0).returns;
    let ground = scan(&truth, Offsets::Orthogonal, [0.0, 0.0, -1.0], 1.7).returns;
    let both: Vec<Return> = wall.iter().chain(&ground).copied().collect();
    let target = segment(&truth, Offsets::Orthogonal, &both, 1).unwrap();
    let exact = Plane { normal: unit(0.1, -0.2), distance: 8.0 };
    let alignment: f64 = target.plane.normal.iter().zip(exact.normal).map(|(a, b)| a * b).sum();
    assert!(alignment.abs() > 1.0 - 1e-4, "{:?}", target.plane);
    let stray = |seen: &&Return| exact.distance_of(seen.point(&truth, Offsets::Orthogonal).unwrap()).abs() > 1e-6;
    assert_eq!(target.returns.iter().filter(stray).count(), 0);
    assert!(target.returns.len() > wall.len() / 2);
    assert!(flatness(&truth, Offsets::Orthogonal, &target.returns).unwrap().thickness() < 1e-9);
}

#[test]
fn a_scan_without_a_wall_has_no_target() {
    let truth = lasers();
    assert!(matches!(segment(&truth, Offsets::Orthogonal, &[], 1), Err(SegmentationError::TooFew { returns: 0 })));
    let ground = scan(&truth, Offsets::Orthogonal, [0.0, 0.0, -1.0], 1.7).returns;
    assert!(matches!(segment(&truth, Offsets::Orthogonal, &ground, 1), Err(SegmentationError::NoPlane { .. })));
}
