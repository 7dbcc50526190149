//! Layouts of reflectors, from one format to the other, and what is wrong with them.

use std::path::Path;

use agv_host_sim::layout_file;
use serde_json::Value;

use crate::support::{Files, agv, refusal, text};

/// A drawing in metres as a draughtsman leaves it: a named point, a circle without a name, and a line that is none.
const DRAWING: &str = "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n6\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n\
0\nPOINT\n8\nR\n10\n1.5\n20\n-2.25\n30\n0.0\n0\nTEXT\n8\nR\n10\n1.5\n20\n-2.25\n30\n0.0\n40\n0.2\n1\n17\n\
0\nCIRCLE\n8\nR\n10\n12.0\n20\n3.125\n30\n0.0\n40\n0.04\n0\nLINE\n8\nR\n10\n0.0\n20\n0.0\n30\n0.0\n11\n5.0\n21\n5.0\n31\n0.0\n\
0\nENDSEC\n0\nEOF\n";

fn places(path: &str) -> Vec<(u16, i32, i32)> {
    let layout = layout_file::load(Path::new(path)).unwrap();
    layout.iter().map(|entry| (entry.id, entry.landmark.x.0, entry.landmark.y.0)).collect()
}

fn convert(input: &str, output: &str) {
    let run = agv(&["layout", "convert", input, output]);
    assert!(run.status.success(), "{}", text(&run.stderr));
}

#[test]
fn a_drawing_becomes_a_layout() {
    let files = Files::new();
    let [drawing, imk] = [files.write("hall.dxf", DRAWING.as_bytes()), files.path("hall.imk")];
    convert(&drawing, &imk);
    assert_eq!(places(&imk), [(17, 1500, -2250), (0, 12_000, 3125)]);
    let map = files.path("map.csv");
    let run = agv(&["layout", "convert", &imk, &map, "--map"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let map = std::fs::read_to_string(map).unwrap();
    assert!(map.contains("17,reflector,1.500000,-2.250000,"), "{map}");
}

#[test]
fn a_layout_survives_every_format() {
    let files = Files::new();
    let text: String = (0..60_i32)
        .map(|number| {
            format!("{} {} {} 1 2 80 0\n", number * 3, number * 7919 % 40_011 - 20_000, number * number * 31 % 25_013)
        })
        .collect();
    let first = files.write("first.imk", text.as_bytes());
    let [csv, dxf, last] = ["second.csv", "third.dxf", "last.imk"].map(|name| files.path(name));
    for (input, output) in [(&first, &csv), (&csv, &dxf), (&dxf, &last)] {
        convert(input, output);
        assert_eq!(places(output), places(&first), "{output}");
    }
}

#[test]
fn what_is_no_layout_is_refused() {
    let files = Files::new();
    let output = files.path("out.imk");
    for (name, content) in [
        ("empty.dxf", &b""[..]),
        ("binary.dxf", b"\x1f\x8b\x08\0"),
        ("prose.dxf", b"this is\nno drawing\nat all\n"),
        ("bare.dxf", b"0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n"),
        ("cut.dxf", &DRAWING.as_bytes()[..150]),
        ("words.imk", b"1 2 three 1 2 80 0\n"),
    ] {
        let input = files.write(name, content);
        for arguments in [&["layout", "convert", &input, &output][..], &["layout", "check", &input]] {
            let complaint = refusal(arguments);
            assert!(complaint.contains(name), "{complaint}");
        }
    }
}

#[test]
fn a_check_warns_and_draws() {
    let files = Files::new();
    // Two rows along an aisle, mirror images of each other, and one reflector beside another.
    let mut lines: String = (0..12)
        .flat_map(|number| [(number, 0), (number, 1)])
        .map(|(number, side)| {
            let x = number * 4000 + (number * number * 173) % 1500;
            format!("{} {x} {} 1 2 80 0\n", number * 2 + side, side * 6000)
        })
        .collect();
    lines.push_str("90 200 0 1 2 80 0\n");
    let layout = files.write("aisle.imk", lines.as_bytes());
    let report = files.path("report");
    let run = agv(&["layout", "check", &layout, "--report", &report, "--json"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let check: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(check["close_pairs"][0]["reflectors"], serde_json::json!([0, 24]));
    let mirror = &check["mirrors"][0];
    let axis = mirror["point_m"][1].as_f64().unwrap();
    assert!((axis - 3.0).abs() < 0.01 && mirror["reflectors"] == 24, "{mirror}");
    let page = std::fs::read_to_string(Path::new(&report).join("index.html")).unwrap();
    let expected =
        ["How well the pose is determined", "How many reflectors are visible", "up to 5 mm", "0.20 m apart", "mirror"];
    for expected in expected {
        assert!(page.contains(expected), "{expected}");
    }
    // A square for each place in each picture.
    let places = check["places"].as_u64().unwrap() as usize;
    assert!(page.matches("<rect").count() >= 3 * places, "{}", page.matches("<rect").count());
    // People are warned, too.
    let run = agv(&["layout", "check", &layout]);
    let said = text(&run.stdout);
    assert!(said.contains("0.20 m apart") && said.contains("mirror images"), "{said}");
}

/// Walls of a drawing as a line, a polyline that is closed, and one of a hall that is far away.
#[test]
fn walls_of_a_drawing_are_on_the_plans() {
    let files = Files::new();
    let pair = |code: u16, value: f64| format!("{code}\n{value}\n");
    let mut entities = String::new();
    for number in 0..8 {
        let (x, y) =
            (f64::from(number) * 3000.0, if number % 2 == 0 { 0.0 } else { 5000.0 + 200.0 * f64::from(number) });
        entities += &format!("0\nPOINT\n8\nR\n{}{}", pair(10, x), pair(20, y));
    }
    let line = |x: [f64; 2], y: [f64; 2]| {
        format!("0\nLINE\n8\nW\n{}{}{}{}", pair(10, x[0]), pair(20, y[0]), pair(11, x[1]), pair(21, y[1]))
    };
    let corners = [(-1000.0, -1000.0), (22_000.0, -1000.0), (22_000.0, 8000.0)];
    let corners: String = corners.iter().map(|(x, y)| pair(10, *x) + &pair(20, *y)).collect();
    entities += &line([0.0, 400_000.0], [2500.0, 2500.0]);
    entities += &line([900_000.0, 910_000.0], [0.0, 0.0]);
    entities += &format!("0\nLWPOLYLINE\n100\nAcDbEntity\n8\nW\n100\nAcDbPolyline\n90\n3\n70\n1\n{corners}");
    let drawing = |entities: &str| {
        format!(
            "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1015\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n\
             {entities}0\nENDSEC\n0\nEOF\n"
        )
    };
    let page = |name: &str, entities: &str| {
        let (layout, report) = (files.write(name, drawing(entities).as_bytes()), files.path("report"));
        let run = agv(&["layout", "check", &layout, "--report", &report]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        std::fs::read_to_string(Path::new(&report).join("index.html")).unwrap()
    };
    let with = page("walls.dxf", &entities);
    let points = entities.find("0\nLINE").map_or("", |end| &entities[..end]);
    let without = page("points.dxf", points);
    let lines = |page: &str| page.matches("<polyline").count();
    assert!(with.contains("lines of the drawing") && !without.contains("lines of the drawing"));
    assert!(with.contains("Of 5 lines of the drawing the pictures show the longest 4"));
    // Four lines in each of three pictures.
    assert_eq!(lines(&with) - lines(&without), 12);
}
