//! CARMEN logs: fields of view, raw scans, cut files.

use std::f64::consts::PI;
use std::fmt::Write;
use std::io::Write as _;

use agv_host_sim::import::carmen::{self, CarmenLog};
use agv_host_sim::text_file::TextFileError;
use proptest::prelude::*;

use super::support::Ended;
use crate::support::Files;

/// A wall 3 m around, seen by that many beams; a line of odometry before each scan.
fn log(parameters: &str, record: &str, beams: usize, field: f64, scans: usize) -> String {
    let mut text = parameters.to_owned();
    for scan in 0..scans {
        let (x, time) = (0.1 * scan as f64, 10.0 + 0.2 * scan as f64);
        writeln!(text, "ODOM {x:.3} 0 0 0.5 0 0 {time:.2} host {time:.2}").unwrap();
        let ranges: Vec<String> = (0..beams).map(|beam| format!("{}", 3.0 + 0.001 * beam as f64)).collect();
        let step = field / (if beams % 2 == 1 { beams - 1 } else { beams }) as f64;
        let ranges = ranges.join(" ");
        let time = time + 0.05;
        let tail = format!("{time:.2} host {time:.2}");
        match record {
            "FLASER" => writeln!(text, "FLASER {beams} {ranges} {x:.3} 0 0 {x:.3} 0 0 {tail}").unwrap(),
            "ROBOTLASER1" => writeln!(
                text,
                "ROBOTLASER1 0 {:.6} {field:.6} {step:.6} 30 0.1 0 {beams} {ranges} 0 {x:.3} 0 0 {x:.3} 0 0 0 0 0 0 0 {tail}",
                -0.5 * field
            )
            .unwrap(),
            _ => writeln!(text, "RAWLASER1 0 {:.6} {field:.6} {step:.6} 30 0.1 0 {beams} {ranges} 0 {tail}", -0.5 * field).unwrap(),
        }
    }
    text
}

fn read(text: &str, stated: Option<f64>) -> Result<CarmenLog, TextFileError> {
    let files = Files::new();
    carmen::read_with(files.write("drive.log", text.as_bytes()).as_ref(), stated)
}

/// First bearing and step of the last scan, deg.
fn bearings(log: &CarmenLog) -> (f64, f64) {
    let scan = &log.front.scans.last().unwrap().scan;
    (scan.first_bearing.to_degrees(), scan.bearing_step.to_degrees())
}

#[test]
fn a_field_of_view_is_read_stated_or_doubted() {
    let said = read(&log("PARAM pioneer_front_laser_resolution 0.5\n", "FLASER", 541, 1.5 * PI, 3), None).unwrap();
    assert_eq!((bearings(&said), said.account.warnings().len()), ((-135.0, 0.5), 0));
    let silent = read(&log("", "FLASER", 541, 1.5 * PI, 3), None).unwrap();
    assert!(silent.account.warnings()[0].contains("--field-of-view"), "{:?}", silent.account);
    let stated = read(&log("", "FLASER", 541, 1.5 * PI, 3), Some(1.5 * PI)).unwrap();
    assert_eq!((bearings(&stated), stated.account.warnings().len()), ((-135.0, 0.5), 0));
}

#[test]
fn raw_scans_stand_where_the_odometry_was() {
    let found = read(&log("PARAM robot_frontlaser_offset 0.25\n", "RAWLASER1", 361, PI, 5), None).unwrap();
    assert_eq!(found.front.scans.len(), 5);
    let last = found.front.scans.last().unwrap();
    assert!((last.robot.x - 0.4).abs() < 1e-9 && (last.laser.x - 0.65).abs() < 1e-9, "{last:?}");
    assert!(found.account.warnings().is_empty() && found.account.notes().len() == 1, "{:?}", found.account);
    // A log that has both tells each scan once.
    let both = log("", "ROBOTLASER1", 181, PI, 2) + &log("", "RAWLASER1", 181, PI, 1).replace("ODOM", "#");
    let both = read(&both, None).unwrap();
    assert_eq!((both.front.scans.len(), both.account.beside()[0].count), (2, 1));
}

