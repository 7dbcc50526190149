//! The inputs that people's programs left, where they are: each gives the right values, or one of the stated errors.

use std::path::{Path, PathBuf};

use agv_tests::recordings;
use nalgebra::{Matrix3, Matrix3x4};

use super::support::Ended;
use crate::support::{Files, agv};

/// What is expected of an input.
enum Expected {
    /// A drive with so many samples of the odometry and scans, and so long a way, m; and what a warning says, if there is one.
    Drive(u64, u64, f64, &'static str),
    /// A refusal that says this.
    Refused(&'static str),
}
use Expected::{Drive, Refused};

/// Input, options, and what is expected.
type Case = (&'static str, &'static [&'static str], Expected);

const DRIVES: [Case; 23] = [
    ("can_bootup/bootup.log", &[], Drive(599, 0, 2.99, "")),
    ("can_bootup/plain.log", &[], Drive(599, 0, 2.99, "")),
    ("can_clock_back/back.log", &[], Drive(599, 0, 2.99, "set back by 17999")),
    ("can_delta/delta_L.log", &[], Drive(199, 0, 0.99, "")),
    ("can_delta/delta_screen.log", &[], Drive(199, 0, 0.99, "")),
    ("can_small/bom.log", &[], Drive(49, 0, 0.24, "")),
    ("can_small/cut_last_line.log", &[], Drive(49, 0, 0.24, "in the middle of line 100")),
    ("can_small/raw_dlc.log", &[], Drive(49, 0, 0.24, "")),
    ("can_small/screen_e.log", &[], Drive(49, 0, 0.24, "")),
    ("can_small/screen_x.log", &[], Drive(49, 0, 0.24, "")),
    ("can_small/two_buses.log", &[], Refused("choose one of can0, can1 with --interface")),
    ("can_small/two_buses.log", &["--interface", "can0"], Drive(299, 0, 1.49, "")),
    ("carmen_fov/fov270.log", &[], Drive(19, 19, 0.95, "")),
    ("ros2/good", &[], Drive(130, 65, 1.69, "")),
    ("ros2/increment_0", &[], Drive(130, 65, 1.69, "angle between beams is zero")),
    ("ros2/initialpose_covariance_nan", &[], Drive(130, 65, 1.69, "no covariance")),
    ("ros2/message_compression", &[], Drive(40, 20, 0.52, "")),
    ("ros2/no_metadata", &[], Drive(130, 65, 1.69, "")),
    ("ros2/one_stamp_of_minus_1_s", &[], Drive(130, 65, 1.69, "the stamps of 1 of the 65 messages of /scan")),
    ("ros2/scan_stamps_since_boot", &[], Drive(130, 65, 1.69, "another clock")),
    ("ros2/time_starts_again", &[], Drive(130, 66, 1.71, "a second run")),
    ("ros2/twist_only", &[], Drive(130, 65, 1.69, "")),
    ("ros2/ros1_encoding.mcap", &[], Refused("encoded as ros1")),
];

fn check(ended: &Ended, expected: &Expected, case: &str) {
    match expected {
        Drive(odometry, scans, way, warning) => {
            assert_eq!(ended.code, Some(0), "{case}: {ended:?}");
            assert_eq!((ended.count("odometry"), ended.count("scans")), (*odometry, *scans), "{case}: {ended:?}");
            assert!((ended.number("distance_m") - way).abs() < 0.02, "{case}: {ended:?}");
            if warning.is_empty() {
                assert!(ended.warnings().is_empty(), "{case}: {ended:?}");
            } else {
                assert!(ended.warns(warning), "{case}: {ended:?}");
            }
        }
        Refused(words) => assert!(ended.code == Some(1) && ended.complaint.contains(words), "{case}: {ended:?}"),
    }
}

#[test]
fn drives_of_the_corpus_are_right_or_refused() {
    let Some(folder) = recordings("drives_of_the_corpus_are_right_or_refused", "reports") else { return };
    let files = Files::new();
    let (like, output) = (files.path("like.agvlog"), files.path("o.agvlog"));
    assert!(agv(&["simulate", "block_storage_p1", "-o", &like]).status.success());
    for (name, options, expected) in &DRIVES {
        let input = folder.join(name);
        let input = input.to_str().unwrap();
        let like = if name.starts_with("can") { &["--like", &like][..] } else { &[] };
        let ended = Ended::of(&[&["import", "auto", input, "-o", &output], like, options].concat());
        check(&ended, expected, name);
    }
    let input = folder.join("ros2/upside_down_tilted_7_deg");
    let hung = ["import", "auto", input.to_str().unwrap(), "--laser", "0.3,0,0", "-o", &output];
    check(&Ended::of(&hung), &Drive(130, 65, 1.69, "tilted by 7 deg"), "upside down");
}

#[test]
fn drawings_of_the_corpus_are_right_or_refused() {
    let Some(folder) = recordings("drawings_of_the_corpus_are_right_or_refused", "reports/dxf") else { return };
    let files = Files::new();
    let output = files.path("o.imk");
    for (name, options, first, warns) in [
        ("ansi1252", &[][..], Some((14_700, -4200)), false),
        ("attrib", &[], Some((14_700, -4200)), false),
        ("binary", &[], Some((14_700, -4200)), false),
        ("extrusion", &[], Some((14_700, -4200)), false),
        // The hall is put at (1000, 2000) mm.
        ("nested", &[], Some((15_700, -2200)), false),
        ("paperspace", &[], Some((14_700, -4200)), false),
        ("unitless_metres", &[], Some((14_700, -4200)), true),
        ("utm", &[], None, false),
        ("utm", &["--origin", "691000,5334000"], Some((14_700, -4200)), false),
    ] {
        let input = folder.join(name).with_extension("dxf");
        let ended = Ended::of(&[&["layout", "convert", input.to_str().unwrap(), &output], options].concat());
        let Some(first) = first else {
            assert!(ended.code == Some(1) && ended.complaint.contains("--origin"), "{name}: {ended:?}");
            continue;
        };
        assert_eq!((ended.code, ended.count("landmarks")), (Some(0), 6), "{name}: {ended:?}");
        assert_eq!(!ended.warnings().is_empty(), warns, "{name}: {ended:?}");
        let layout = agv_host_sim::layout_file::load(output.as_ref()).unwrap();
        assert_eq!((layout[0].landmark.x.0, layout[0].landmark.y.0), first, "{name}");
    }
}

/// x, y, z and intensity of the points of a cloud that was written as text or binary.
fn points(path: &Path) -> Vec<(f64, f64, f64, u16)> {
    use pcd_rs::{DynReader, Field};
    let reader = DynReader::open(path).unwrap();
    let number = |field: &Field| match field {
        Field::F32(values) => f64::from(values[0]),
        Field::U16(values) => f64::from(values[0]),
        other => panic!("{other:?}"),
    };
    reader
        .map(|record| {
            let record = record.unwrap();
            let [x, y, z, intensity] = [0, 1, 2, 3].map(|place| number(&record.0[place]));
            (x, y, z, intensity as u16)
        })
        .collect()
}

#[test]
fn clouds_of_the_corpus_are_right_or_refused() {
    let Some(folder) = recordings("clouds_of_the_corpus_are_right_or_refused", "reports/clouds") else { return };
    for name in ["cc.ply", "kitti.bin", "nuscenes.pcd.bin", "pad.pcd", "pad0.pcd", "utm.las", "livox/livox.mcap"] {
        let files = Files::new();
        let output = files.path("o.pcd");
        let input = folder.join(name);
        let ended = Ended::of(&["lidar3d", "decode", input.to_str().unwrap(), "--output", &output, "--count", "1"]);
        assert_eq!(ended.code, Some(0), "{name}: {ended:?}");
        assert_eq!(ended.warnings().len(), usize::from(name == "utm.las"), "{name}: {ended:?}");
        let points = points(Path::new(&output));
        assert_eq!(points.len(), 5760, "{name}");
        // A box of 20 x 16 m, whose floor is 1.5 m below.
        let is_on = |(x, y, z, _): &(f64, f64, f64, u16)| {
            (x.abs() - 10.0).abs() < 0.02 || (y.abs() - 8.0).abs() < 0.02 || (z + 1.5).abs() < 0.02
        };
        assert!(points.iter().all(is_on), "{name}");
        assert!(points.iter().map(|point| point.3).max().unwrap() > 90, "{name}");
    }
    let input: PathBuf = folder.join("stub.laz");
    let refused = Ended::of(&["lidar3d", "decode", input.to_str().unwrap(), "--output", "/dev/null/o.pcd"]);
    assert!(refused.code == Some(1) && refused.complaint.contains("laszip"), "{refused:?}");
}

#[test]
fn captures_of_the_corpus_are_right() {
    let Some(folder) = recordings("captures_of_the_corpus_are_right", "reports") else { return };
    let info = |name: &str, options: &[&str]| {
        let input = folder.join(name);
        Ended::of(&[&["lidar3d", "info", input.to_str().unwrap()], options].concat())
    };
    let two = info("velodyne_two_senders/two_senders_400.pcap", &[]);
    assert!(two.count("packets") == 200 && two.warns("--address"), "{two:?}");
    assert!((5.0..20.0).contains(&two.number("turns_per_s")), "{two:?}");
    let other = info("velodyne_two_senders/two_senders_400.pcap", &["--address", "192.0.2.202"]);
    assert_eq!((other.count("packets"), &other.summary["address"]), (200, &"192.0.2.202".into()), "{other:?}");
    let metadata = folder.join("../lidar3d/packets/ouster/OS-1-32-G_v2.1.1_1024x10.json");
    let whole = info("ouster_fragments/frag_16_datagrams.pcap", &["--calibration", metadata.to_str().unwrap()]);
    assert!(whole.count("packets") == 16 && whole.warnings().is_empty(), "{whole:?}");
}

/// From axes of a lidar (x ahead, y left, z up) to those of a camera (x right, y down, z ahead).
const CAMERA: [[f64; 3]; 3] = [[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]];

/// A pose of twelve numbers in axes of a camera.
fn of_camera(line: &str) -> String {
    let numbers: Vec<f64> = line.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let (axes, pose) = (Matrix3::from(CAMERA).transpose(), Matrix3x4::from_row_slice(&numbers));
    let (rotation, place) = (axes * pose.fixed_columns::<3>(0) * axes.transpose(), axes * pose.column(3));
    let row = |row: usize| {
        let [first, second, third] = [0, 1, 2].map(|column| rotation[(row, column)]);
        format!("{first:.6} {second:.6} {third:.6} {:.6}", place[row])
    };
    [0, 1, 2].map(row).join(" ")
}

#[test]
fn poses_of_a_camera_give_the_places_of_the_lidar() {
    let Some(folder) = recordings("poses_of_a_camera_give_the_places_of_the_lidar", "lidar3d/moosmann/MuehlburgerTor")
    else {
        return;
    };
    let (files, scans) = (Files::new(), folder.join("velodyne_dist"));
    let poses = std::fs::read_to_string(folder.join("kiss_icp_poses_derived.txt")).unwrap();
    let of_camera: Vec<String> = poses.lines().map(of_camera).collect();
    for (name, text) in [("lidar", poses.as_str()), ("camera", of_camera.join("\n").as_str())] {
        let (poses, store) = (files.write(name, text.as_bytes()), files.path("store"));
        let scans = scans.to_str().unwrap();
        let index = ["lidar3d", "places", "index", scans, "--poses", &poses, "--shift", "4", "-o", &store, "--json"];
        let run = agv(&index);
        let told: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        assert_eq!((&told["scans"], &told["places"]), (&501.into(), &68.into()), "{name}: {told}");
    }
}
