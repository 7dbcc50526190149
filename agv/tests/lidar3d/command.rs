//! `agv lidar3d` as people run it, and what it says to bad input.

use std::path::{Path, PathBuf};

use agv_core::measurement::Time;
use agv_host_sim::export::velodyne::CaptureWriter;
use agv_host_sim::hdl64e_packets::hdl64e_packets;
use agv_host_sim::simulate::multi_beam::{Sensor, Stand, packets};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_lidar3d::calibration::{Calibration, Laser};
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::LENGTH;
use agv_tests::recordings;
use serde_json::Value;

use crate::support::{Files, agv, json_keys, refusal, text};

const HDL32E: &str = "lidar3d/pcap/monterey-first-100-packets.pcap";
const MANUAL: &str = "lidar3d/pcap/hdl64e_s2_manual_sample_packet.pcap";

fn capture(files: &Files, name: &str, packets: &[[u8; LENGTH]]) -> String {
    let path = files.path(name);
    let mut writer = CaptureWriter::create(Path::new(&path)).unwrap();
    for (number, packet) in packets.iter().enumerate() {
        writer.packet(Time::from_micros(300 * number as u64), packet).unwrap();
    }
    writer.finish().unwrap();
    path
}

/// One and a half turns of an HDL-64E that sees everything at that many counts.
fn turns(count: u16) -> Vec<[u8; LENGTH]> {
    let azimuths: Vec<u16> = (0..540).map(|step| (100 * step % 36_000) as u16).collect();
    hdl64e_packets(&azimuths, |_, _| count)
}

fn calibration(files: &Files, lasers: usize) -> String {
    let laser = |number: usize| Laser { elevation: 0.03 - 0.007 * number as f64, is_enabled: true, ..Laser::default() };
    let calibration = Calibration { distance_resolution: Some(0.002), lasers: (0..lasers).map(laser).collect() };
    files.write(&format!("{lasers}.yaml"), calibration.to_ros_yaml().as_bytes())
}

