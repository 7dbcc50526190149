//! What is seen in one revolution is seen from different places: each observation is used where the laser was.

use agv_core::localizer::{MapUse, Mode, Parameters};
use agv_core::maps::{LandmarkKind, Verdict};
use agv_core::sensing::ReflectorDetection;

use super::support::stage::{Stage, parameters, reflectors};

const SPEED: f64 = 1.5;
const TURN: f64 = 0.7;

fn with(maps: MapUse) -> Parameters {
    Parameters { maps, ..parameters() }
}

const NONE: MapUse = MapUse { reflectors: false, features: false, dynamic: false, slam: false };

/// Observations that were accepted and the largest of their distances from what was expected, m.
fn accepted(stage: &Stage, kind: impl Fn(LandmarkKind) -> bool) -> (usize, f64) {
    let uses = stage.localizer.outputs().uses.iter();
    let of_kind = uses.filter(|used| kind(used.kind) && used.verdict == Verdict::Accepted);
    let mut count = 0;
    let largest = of_kind.inspect(|_| count += 1).map(|used| {
        let [first, second] = used.residual;
        match used.kind {
            LandmarkKind::Reflector => first.abs(),
            _ => first.hypot(second),
        }
    });
    let largest = largest.fold(0.0, f64::max);
    (count, largest)
}

fn is_reflector(kind: LandmarkKind) -> bool {
    kind == LandmarkKind::Reflector
}

#[test]
fn reflectors_are_used_where_they_were_seen_from() {
    for slam in [false, true] {
        let mut stage = Stage::told(with(MapUse { reflectors: true, slam, ..NONE }));
        for _ in 0..20 {
            let revolution = stage.revolve(SPEED, TURN);
            stage.glimpse(&revolution);
            let (count, largest) = accepted(&stage, is_reflector);
            assert!(count == reflectors().len() && largest < 0.004, "{slam} {count} {largest}");
            let (position, heading) = stage.error();
            assert!(position < 0.004 && heading < 0.001, "{slam} {position} {heading}");
        }
    }
}

#[test]
fn features_are_used_where_they_were_seen_from() {
    for maps in [
        MapUse { features: true, ..NONE },
        MapUse { dynamic: true, ..NONE },
        MapUse { features: true, dynamic: true, ..NONE },
        MapUse { features: true, slam: true, ..NONE },
        MapUse { slam: true, ..NONE },
    ] {
        let mut stage = Stage::told(with(maps));
        let mut all = 0;
        for revolution in 0..20 {
            let way = stage.revolve(SPEED, TURN);
            stage.sweep(&way);
            let (count, largest) = accepted(&stage, |kind| !is_reflector(kind));
            all += count;
            assert!(largest < 0.08, "{maps:?} {revolution} {largest}");
            let (position, heading) = stage.error();
            assert!(position < 0.04 && heading < 0.012, "{maps:?} {revolution} {position} {heading}");
        }
        assert!(all > 60, "{maps:?} {all}");
        assert_eq!(stage.said().mode, Mode::Features);
    }
}

#[test]
fn the_centre_of_a_reflector_is_behind_its_face() {
    let ranges = |centre_offset| {
        let mut parameters = with(MapUse { reflectors: true, ..NONE });
        parameters.reflectors.detection = Some(ReflectorDetection { centre_offset, ..ReflectorDetection::default() });
        let mut stage = Stage::told(parameters);
        let way = stage.revolve(0.0, 0.0);
        stage.sweep(&way);
        let ranges = stage.localizer.outputs().uses.iter().map(|used| used.position[0].hypot(used.position[1]));
        ranges.collect::<Vec<f32>>()
    };
    let (face, centre) = (ranges(0.0), ranges(0.04));
    assert!(face.len() >= 8 && face.len() == centre.len(), "{face:?} {centre:?}");
    assert!(face.iter().zip(&centre).all(|(face, centre)| (centre - face - 0.04).abs() < 1e-5), "{face:?} {centre:?}");
}

#[test]
fn bright_places_of_a_scan_are_reflectors_if_they_are_looked_for() {
    let detection = Some(ReflectorDetection::default());
    for slam in [false, true] {
        for (detection, is_wanted, expected) in
            [(detection, true, true), (None, true, false), (detection, false, false)]
        {
            let mut parameters = with(MapUse { reflectors: is_wanted, slam, ..NONE });
            parameters.reflectors.detection = detection;
            let mut stage = Stage::told(parameters);
            for _ in 0..5 {
                let way = stage.revolve(SPEED, TURN);
                stage.sweep(&way);
                let (count, largest) = accepted(&stage, is_reflector);
                assert!(if expected { count >= 8 } else { count == 0 }, "{slam} {count}");
                assert!(largest < 0.03, "{largest}");
            }
            let (position, heading) = stage.error();
            assert!(position < 0.012 && heading < 0.003, "{slam} {position} {heading}");
        }
    }
}