#[test]
fn a_file_that_ends_early_is_read_up_to_there() {
    for record in ["FLASER", "ROBOTLASER1", "RAWLASER1"] {
        let text = log("", record, 180, PI, 4);
        let begin = text[..text.len() - 1].rfind('\n').unwrap() + 1;
        for cut in (begin + 1..text.len() - 1).step_by(7).chain([text.len() - 2, text.len() - 6, text.len() - 12]) {
            let found = read(&text[..cut], None).unwrap_or_else(|error| panic!("{record} {cut}: {error}"));
            // When it was logged does not matter.
            if cut > text.trim_end().rfind(' ').unwrap() + 1 {
                assert_eq!(found.front.scans.len(), 4, "{record} {cut}");
                continue;
            }
            assert_eq!(found.front.scans.len(), 3, "{record} {cut}");
            assert!(found.account.warnings()[0].contains("in the middle of line 8"), "{:?}", found.account);
            assert!(found.defects.is_none(), "{record} {cut}: {}", found.defects);
        }
        // The same bytes in the middle of a file are a bad line.
        let bad = format!("{}\n{}", &text[..begin + 20], "ODOM 1 0 0 0 0 0 99 host 99\n");
        assert!(matches!(read(&bad, None), Err(TextFileError::Line { line: 8, .. })));
    }
    let text = log("", "FLASER", 180, PI, 400);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(text.as_bytes()).unwrap();
    let packed = packed.finish().unwrap();
    let files = Files::new();
    let path = files.write("drive.log.gz", &packed[..packed.len() / 2]);
    let found = carmen::read(path.as_ref()).unwrap();
    assert!((100..300).contains(&found.front.scans.len()) && !found.account.warnings().is_empty());
}

#[test]
fn ranges_that_are_none_are_counted() {
    let text = log("", "FLASER", 180, PI, 4).replacen(" 3.05 ", " nan ", 2).replacen(" 3.07 ", " -1 ", 1);
    let found = read(&text, None).unwrap();
    assert_eq!(found.account.left_out()[0].count, 3);
    assert!(found.front.scans.iter().flat_map(|scan| &scan.scan.ranges).all(|range| *range >= 0.0));
}

#[test]
fn the_command_says_how_it_ended() {
    let files = Files::new();
    let (input, output) =
        (files.write("drive.log", log("", "FLASER", 541, 1.5 * PI, 5).as_bytes()), files.path("o.agvlog"));
    let doubtful = Ended::of(&["import", "auto", &input, "--strict", "-o", &output]);
    assert!(doubtful.code == Some(3) && doubtful.warns("541 beams"), "{doubtful:?}");
    let stated = Ended::of(&["import", "auto", &input, "--strict", "--field-of-view", "270", "-o", &output]);
    assert_eq!((stated.code, stated.count("scans"), stated.warnings().len()), (Some(0), 5, 0), "{stated:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_field_of_view_comes_back(
        degrees in prop::sample::select(vec![90_u32, 100, 120, 180, 190, 240, 270, 300, 360]),
        per_degree in 1_usize..=4,
        record in 0_usize..3,
        is_closed in any::<bool>(),
        is_crlf in any::<bool>(),
    ) {
        let beams = degrees as usize * per_degree + usize::from(is_closed);
        let field = f64::from(degrees).to_radians();
        let resolution = 1.0 / per_degree as f64;
        let parameter = format!("PARAM laser_front_laser_resolution {resolution}\n");
        let record = ["FLASER", "ROBOTLASER1", "RAWLASER1"][record];
        let mut text = log(&parameter, record, beams, field, 3);
        if is_crlf {
            text = text.replace('\n', "\r\n");
        }
        let found = read(&text, None).unwrap();
        let (first, step) = bearings(&found);
        // An odd number of beams measures both ends.
        let steps = (if beams % 2 == 1 { beams - 1 } else { beams }) as f64;
        prop_assert!((step - f64::from(degrees) / steps).abs() < 1e-3 || (step - resolution).abs() < 1e-3, "{step}");
        // Headings are rounded in the file.
        prop_assert!((first + f64::from(degrees) / 2.0).abs() < 0.6, "{first}");
        prop_assert!(found.account.warnings().is_empty(), "{:?}", found.account.warnings());
    }
}