fn results(arguments: &[&str]) -> Value {
    let output = agv(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn real(name: &str) -> Option<PathBuf> {
    recordings("agv lidar3d", name)
}

#[test]
fn every_command_explains_itself() {
    for command in [
        &["info"][..],
        &["decode"],
        &["convert"],
        &["calibrate"],
        &["view"],
        &["places", "index"],
        &["places", "find"],
        &["places", "evaluate"],
    ] {
        let output = agv(&[&["lidar3d"], command, &["--help"]].concat());
        assert!(output.status.success() && text(&output.stdout).contains("Examples:"), "{command:?}");
    }
}

#[test]
fn captures_that_are_none_are_refused_in_one_line() {
    let files = Files::new();
    let (missing, output) = (files.path("missing.pcap"), files.path("out.pcd"));
    let mut wrong = turns(2000);
    for packet in &mut wrong {
        packet[0] = 0;
    }
    let whole = std::fs::read(capture(&files, "whole.pcap", &turns(2000)[..1])).unwrap();
    let short = files.write("short.pcap", &whole[..whole.len() / 2]);
    for (input, expected) in [
        (missing, "missing.pcap"),
        (files.write("empty.pcap", b""), "no network capture"),
        (
            files.write("text.pcap", b"no capture at all, but a text that is long enough to be one"),
            "no network capture",
        ),
        (capture(&files, "foreign.pcap", &wrong), "block 0 begins with"),
        (short, "none of its 0 packets"),
        (files.write("header.pcap", &whole[..24]), "none of its 0 packets"),
    ] {
        for command in
            [&["info"][..], &["decode", "-o", &output], &["view", "-o", &output], &["places", "index", "-o", &output]]
        {
            let complaint = refusal(&[&["lidar3d"], command, &[&input]].concat());
            assert!(complaint.contains(expected), "{complaint}");
        }
    }
    if let Some(other) = real("can/../nav350") {
        // A folder without range images.
        let complaint = refusal(&["lidar3d", "info", other.to_str().unwrap()]);
        assert!(complaint.contains("velodyne_config.txt"), "{complaint}");
    }
    assert!(!Path::new(&output).exists());
}

#[test]
fn a_packet_that_is_cut_short_is_counted_and_the_others_are_read() {
    let files = Files::new();
    let path = capture(&files, "cut.pcap", &turns(2000));
    let mut bytes = std::fs::read(&path).unwrap();
    bytes.truncate(bytes.len() - 700);
    let cut = files.write("cut.pcap", &bytes);
    let found = results(&["lidar3d", "info", &cut, "--calibration", &calibration(&files, 64), "--json"]);
    assert_eq!((&found["cut"], &found["packets"]), (&Value::Bool(true), &Value::from(89)));
    assert_eq!(found["returns"]["points"], 89 * 384);
    for (arguments, code) in [(&["lidar3d", "info", &cut][..], 0), (&["lidar3d", "info", &cut, "--strict"], 3)] {
        assert_eq!(agv(arguments).status.code(), Some(code));
    }
}

#[test]
fn calibrations_that_do_not_fit_are_refused_in_one_line() {
    let files = Files::new();
    let path = capture(&files, "turns.pcap", &turns(2000));
    let output = files.path("out.pcd");
    for (calibration, expected) in [
        (calibration(&files, 32), "of 32 lasers, the sensor has 64"),
        (files.path("missing.xml"), "there is no such file"),
        (files.write("empty.xml", b" "), "no data"),
        (files.write("foreign.xml", b"<html></html>"), "no calibration file"),
        (files.write("foreign.yaml", b"lasers: 5"), "no calibration file"),
        (files.write("binary.xml", &[0, 1, 200, 255]), "binary data"),
    ] {
        let complaint = refusal(&["lidar3d", "decode", &path, "--calibration", &calibration, "-o", &output]);
        assert!(complaint.contains(expected), "{complaint}");
        let complaint = refusal(&["lidar3d", "calibrate", &path, "--calibration", &calibration, "-o", "out.xml"]);
        assert!(complaint.contains(expected), "{complaint}");
    }
    assert!(refusal(&["lidar3d", "decode", &path, "-o", &output]).contains("--calibration"));
    let nowhere = refusal(&["lidar3d", "decode", &path, "-o", &files.path("out.txt")]);
    assert!(nowhere.contains(".pcd, .ply or .las"), "{nowhere}");
}

#[test]
fn scans_in_which_nothing_is_seen_are_refused_in_one_line() {
    let files = Files::new();
    let calibration = calibration(&files, 64);
    let output = files.path("out");
    for (name, count, expected) in [
        ("empty.pcap", 0, "34560 returns are empty"),
        ("near.pcap", 100, "34560 too near"),
        ("far.pcap", 65_000, "34560 too far"),
    ] {
        let path = capture(&files, name, &turns(count));
        for command in [
            &["decode", "-o", "out.pcd"][..],
            &["view", "-o", "out.png"],
            &["places", "index", "-o", &output],
            &["calibrate", "-o", "out.xml"],
        ] {
            let complaint = refusal(&[&["lidar3d"], command, &[&path, "--calibration", &calibration]].concat());
            assert!(complaint.contains("nothing was seen") && complaint.contains(expected), "{complaint}");
        }
    }
    // All at the same distance: what little looks like a plane does not serve.
    let path = capture(&files, "round.pcap", &turns(2000));
    let complaint = refusal(&["lidar3d", "calibrate", &path, "--calibration", &calibration, "-o", "out.xml"]);
    assert!(complaint.contains("plane") || complaint.contains("no laser has"), "{complaint}");
}

#[test]
fn false_returns_are_counted_and_not_written() {
    let files = Files::new();
    let mut packets = turns(2000);
    packets.extend(turns(100));
    let path = capture(&files, "mixed.pcap", &packets);
    let calibration = calibration(&files, 64);
    let found = results(&["lidar3d", "info", &path, "--calibration", &calibration, "--json"]);
    assert_eq!(found["returns"]["false_near"], found["returns"]["points"]);
    let found =
        results(&["lidar3d", "info", &path, "--calibration", &calibration, "--near", "0.1", "--far", "3", "--json"]);
    assert_eq!(found["returns"]["false_far"], found["returns"]["points"]);
    let keys = json_keys(&found);
    for key in ["sensor", "refused", "calibration_in_stream", "turns_per_s", "empty", "unused"] {
        assert!(keys.iter().any(|found| found == key), "{key}");
    }
}

/// x, y, z of the points of a binary PLY whose point takes 15 bytes.
fn ply_points(path: &str) -> Vec<[f32; 3]> {
    let bytes = std::fs::read(path).unwrap();
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|window| window == end).unwrap() + end.len();
    let (points, rest) = bytes[start..].as_chunks::<15>();
    assert!(rest.is_empty());
    let number = |point: &[u8; 15], at: usize| f32::from_le_bytes(std::array::from_fn(|byte| point[4 * at + byte]));
    points.iter().map(|point| std::array::from_fn(|at| number(point, at))).collect()
}

#[test]
fn the_three_formats_hold_the_same_points() {
    let Some(path) = real(HDL32E) else { return };
    let files = Files::new();
    let decode = |name: &str| {
        let output = files.path(name);
        let path = path.to_str().unwrap();
        let found = results(&["lidar3d", "decode", path, "--first", "2", "--count", "1", "-o", &output, "--json"]);
        assert_eq!(found["files"], 1);
        output
    };
    let ply = ply_points(&decode("scan.ply"));
    assert!((45_000..55_000).contains(&ply.len()), "{}", ply.len());
    let las = las::Reader::from_path(decode("scan.las")).unwrap().read_all().unwrap();
    assert_eq!(las.len(), ply.len());
    for (((x, y), z), b) in las.x().zip(las.y()).zip(las.z()).zip(&ply) {
        let off = [x, y, z].iter().zip(b).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
        assert!(off < 0.6e-4, "{off}");
    }
    let pcd = pcd_rs::DynReader::open(decode("scan.pcd")).unwrap().map(Result::unwrap).collect::<Vec<_>>();
    assert_eq!(pcd.len(), ply.len());
    for (a, b) in pcd.iter().zip(&ply) {
        assert_eq!(a.to_xyz::<f32>().unwrap(), *b);
    }
}

#[test]
fn a_calibration_is_converted_there_and_back() {
    let Some(path) = real("lidar3d/calib/ajaayc_db.xml") else { return };
    let files = Files::new();
    let (yaml, xml) = (files.path("a.yaml"), files.path("a.xml"));
    for (from, to) in [(path.to_str().unwrap(), &yaml), (&yaml, &xml)] {
        assert_eq!(results(&["lidar3d", "convert", from, "-o", to, "--json"])["lasers"], 64);
    }
    let read = |path: &str| Calibration::read(&std::fs::read_to_string(path).unwrap()).unwrap();
    let (first, last) = (read(path.to_str().unwrap()), read(&xml));
    for (a, b) in first.lasers.iter().zip(&last.lasers) {
        assert!((a.elevation - b.elevation).abs() < 1e-15 && (a.distance - b.distance).abs() < 1e-15);
        assert_eq!(a.full.map(|full| full.min_intensity), b.full.map(|full| full.min_intensity));
    }
    if let Some(manual) = real(MANUAL) {
        let complaint = refusal(&["lidar3d", "convert", manual.to_str().unwrap(), "-o", &xml]);
        assert!(complaint.contains("no whole calibration"), "{complaint}");
    }
}

#[test]
fn scans_of_a_wall_calibrate_the_sensor() {
    let files = Files::new();
    let truth = Calibration::read(&std::fs::read_to_string(calibration(&files, 64)).unwrap()).unwrap().lasers;
    let mut random = Random::new(5, Stream::MultiBeam);
    let sensor = Sensor { lasers: &truth, offsets: Offsets::Orthogonal, resolution: 0.002, noise: 0.02 };
    let mut stands = Vec::new();
    for (distance, pitch, roll) in [
        (4.0, 0.0, 3.0),
        (4.0, 20.0, -4.0),
        (9.0, 9.0, 4.0),
        (9.0, 30.0, 0.0),
        (16.0, 4.0, -3.0),
        (16.0, 20.0, 3.0),
        (20.0, 12.0, 0.0),
    ] {
        let (pitch, roll): (f64, f64) = (pitch, roll);
        let stand = Stand { distance, pitch: pitch.to_radians(), roll: roll.to_radians(), heading: 0.1 };
        let name = format!("stand{}.pcap", stands.len());
        stands.push(capture(&files, &name, &packets(sensor, stand, &mut random)));
    }
    let mut start = truth.clone();
    for (number, laser) in start.iter_mut().enumerate() {
        laser.distance += 0.02 * ((number * 7 % 5) as f64 - 2.0) / 2.0;
        laser.rotation += 0.003 * ((number * 3 % 7) as f64 - 3.0) / 3.0;
    }
    let text = Calibration { distance_resolution: Some(0.002), lasers: start }.to_db_xml();
    let start = files.write("start.xml", text.as_bytes());
    let (found, report) = (files.path("found.xml"), files.path("report"));
    let mut arguments =
        vec!["lidar3d", "calibrate", "--calibration", &start, "-o", &found, "--report", &report, "--json"];
    arguments.extend(stands.iter().map(String::as_str));
    let summary = results(&arguments);
    assert_eq!((&summary["stands"], &summary["lasers"]), (&Value::from(7), &Value::from(64)));
    for wall in summary["walls"].as_array().unwrap() {
        assert!(wall["thickness_after_m"].as_f64() < wall["thickness_before_m"].as_f64(), "{wall}");
    }
    let found = Calibration::read(&std::fs::read_to_string(&found).unwrap()).unwrap().lasers;
    for (truth, found) in truth.iter().zip(&found) {
        assert!((truth.distance - found.distance).abs() < 0.004, "{truth:?} {found:?}");
    }
    assert!(std::fs::read_to_string(Path::new(&report).join("index.html")).unwrap().contains("<svg"));
}

#[test]
fn places_of_a_street_are_found_again() {
    const STREET: &str = "lidar3d/moosmann/MuehlburgerTor";
    let Some(folder) = real(STREET) else { return };
    let files = Files::new();
    let map = files.path("street.places3d");
    let (scans, poses) = (folder.join("velodyne_dist"), folder.join("kiss_icp_poses_derived.txt"));
    let (scans, poses) = (scans.to_str().unwrap(), poses.to_str().unwrap());
    let index = ["lidar3d", "places", "index", scans, "--poses", poses, "--shift", "4", "-o", &map, "--json"];
    let found = results(&index);
    assert_eq!(found["scans"], 501);
    assert!((60..80).contains(&found["places"].as_u64().unwrap()), "{found}");
    assert!((1.0..2.5).contains(&found["sensor_height_m"].as_f64().unwrap()), "{found}");
    assert!((0.1..0.9).contains(&found["limit"].as_f64().unwrap()), "{found}");
    let bytes = std::fs::metadata(&map).unwrap().len();
    assert!(bytes < 16_000 * found["places"].as_u64().unwrap(), "{bytes} bytes");
    let truth = std::fs::read_to_string(poses).unwrap();
    let truth: Vec<[f64; 2]> = truth
        .lines()
        .map(|line| {
            let values: Vec<f64> = line.split_whitespace().map(|value| value.parse().unwrap()).collect();
            [values[3], values[7]]
        })
        .collect();
    let find = ["lidar3d", "places", "find", &map, scans, "--every", "7", "--json"];
    let told = |more: &[&str]| {
        let answers = results(&[&find[..], more].concat());
        let (mut off, mut wrong) = (Vec::new(), 0);
        for answer in answers.as_array().unwrap().iter().filter(|answer| answer["answer"] == "found") {
            let [x, y] = truth[answer["scan"].as_u64().unwrap() as usize];
            off.push((answer["x_m"].as_f64().unwrap() - x).hypot(answer["y_m"].as_f64().unwrap() - y));
            wrong += usize::from(off.last().is_some_and(|off| *off > 1.0));
        }
        (off, wrong)
    };
    let (mut off, wrong) = told(&[]);
    // Those of the way tell no less.
    let (together, wrong_together) = told(&["--sequence", "2"]);
    assert!(
        together.len() >= off.len() && wrong_together <= wrong,
        "{} {} {wrong_together}",
        off.len(),
        together.len()
    );
    off.sort_by(f64::total_cmp);
    assert!(off.len() > 60 && wrong == 0 && off[off.len() / 2] < 0.1, "{off:?}");
    // Aligned to the stored scans they are where the other program puts them, although places are 4 m apart.
    let refined = results(&[
        "lidar3d", "places", "find", &map, scans, "--method", "enriched", "--every", "25", "--refine", scans, "--json",
    ]);
    let mut errors: Vec<f64> = Vec::new();
    for answer in refined.as_array().unwrap().iter().filter(|answer| !answer["deviation_m"].is_null()) {
        let [x, y] = truth[answer["scan"].as_u64().unwrap() as usize];
        errors.push((answer["x_m"].as_f64().unwrap() - x).hypot(answer["y_m"].as_f64().unwrap() - y));
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors.len() > 10 && errors[errors.len() / 2] < 0.05 && errors[errors.len() - 1] < 0.5, "{errors:?}");
    let complaint = refusal(&["lidar3d", "places", "find", poses, scans]);
    assert!(complaint.contains("no file of places"), "{complaint}");
    for version in [b"AGVP3D\x01\nwhatever", b"AGVP3D\x02\nwhatever"] {
        let older = files.write("older.places3d", version);
        let complaint = refusal(&["lidar3d", "places", "find", &older, scans]);
        assert!(complaint.contains("index them again"), "{complaint}");
    }
    let complaint = refusal(&["lidar3d", "places", "find", &map, scans, "--method", "aligned", "--check"]);
    assert!(complaint.contains("methods that compare signatures"), "{complaint}");
    let complaint = refusal(&["lidar3d", "places", "index", scans, "--height", "-1", "-o", &map]);
    assert!(complaint.contains("--height"), "{complaint}");
    let short = files.write("short.txt", b"1 0 0 0 0 1 0 0 0 0 1 0\n");
    let index = ["lidar3d", "places", "index", scans, "--poses", &short, "-o", &map];
    assert!(refusal(&index).contains("fewer than there are scans"));
    let words = files.write("words.txt", b"these are no poses\n");
    let index = ["lidar3d", "places", "index", scans, "--poses", &words, "-o", &map];
    assert!(refusal(&index).contains("words.txt:1"));
}

#[test]
fn the_place_found_starts_the_localiser() {
    const STREET: &str = "lidar3d/moosmann/MuehlburgerTor";
    let Some(folder) = real(STREET) else { return };
    let files = Files::new();
    let (map, log) = (files.path("street.places3d"), files.path("drive.agvlog"));
    let (scans, poses) = (folder.join("velodyne_dist"), folder.join("kiss_icp_poses_derived.txt"));
    let (scans, poses) = (scans.to_str().unwrap(), poses.to_str().unwrap());
    results(&["lidar3d", "places", "index", scans, "--poses", poses, "--shift", "4", "-o", &map, "--json"]);
    // A drive that does not say where it begins.
    let carmen: String =
        (0..5).map(|step| format!("FLASER 2 5.0 5.0 {0} 0 0 {0} 0 0 {0} host {0}\n", f64::from(step))).collect();
    let carmen = files.write("drive.log", carmen.as_bytes());
    assert!(agv(&["import", "carmen", &carmen, "-o", &log]).status.success());
    assert_eq!(results(&["replay", &log, "--json"])["poses"], 0);
    let wanted = ["--relocalise", "lidar3d", "--places", &map, "--scans", scans];
    assert!(results(&[&["replay", &log, "--json"], &wanted[..]].concat())["poses"].as_u64() > Some(0));
    // A map of places without poses cannot say where.
    let without = files.path("without.places3d");
    results(&["lidar3d", "places", "index", scans, "-o", &without, "--json"]);
    let complaint = refusal(&["replay", &log, "--relocalise", "lidar3d", "--places", &without, "--scans", scans]);
    assert!(complaint.contains("have no poses"), "{complaint}");
}

#[test]
fn a_live_sensor_is_decoded_like_its_capture() {
    let files = Files::new();
    let packets = turns(2000);
    let calibration = calibration(&files, 64);
    let port = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let output = files.path("live.ply");
    let source = format!("udp:{port}");
    let arguments =
        ["lidar3d", "decode", &source, "--calibration", &calibration, "--count", "1", "--parts", "-o", &output];
    let arguments = arguments.map(str::to_owned);
    let running = std::thread::spawn(move || agv(&arguments.iter().map(String::as_str).collect::<Vec<_>>()));
    let socket = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    // Until the command has seen enough; it may begin to listen at any time.
    while !running.is_finished() {
        for packet in &packets {
            let _ = socket.send_to(packet, ("127.0.0.1", port));
        }
        std::thread::yield_now();
    }
    let ended = running.join().unwrap();
    assert!(ended.status.success(), "{}", text(&ended.stderr));
    for [x, y, z] in ply_points(&output) {
        assert!(((x * x + y * y + z * z).sqrt() - 4.0).abs() < 1e-4);
    }
    let busy = std::net::UdpSocket::bind("0.0.0.0:0").unwrap();
    let source = format!("udp:{}", busy.local_addr().unwrap().port());
    assert!(refusal(&["lidar3d", "info", &source]).contains("UDP port"));
}
