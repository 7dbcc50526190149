//! The real tricycle, held to what its calibration must show.

use agv_lab::evaluate::calibration::optiodom;
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

/// Four kinds of robots, fitted on a session or two and dead reckoned on all others: no worse than was measured once, and better than
/// nominal where a path is like the fitted ones.
#[test]
fn real_robots_of_four_kinds_are_calibrated() {
    let Some(folder) = recordings("real_robots_of_four_kinds_are_calibrated", "optiodom") else { return };
    let outcome = optiodom::run(&folder, false).unwrap();
    let cell = |kind: &str, path: &str, method: &str| {
        let is_it = |cell: &&optiodom::Cell| cell.kind == kind && cell.path == path && cell.method == method;
        outcome.cells.iter().find(is_it).unwrap()
    };
    for (kind, path, most) in [
        ("tricycle", "free", 0.039),
        ("differential", "free", 0.022),
        ("omni3", "joystick", 0.050),
        ("omni4", "square", 0.029),
    ] {
        let (nominal, joint) = (cell(kind, path, "nominal"), cell(kind, path, "joint"));
        println!("{joint:?}");
        assert!(joint.ate_m <= most && joint.ate_m < 0.5 * nominal.ate_m, "{kind}: {joint:?}");
        assert!(joint.end_m < nominal.end_m && joint.end_heading_deg < nominal.end_heading_deg, "{kind}: {joint:?}");
        assert!(joint.clock_offset_s.is_some() && nominal.clock_offset_s.is_none());
    }
    // The tricycle's computer is up to 1.5 s late and runs up to 2 % fast.
    let [least, _] = cell("tricycle", "square", "joint").clock_offset_s.unwrap();
    let [_, fastest] = cell("tricycle", "square", "joint").clock_rate.unwrap();
    assert!(least < -1.4 && (0.014..0.022).contains(&fastest), "{least} {fastest}");
    assert!(outcome.cells.iter().any(|cell| cell.method == "closed_form"));
}
