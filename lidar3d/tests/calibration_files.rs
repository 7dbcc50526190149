//! Calibration files there and back, and texts that are none.

use agv_lidar3d::calibration::{Calibration, CalibrationError, Full, Laser};
use agv_lidar3d::geometry::{Offsets, point};
use agv_lidar3d::packet::Sensor;
use proptest::prelude::*;

fn laser(has_full: bool) -> impl Strategy<Value = Laser> {
    let five = (-2.0..2.0, -0.6..0.3, -0.3..0.3, -0.3..0.3, -0.1..0.1, any::<bool>());
    let full = (-2.0..2.0, -2.0..2.0, 0.0..30.0, 0.0..3.0, any::<u8>(), any::<u8>());
    (five, full).prop_map(
        move |((distance, elevation, rotation, vertical_offset, horizontal_offset, is_enabled), full)| Laser {
            distance,
            elevation,
            rotation,
            vertical_offset,
            horizontal_offset,
            is_enabled,
            full: has_full.then_some(Full {
                distance_x: full.0,
                distance_y: full.1,
                focal_distance: full.2,
                focal_slope: full.3,
                min_intensity: full.4,
                max_intensity: full.5,
                has_two_points: true,
            }),
        },
    )
}

fn calibration() -> impl Strategy<Value = Calibration> {
    (any::<bool>(), 1_usize..=64)
        .prop_flat_map(|(has_full, lasers)| prop::collection::vec(laser(has_full), lasers))
        .prop_map(|lasers| Calibration { distance_resolution: Some(0.002), lasers })
}

/// Degrees and centimetres are rounded when they are computed: a few units in the last place.
fn is_same(one: &Calibration, other: &Calibration) -> bool {
    let values = |laser: &Laser| {
        let full = laser.full.unwrap_or_default();
        let five = [laser.distance, laser.elevation, laser.rotation, laser.vertical_offset, laser.horizontal_offset];
        let rest = [full.distance_x, full.distance_y, full.focal_distance, full.focal_slope];
        five.into_iter().chain(rest).collect::<Vec<f64>>()
    };
    let exact = |laser: &Laser| {
        let limits = laser.full.map(|full| (full.min_intensity, full.max_intensity, full.has_two_points));
        (laser.is_enabled, limits)
    };
    let near = |(a, b): (f64, f64)| (a - b).abs() <= 4.0 * f64::EPSILON * a.abs();
    one.lasers.len() == other.lasers.len()
        && near((one.distance_resolution.unwrap(), other.distance_resolution.unwrap()))
        && one
            .lasers
            .iter()
            .zip(&other.lasers)
            .all(|(a, b)| exact(a) == exact(b) && values(a).into_iter().zip(values(b)).all(near))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn nothing_is_lost_in_either_format(calibration in calibration()) {
        let xml = Calibration::read(&calibration.to_db_xml()).unwrap();
        prop_assert!(is_same(&calibration, &xml));
        // YAML has the units of the values themselves.
        let yaml = Calibration::read(&calibration.to_ros_yaml()).unwrap();
        prop_assert_eq!(&yaml, &calibration);
        let round = Calibration::read(&yaml.to_db_xml()).unwrap();
        prop_assert!(is_same(&calibration, &Calibration::read(&round.to_ros_yaml()).unwrap()));
    }

    #[test]
    fn no_text_does_harm(text in "\\PC{0,200}") {
        let _ = Calibration::read(&text);
        let _ = Calibration::read(&format!("<a>{text}</a>"));
        let _ = Calibration::read(&format!("lasers: [{text}]"));
    }
}

const XML: &str = "<boost_serialization><DB><distLSB_>0.2</distLSB_><points_><item><px><id_>0</id_>\
    <rotCorrection_>-4.5</rotCorrection_><vertCorrection_>-7.2</vertCorrection_><distCorrection_>123.8</distCorrection_>\
    <vertOffsetCorrection_>21.5</vertOffsetCorrection_><horizOffsetCorrection_>2.6</horizOffsetCorrection_>\
    </px></item></points_></DB></boost_serialization>";

const YAML: &str = "lasers:\n- {dist_correction: 1.238, horiz_offset_correction: 0.026, laser_id: 0, rot_correction: -0.0785398163,\n  \
    vert_correction: -0.1256637061, vert_offset_correction: 0.215}\nnum_lasers: 1\n";

