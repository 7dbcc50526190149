//! The real tricycle, held to what its calibration must show.

use agv_lab::evaluate::calibration::sapienza::{self, Fit};
use agv_tests::recordings;

#[test]
fn the_real_tricycle_is_calibrated() {
    let Some(folder) = recordings("the_real_tricycle_is_calibrated", "sapienza_tricycle") else { return };
    let outcomes = sapienza::run(&folder).unwrap();
    let fit = |method: &str| -> &Fit { &outcomes.iter().find(|outcome| outcome.method == method).unwrap().fit };
    for method in ["atc_wheelbase", "joint"] {
        let fit = fit(method);
        println!("{method}: {fit:?}");
        assert!(fit.ate_rmse_m <= 0.080 && fit.heading_rmse_deg <= 1.2, "{method}");
        assert!((fit.laser_x_m - 1.80).abs() <= 0.02, "{method}: {}", fit.laser_x_m);
        assert!((fit.wheelbase_m - 1.55).abs() <= 0.04, "{method}: {}", fit.wheelbase_m);
        let std = &fit.std;
        let known = [std.steer_offset_forward_rad, std.steer_offset_backward_rad, std.laser_x_m, std.laser_y_m];
        assert!(known.iter().all(|deviation| *deviation > 0.0 && *deviation < 0.1), "{std:?}");
    }
    // A wrong wheelbase, or one offset for both senses, is worse.
    assert!(fit("stc").ate_rmse_m > 1.5 * fit("atc_wheelbase").ate_rmse_m);
    for outcome in &outcomes {
        assert_eq!(outcome.halves.len(), 2, "{}", outcome.method);
    }
    // What is fitted on half of the run holds for the other half too.
    let checked = outcomes.iter().find(|outcome| outcome.method == "joint").unwrap();
    for half in &checked.halves {
        assert!(half.checked_ate_rmse_m < 0.1 && half.checked_heading_rmse_deg < 2.0, "{half:?}");
    }
}
