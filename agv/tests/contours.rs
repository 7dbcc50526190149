//! A map of contours, and a drive that is localised in it, by the command line.

use agv_core::geometry::Point;
use agv_host_sim::contour_map::{ContourMap, MapPoint};
use agv_host_sim::mapping::contour_file;
use agv_tests::recordings;

use crate::support::{Files, agv, json_keys, refusal, text};

#[test]
fn a_map_of_contours_is_written_and_read() {
    let files = Files::new();
    let path = files.path("contours.csv");
    let points = [
        MapPoint { position: Point::new(-7.25, 12.5), normal: Point::new(0.6, -0.8) },
        MapPoint { position: Point::new(100.0, 0.001), normal: Point::zeros() },
        MapPoint { position: Point::new(3.0, 2.0), normal: Point::new(-1.0, 0.0) },
    ];
    let map = ContourMap::of(points);
    contour_file::write(path.as_ref(), &map).unwrap();
    assert!(contour_file::is_contour_map(path.as_ref()));
    let again = contour_file::read(path.as_ref()).unwrap();
    assert_eq!(again.len(), 3);
    for point in points {
        let found = again
            .points()
            .any(|kept| (kept.position - point.position).norm() < 2e-3 && (kept.normal - point.normal).norm() < 0.02);
        assert!(found, "{point:?}");
    }
}

/// Pages that are programmed before the vehicle is delivered hold the map where the controller finds it.
#[test]
fn a_map_of_contours_is_provisioned_if_it_is_not_too_large() {
    let files = Files::new();
    let (key, flash, image) =
        (files.write("agv.key", super::ctl::KEY.as_bytes()), files.path("flash.bin"), files.path("contours.bin"));
    let provision = |map: &str| {
        ["provision", "--key", &key, "--output", &flash, "--contours", map, "--contours-output", &image, "--json"]
            .map(str::to_owned)
    };
    let wall =
        |points: i32| {
            ContourMap::of((0..points).map(|place| MapPoint {
                position: Point::new(0.1 * f64::from(place), 0.0),
                normal: Point::new(0.0, 1.0),
            }))
        };
    let (small, large) = (files.path("small.csv"), files.path("large.csv"));
    contour_file::write(small.as_ref(), &wall(500)).unwrap();
    contour_file::write(large.as_ref(), &wall(26_000)).unwrap();
    let refused = refusal(&provision(&large).each_ref().map(String::as_str));
    assert!(refused.contains("131040 can be kept"), "{refused}");
    assert!(!std::path::Path::new(&flash).exists(), "nothing was written");
    let made = agv(&provision(&small).each_ref().map(String::as_str));
    assert!(made.status.success(), "{}", text(&made.stderr));
    let mut bytes = std::fs::read(&image).unwrap();
    assert_eq!(bytes.len(), 2 * 128 * 1024);
    let map = ContourMap::of_bytes(bytes.drain(32..32 + wall(500).bytes().len()).collect()).unwrap();
    assert_eq!(map, wall(500));
}

#[test]
fn a_bad_map_of_contours_is_refused_with_its_line() {
    let files = Files::new();
    let log = files.path("drive.agvlog");
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/scenarios/warehouse_hall.toml");
    assert!(agv(&["simulate", scenario, "--output", &log]).status.success());
    for (number, line) in ["1,2", "1,x,3", "inf,2,", "1,2,3,4"].into_iter().enumerate() {
        let map = files.write(&format!("{number}.csv"), format!("x_m,y_m,facing_deg\n0,0,\n{line}\n").as_bytes());
        let refusal = refusal(&["replay", &log, "--map", &map]);
        assert!(refusal.contains(":3:"), "{refusal}");
    }
    assert!(refusal(&["map", &log, "-o", &files.path("m.csv"), "--cell", "0.2"]).contains("contours"));
}

/// What a commissioned vehicle does: it drives among reflectors, and its contours lead it where there are none.
#[test]
fn contours_are_mapped_by_a_vehicle_that_drives_among_reflectors() {
    let files = Files::new();
    let (log, map) = (files.path("drive.agvlog"), files.path("contours.csv"));
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/scenarios/warehouse_hall.toml");
    assert!(agv(&["simulate", scenario, "--output", &log]).status.success());
    let made = agv(&["map", &log, "-o", &map, "--kind", "contours", "--poses", "localiser"]);
    assert!(made.status.success(), "{}", text(&made.stderr));
    let (median, p95, lost) = replayed(&log, &map, &["--landmarks", "none", "--relocalise", "contours"]);
    assert!(median < 0.005 && p95 < 0.01 && lost == 0.0, "{median} m, {p95} m, lost for {lost} s");
}

/// Position, median and 95 %, m, and how long the vehicle was lost, s.
fn replayed(log: &str, map: &str, start: &[&str]) -> (f64, f64, f64) {
    let output = agv(&[&["replay", log, "--map", map, "--json"], start].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let position = &figures["accuracy"]["position_mm"];
    let modes = figures["modes"].as_array().unwrap();
    let lost = modes.iter().filter(|mode| mode["mode"] == "lost").filter_map(|mode| mode["duration_s"].as_f64()).sum();
    (1e-3 * position["median"].as_f64().unwrap(), 1e-3 * position["p95"].as_f64().unwrap(), lost)
}

#[test]
fn a_real_drive_is_localised_in_a_map_of_its_contours() {
    let Some(folder) = recordings("a_real_drive_is_localised_in_a_map_of_its_contours", "scans2d") else { return };
    for name in ["aces", "fhw"] {
        let files = Files::new();
        let (log, map) = (files.path("drive.agvlog"), files.path("contours.csv"));
        let source = folder.join(format!("{name}-corrected.log.gz"));
        assert!(agv(&["import", "carmen", source.to_str().unwrap(), "-o", &log]).status.success());
        let made = agv(&["map", &log, "-o", &map, "--kind", "contours", "--poses", "references", "--json"]);
        assert!(made.status.success(), "{}", text(&made.stderr));
        let summary: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
        assert_eq!(json_keys(&summary), ["bytes", "points"]);
        for start in [["--start", "recorded"], ["--relocalise", "contours"]] {
            let (median, p95, lost) = replayed(&log, &map, &start);
            assert!(
                median < 0.06 && p95 < 0.2 && lost == 0.0,
                "{name}, {start:?}: {median} m, {p95} m, lost for {lost} s"
            );
        }
    }
}