#[test]
fn degrees_and_centimetres_become_radians_and_metres() {
    for (text, resolution) in [(XML, Some(0.002)), (YAML, None)] {
        let Calibration { lasers, distance_resolution } = Calibration::read(text).unwrap();
        let laser = lasers[0];
        assert_eq!(distance_resolution, resolution);
        assert!(laser.full.is_none() && laser.is_enabled);
        assert!((laser.rotation.to_degrees() + 4.5).abs() < 1e-6 && (laser.elevation.to_degrees() + 7.2).abs() < 1e-6);
        assert!((laser.distance - 1.238).abs() < 1e-9 && (laser.vertical_offset - 0.215).abs() < 1e-9);
        assert!((laser.horizontal_offset - 0.026).abs() < 1e-9);
    }
}

#[test]
fn what_is_wrong_with_a_file_is_said() {
    let error = |text: &str| Calibration::read(text).unwrap_err();
    assert!(matches!(error(""), CalibrationError::Foreign { .. }));
    assert!(matches!(error("<html></html>"), CalibrationError::Foreign { .. }));
    let gap = XML.replace("<id_>0", "<id_>3");
    assert_eq!(error(&gap), CalibrationError::Numbers { place: 0, found: 3 });
    let word = XML.replace("123.8", "far");
    assert_eq!(error(&word), CalibrationError::Value { laser: 0, name: "distCorrection_" });
    let count = YAML.replace("num_lasers: 1", "num_lasers: 64");
    assert_eq!(error(&count), CalibrationError::Count { found: 1, wanted: 64 });
    assert!(matches!(error(&YAML.replace("1.238", ".nan")), CalibrationError::Foreign { .. }));
    // A whole foreign file is not repeated.
    assert!(error(&"word ".repeat(10_000)).to_string().len() < 300);
    let wrong = Calibration::read(YAML).unwrap().for_sensor(Sensor::Hdl64e);
    assert_eq!(wrong, Err(CalibrationError::Count { found: 1, wanted: 64 }));
}

/// A file of a sensor's lasers that states only where the beams point.
fn bare(sensor: Sensor) -> String {
    let elevations = sensor.elevations().map_or(vec![0.0; sensor.lasers()], <[f64]>::to_vec);
    let entry = |(id, elevation): (usize, &f64)| {
        format!("- {{laser_id: {id}, rot_correction: 0.0, vert_correction: {}}}\n", elevation.to_radians())
    };
    format!("lasers:\n{}", elevations.iter().enumerate().map(entry).collect::<String>())
}

#[test]
fn distance_corrections_and_offsets_need_not_be_stated() {
    let calibration = Calibration::read(&bare(Sensor::Hdl32e)).unwrap();
    assert_eq!(calibration.lasers.len(), 32);
    assert!(calibration.lasers.iter().all(|laser| laser.distance == 0.0 && laser.vertical_offset == 0.0));
}

#[test]
fn a_count_is_as_long_as_the_manual_says_and_for_an_hdl64e_as_the_file_says() {
    for sensor in Sensor::ALL {
        let silent = Calibration::read(&bare(sensor)).unwrap();
        assert_eq!(silent.other_resolution(sensor), None);
        assert_eq!(silent.for_sensor(sensor).unwrap().distance_resolution, Some(sensor.distance_resolution()));
        let wrong = Calibration::read(&format!("{}distance_resolution: 0.007\n", bare(sensor))).unwrap();
        assert_eq!(wrong.other_resolution(sensor), Some(0.007));
        let used = if sensor == Sensor::Hdl64e { 0.007 } else { sensor.distance_resolution() };
        assert_eq!(wrong.for_sensor(sensor).unwrap().distance_resolution, Some(used));
    }
    assert!(Calibration::read(&format!("{}distance_resolution: 0.0\n", bare(Sensor::Vlp16))).is_err());
}

#[test]
fn a_calibration_of_a_sensor_that_looks_elsewhere_is_refused() {
    let foreign = Calibration::read(&bare(Sensor::Hdl32e)).unwrap().for_sensor(Sensor::Vlp32c);
    assert_eq!(foreign, Err(CalibrationError::Elevation { laser: 0, found: -3067, wanted: -2500 }));
}

#[test]
fn the_beams_of_a_maker_meet_before_the_axis() {
    for sensor in Sensor::ALL {
        let Some(before) = sensor.focal_point() else { continue };
        for laser in Calibration::of_maker(sensor).unwrap().lasers {
            // Where the distance is that of the focal point, and where it is none: on the axis.
            let at = |distance| point(&Laser { rotation: 0.0, ..laser }, Offsets::Orthogonal, 0.0, distance);
            let [x, _, z] = at(before / laser.elevation.cos());
            assert!((x - before).abs() < 1e-12 && z.abs() < 1e-12, "{sensor:?}: {x} {z}");
            assert!(at(0.0)[0].abs() < 1e-12);
        }
    }
}
