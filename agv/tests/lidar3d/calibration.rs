//! Parameters of a real sensor found back from simulated scans.

use agv_lab::evaluate::{lidar3d_calibration, lidar3d_sharpness};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::intrinsic::Residual;
use agv_tests::recordings;

const TRUTH: &str = "lidar3d/calib/ros_64e_utexas.yaml";

#[test]
fn disturbed_parameters_of_a_real_sensor_come_back_and_their_deviations_are_honest() {
    let Some(path) = recordings("lidar3d calibration", TRUTH) else { return };
    let outcome = lidar3d_calibration::run(&path, Offsets::Orthogonal, Residual::AlongBeam, 11).unwrap();
    assert_eq!(outcome.lasers, 64);
    assert!(outcome.is_within_limits, "{outcome:?}");
    // The errors of all lasers have a part in common, so their root mean square is not as near to one as their number
    // would make it.
    assert!(outcome.normalised_errors.iter().all(|error| (0.4..1.6).contains(error)), "{outcome:?}");
    assert!(outcome.used.sum_of_squares_ratio >= 5.0, "{outcome:?}");
    // Not thinner than the truth makes them, up to a hundredth: that would be fitted noise.
    for walls in [outcome.used, outcome.held_out] {
        assert!((walls.thickness_after_m / walls.thickness_true_m - 1.0).abs() < 0.01, "{outcome:?}");
    }
}

#[test]
fn ground_and_facades_of_real_scans_become_thinner_where_they_were_not_used() {
    let Some(folder) = recordings("lidar3d sharpness", "lidar3d/moosmann/MuehlburgerTor") else { return };
    let outcome = lidar3d_sharpness::moosmann(&folder).unwrap();
    for thickness in [outcome.ground_held_out, outcome.facades_held_out] {
        assert!(thickness.patches > 100 && thickness.after_m < 0.95 * thickness.before_m, "{outcome:?}");
    }
}
