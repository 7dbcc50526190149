//! How sure a pose is that scans of the way behind hold, and when a scan becomes one of them.

use agv_core::localizer::{KeyScanParameters, Parameters};
use agv_core::sources::Switches;

use super::support::stage::{Stage, parameters};

const POSITION_FLOOR: f64 = 0.002;
const HEADING_FLOOR: f64 = 0.0005;

/// A vehicle that knows its start exactly and its motion hardly at all, so that key scans alone say how sure it is.
fn stage(key_scans: KeyScanParameters) -> Stage {
    let mut parameters: Parameters = parameters();
    parameters.maps.slam = true;
    parameters.sources = Switches { corners: false, end_points: false, ..Switches::ALL };
    let biases = &mut parameters.slam.biases;
    (biases.scale, biases.steering, biases.laser_yaw) = (0.0, 0.0, 0.0);
    let noise = &mut parameters.odometry_noise;
    (noise.slip, noise.side_slip, noise.yaw) = (0.3, 0.3, 0.3);
    parameters.limits.largest_heading_deviation = 3.0;
    parameters.slam.key_scans = key_scans;
    let mut stage = Stage::new(parameters);
    stage.tell(stage.truth, 1e-6, 1e-7);
    stage.scan();
    stage
}

fn with_inflation(inflation: f64) -> KeyScanParameters {
    KeyScanParameters {
        inflation,
        position_floor: POSITION_FLOOR,
        heading_floor: HEADING_FLOOR,
        ..KeyScanParameters::default()
    }
}

#[test]
fn an_alignment_is_as_sure_as_its_floor_and_its_inflated_covariance() {
    let covariance = |inflation| {
        let mut stage = stage(with_inflation(inflation));
        stage.drive(0.5, 0.1);
        let before = stage.said().covariance;
        assert!(before[0] > 1e-3, "{before:?}");
        stage.scan().covariance
    };
    let floor = covariance(0.0);
    let [xx, xy, yy, _, _, hh] = floor;
    // The laser stands 0.6 m before R, whose position has a little of the heading's error.
    for variance in [xx, yy] {
        let ratio = variance / POSITION_FLOOR.powi(2);
        assert!((0.95..1.05).contains(&ratio), "{ratio}");
    }
    assert!(xy.abs() < 0.05 * xx && (0.95..1.01).contains(&(hh / HEADING_FLOOR.powi(2))), "{floor:?}");
    let added = |inflation| {
        let with = covariance(inflation);
        [0, 2, 5].map(|entry: usize| with[entry] - floor[entry])
    };
    for (one, three) in added(100.0).into_iter().zip(added(300.0)) {
        assert!(one > 1e-9 && (2.8..3.05).contains(&(three / one)), "{one} {three}");
    }
}

/// Way, m, and turn, rad, after which the pose becomes surer by a second key scan.
fn second_key(speed: f64, turn: f64, revolutions: usize) -> Option<(f64, f64)> {
    let mut stage = stage(with_inflation(0.0));
    let start = stage.truth;
    let mut alone = None;
    for _ in 0..revolutions {
        stage.drive(speed, turn);
        let [xx, _, yy, ..] = stage.scan().covariance;
        let both = xx + yy;
        let of_one = *alone.get_or_insert(both);
        assert!(both < 1.2 * of_one, "{both} {of_one}");
        if both < 0.85 * of_one {
            let way = start.between(&stage.truth);
            return Some((way.x.hypot(way.y), way.theta.abs()));
        }
    }
    None
}

#[test]
fn a_scan_becomes_a_key_scan_after_a_way_or_a_turn() {
    // It helps from the scan behind it on.
    let way = second_key(0.5, 0.0, 40);
    assert!(way.is_some_and(|(way, _)| (1.5..1.7).contains(&way)), "{way:?}");
    for turn in [0.4, -0.4] {
        let turned = second_key(0.3, turn, 20);
        assert!(turned.is_some_and(|(_, turn)| (0.35..0.5).contains(&turn)), "{turned:?}");
    }
}

#[test]
fn a_scan_of_which_little_fits_a_key_scan_says_nothing() {
    let is_corrected = |change: &dyn Fn(usize, f32) -> f32| {
        let mut stage = stage(with_inflation(0.0));
        stage.drive(0.5, 0.0);
        let before = stage.said().covariance;
        let after = stage.scan_as(change).covariance;
        after[0] < 0.5 * before[0]
    };
    // Of every five beams one hits a wall, and the others hit nothing, or people all round.
    assert!(is_corrected(&|beam, range| if beam % 5 == 0 { range } else { 0.0 }));
    assert!(!is_corrected(&|beam, range| if beam % 5 == 0 { range } else { 1.0 + 0.001 * (beam % 97) as f32 }));
    assert!(!is_corrected(&|_, _| 0.0));
}
