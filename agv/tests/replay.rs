//! A replay repeats what was said, a map has the landmarks where they are, and the commands that make both say so.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use crate::support::{Files, agv, json_keys, refusal, text};
use agv_core::geometry::Pose;
use agv_core::maps::LandmarkKind;
use agv_core::record::{DamageReason, Output};
use agv_host_sim::log;
use agv_host_sim::mapping::map_file;
use agv_host_sim::recording::{RecordedEvent, RecordedOutput, Recording};
use agv_host_sim::replay::{Replay, compare, replay};
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::scenario::{
    PathKind, PathOptions, PoseOptions, RectangleOptions, ReflectorShape, Scenario, Shapes, StartOptions, WorldOptions,
};
use agv_host_sim::simulate::simulate;

/// Boxes in a hall: centre, length and width, m.
const BOXES: [[f64; 4]; 4] =
    [[3.0, 3.0, 1.2, 1.0], [0.0, 3.5, 1.0, 1.4], [3.5, -3.0, 1.6, 0.8], [-1.0, -3.0, 1.0, 1.0]];

/// Reflectors in the hall, m.
const REFLECTORS: [[f64; 2]; 5] = [[-4.9, 1.0], [5.9, 0.5], [1.5, 5.9], [1.0, -5.9], [-4.9, -4.0]];

/// A short drive among boxes and reflectors.
fn scenario() -> Scenario {
    Scenario {
        seed: 11,
        world: WorldOptions::Shapes(Shapes {
            walls: Shapes::hall([-5.0, -6.0], [6.0, 6.0]),
            rectangles: BOXES
                .map(|[x, y, length, width]| RectangleOptions { x, y, heading_deg: 0.0, length, width })
                .to_vec(),
            reflectors: REFLECTORS
                .map(|[x, y]| ReflectorShape {
                    x,
                    y,
                    radius: 0.04,
                    farthest: 30.0,
                    facing_deg: None,
                    half_width_deg: 60.0,
                })
                .to_vec(),
            ..Shapes::default()
        }),
        path: PathOptions {
            kind: PathKind::Legs,
            start: PoseOptions { x: -3.0, y: 0.0, heading_deg: 0.0 },
            legs: vec![Leg {
                direction: Direction::Forward,
                segments: vec![PathSegment::straight(3.0), PathSegment::arc(2.5, -0.4)],
            }],
        },
        ..Scenario::default()
    }
}

fn drive() -> Recording {
    simulate(&scenario()).unwrap().recording
}

/// The outputs as a log holds them.
fn outputs(replay: &Replay) -> Vec<RecordedOutput> {
    let output = |event| {
        let Output { pose, uses } = replay.output(event).unwrap();
        RecordedOutput { event, pose, uses: uses.to_vec() }
    };
    (0..replay.poses.len()).map(output).collect()
}

fn json(bytes: &[u8]) -> serde_json::Value {
    serde_json::from_slice(bytes).unwrap()
}

#[test]
fn a_replay_of_a_replay_is_equal_bit_for_bit() {
    let files = Files::new();
    let (first, second) = (files.path("first.agvlog"), files.path("second.agvlog"));
    let recording = drive();
    let once = replay(&recording, |_| {}).unwrap();
    assert!(once.uses.len() > 100, "only {} observations", once.uses.len());
    log::write_with_outputs(Path::new(&first), &recording, |event| once.output(event)).unwrap();
    let contents = log::read_contents(Path::new(&first), |_| {}).unwrap();
    assert_eq!(contents.recording, recording);
    assert_eq!(contents.outputs, outputs(&once));
    let twice = replay(&contents.recording, |_| {}).unwrap();
    let comparison = compare(&contents.outputs, &twice);
    assert_eq!((comparison.compared, comparison.first_difference), (recording.events.len(), None));
    log::write_with_outputs(Path::new(&second), &contents.recording, |event| twice.output(event)).unwrap();
    assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(), "the logs differ");
}

#[test]
fn a_single_changed_bit_of_an_output_is_found() {
    let recording = drive();
    let replay = replay(&recording, |_| {}).unwrap();
    let good = outputs(&replay);
    let middle = good.len() / 2;
    let seen = good.iter().position(|output| !output.uses.is_empty()).unwrap();
    let next = |value: f64| f64::from_bits(value.to_bits() ^ 1);
    let assert_found = |event: usize, change: &dyn Fn(&mut RecordedOutput)| {
        let mut bad = good.clone();
        change(&mut bad[event]);
        assert_eq!(compare(&bad, &replay).first_difference, Some(event));
    };
    assert_found(middle, &|output| output.pose.pose.x = next(output.pose.pose.x));
    assert_found(middle, &|output| output.pose.covariance[4] = f64::NAN);
    assert_found(seen, &|output| output.uses[0].residual[0] = next(output.uses[0].residual[0]));
    assert_found(seen, &|output| output.uses.truncate(output.uses.len() - 1));
}

#[test]
fn the_command_says_whether_outputs_are_equal() {
    let files = Files::new();
    let [log, answered, again, changed] = ["a", "b", "c", "d"].map(|name| files.path(&format!("{name}.agvlog")));
    log::write(Path::new(&log), &drive()).unwrap();
    let first = agv(&["replay", &log, "--output", &answered]);
    assert!(first.status.success(), "{}", text(&first.stderr));
    assert!(!text(&first.stdout).contains("recorded ones"), "there is nothing to compare with");
    let second = agv(&["replay", &answered, "--output", &again]);
    assert!(text(&second.stdout).contains("recorded ones, bit for bit"), "{}", text(&second.stdout));
    assert!(std::fs::read(&answered).unwrap() == std::fs::read(&again).unwrap(), "the logs differ");

    let mut contents = log::read_contents(Path::new(&answered), |_| {}).unwrap();
    contents.outputs[7].pose.pose.y += 1e-9;
    let recorded = &contents.outputs;
    log::write_with_outputs(Path::new(&changed), &contents.recording, |event| Some(recorded[event].view())).unwrap();
    let third = agv(&["replay", &changed]);
    assert!(third.status.success());
    assert!(text(&third.stdout).contains("first at event 7"), "{}", text(&third.stdout));
    assert!(refusal(&["replay", &log, "--output", &log]).contains("would replace the log"));
}

#[test]
fn the_figures_have_the_stated_keys_and_fit_the_drive() {
    let files = Files::new();
    let log = files.path("drive.agvlog");
    let recording = drive();
    log::write(Path::new(&log), &recording).unwrap();
    let run = agv(&["replay", &log, "--json"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let figures = json(&run.stdout);
    let help = agv(&["replay", "--help"]);
    let stated = text(&help.stdout).split("Keys of --json:").nth(1).unwrap();
    for key in json_keys(&figures) {
        let is_stated = stated.split(|letter: char| !letter.is_alphanumeric() && letter != '_').any(|word| word == key);
        // Spread has its own three keys everywhere.
        assert!(is_stated || ["median", "p95", "max"].contains(&key.as_str()), "{key} is not in the help");
    }
    let number = |path: &str| figures.pointer(path).and_then(serde_json::Value::as_f64).unwrap();
    let (first, last) = (recording.truth.first().unwrap().time, recording.truth.last().unwrap().time);
    assert!((number("/duration_s") - last.since(first)).abs() < 0.3);
    assert!((number("/way_m") - 4.0).abs() < 0.1, "{}", number("/way_m"));
    assert_eq!(number("/events"), recording.events.len() as f64);
    assert!(number("/accuracy/position_mm/max") < 100.0 && number("/accuracy/position_mm/max") > 0.0);
    let modes = figures["modes"].as_array().unwrap();
    let total: f64 = modes.iter().map(|mode| mode["duration_s"].as_f64().unwrap()).sum();
    assert!((total - number("/duration_s")).abs() < 0.2, "{total} s in modes");
    assert!(figures["outputs"].is_null() && figures["damage"].as_array().unwrap().is_empty());

    let unknown = Recording { truth: Vec::new(), ..recording };
    log::write(Path::new(&log), &unknown).unwrap();
    assert!(json(&agv(&["replay", &log, "--json"]).stdout)["accuracy"].is_null());
}

#[test]
fn the_errors_of_a_replay_are_those_of_its_truth() {
    // The whole truth is shifted by 30 cm: so are all errors, from which the noise of millimetres takes little away.
    let files = Files::new();
    let log = files.path("drive.agvlog");
    let mut recording = drive();
    for truth in &mut recording.truth {
        truth.pose.x += 0.18;
        truth.pose.y -= 0.24;
    }
    log::write(Path::new(&log), &recording).unwrap();
    let figures = json(&agv(&["replay", &log, "--json"]).stdout);
    for key in ["median", "p95", "max"] {
        let error = figures["accuracy"]["position_mm"][key].as_f64().unwrap();
        assert!((error - 300.0).abs() < 40.0, "{key}: {error} mm");
    }
    assert_eq!(figures["accuracy"]["ok_share"], 0.0);
}

#[test]
fn a_log_without_a_pose_can_be_given_one() {
    let files = Files::new();
    let log = files.path("drive.agvlog");
    let mut recording = drive();
    recording.events.retain(|event| !matches!(event, agv_host_sim::recording::RecordedEvent::SetPose(_)));
    log::write(Path::new(&log), &recording).unwrap();
    let without = agv(&["replay", &log]);
    assert!(text(&without.stdout).contains("--start"), "{}", text(&without.stdout));
    // The drive begins at (-3, 0), and ends where nobody has been told.
    for start in ["-2.9,0.1,1.5", "recorded"] {
        let run = agv(&["replay", &log, "--json", &format!("--start={start}")]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        let end = json(&run.stdout)["accuracy"]["position_end_mm"].as_f64().unwrap();
        assert!(end < 20.0, "{start}: {end} mm");
    }
    for bad in ["1,2", "a,b,c", "1,2,inf", ""] {
        assert_eq!(agv(&["replay", &log, &format!("--start={bad}")]).status.code(), Some(2), "{bad}");
    }
    recording.truth.clear();
    log::write(Path::new(&log), &recording).unwrap();
    assert!(refusal(&["replay", &log, "--start", "recorded"]).contains("no pose with a heading"));
}

#[test]
fn a_vehicle_that_is_told_nonsense_finds_itself() {
    let files = Files::new();
    let [log, empty] = ["nonsense", "empty"].map(|name| files.path(&format!("{name}.agvlog")));
    let mut recording = drive();
    for event in &mut recording.events {
        if let RecordedEvent::SetPose(fix) = event {
            fix.pose = Pose::new(2.0, 4.0, 2.5);
        }
    }
    log::write(Path::new(&log), &recording).unwrap();
    let figures = json(&agv(&["replay", &log, "--relocalise", "reflectors", "--json"]).stdout);
    let worst = figures["accuracy"]["position_mm"]["max"].as_f64().unwrap();
    assert!(worst < 50.0, "{figures}");
    recording.landmarks.clear();
    log::write(Path::new(&empty), &recording).unwrap();
    let refused = refusal(&["replay", &empty, "--relocalise", "reflectors"]);
    assert!(refused.contains("the map has no reflectors"), "{refused}");
}

#[test]
fn a_cut_log_replays_up_to_the_cut() {
    let files = Files::new();
    let whole = files.path("whole.agvlog");
    let recording = drive();
    log::write(Path::new(&whole), &recording).unwrap();
    let bytes = std::fs::read(&whole).unwrap();
    let cut = files.write("cut.agvlog", &bytes[..bytes.len() * 6 / 10]);
    let contents = log::read_contents(Path::new(&cut), |_| {}).unwrap();
    assert_eq!(contents.damages.len(), 1);
    assert_eq!(contents.damages[0].reason, DamageReason::Cut);
    let events = contents.recording.events.len();
    assert!(events > 100 && events < recording.events.len());
    let (part, all) = (replay(&contents.recording, |_| {}).unwrap(), replay(&recording, |_| {}).unwrap());
    assert_eq!(part.poses[..], all.poses[..events]);

    let run = agv(&["replay", &cut, "--json"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let figures = json(&run.stdout);
    assert_eq!(figures["events"], events);
    assert_eq!(figures["damage"].as_array().unwrap().len(), 1);
    let table = agv(&["replay", &cut]);
    assert!(text(&table.stdout).lines().any(|line| line.starts_with("damage ")), "{}", text(&table.stdout));
}

#[test]
fn a_log_without_its_beginning_replays_with_the_vehicle_of_another() {
    let files = Files::new();
    let [whole, like, mended] = ["whole", "like", "mended"].map(|name| files.path(&format!("{name}.agvlog")));
    let recording = drive();
    let answers = replay(&recording, |_| {}).unwrap();
    // As a vehicle logs it: nobody knows the truth.
    let logged = Recording { truth: Vec::new(), ..recording.clone() };
    log::write_with_outputs(Path::new(&whole), &logged, |event| answers.output(event)).unwrap();
    // Another drive of the same vehicle in the same hall.
    log::write(Path::new(&like), &Recording { events: Vec::new(), ..logged.clone() }).unwrap();
    let bytes = std::fs::read(&whole).unwrap();
    // In the middle of a record.
    let tail = files.write("tail.agvlog", &bytes[bytes.len() / 3..]);
    for arguments in [&["replay", &tail][..], &["report", &tail], &["check", &tail]] {
        let complaint = refusal(arguments);
        assert!(complaint.contains("part of a log") && complaint.contains("--like LOG"), "{complaint}");
    }
    let run = agv(&["replay", &tail, "--like", &like, "--start", "recorded", "--output", &mended, "--json"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let figures = json(&run.stdout);
    let events = figures["events"].as_u64().unwrap() as usize - 1;
    assert!(events > 100 && events < recording.events.len() * 2 / 3 + 10, "{events}");
    // What went before is not known, so the same bits cannot be expected, and none are claimed.
    assert!(figures["outputs"].is_null() && figures["published"].is_null(), "{figures}");
    let contents = log::read_contents(Path::new(&mended), |_| {}).unwrap();
    assert_eq!(contents.recording.parameters, recording.parameters);
    assert_eq!(contents.recording.landmarks, recording.landmarks);
    let is_told = |event: &&RecordedEvent| !matches!(event, RecordedEvent::SetPose(_));
    let kept: Vec<_> = contents.recording.events.iter().filter(is_told).collect();
    assert_eq!(kept, recording.events[recording.events.len() - events..].iter().collect::<Vec<_>>());
    // It ends where the vehicle was.
    let end = contents.outputs.last().unwrap().pose.pose;
    let truth = recording.truth.last().unwrap().pose;
    assert!((end.position() - truth.position()).norm() < 0.02, "{end:?} {truth:?}");

    assert!(refusal(&["replay", &whole, "--like", &like]).contains("a header of its own"));
    assert!(refusal(&["replay", &tail, "--like", &tail]).contains("part of a log"));
    // The first landmarks are still in this part, and they are not those of another hall.
    let map = log::read(Path::new(&like)).unwrap().0.landmarks;
    assert!(!map.is_empty());
    let landmarks = files.write("landmarks.agvlog", &bytes[20..]);
    assert!(agv(&["replay", &landmarks, "--like", &like]).status.success());
    let other = files.path("other.agvlog");
    let moved: Vec<_> =
        map.iter().map(|landmark| agv_core::maps::Landmark { x: landmark.x + 1.0, ..*landmark }).collect();
    log::write(Path::new(&other), &Recording { landmarks: moved, events: Vec::new(), ..logged }).unwrap();
    assert!(refusal(&["replay", &landmarks, "--like", &other]).contains("another map"));
}

#[test]
fn a_report_is_one_page_with_pictures() {
    let files = Files::new();
    let log = files.path("drive.agvlog");
    let recording = drive();
    let pictures = |recording: &Recording, folder: &str| {
        log::write(Path::new(&log), recording).unwrap();
        let folder = files.path(folder);
        let run = agv(&["replay", &log, "--report", &folder]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        assert!(text(&run.stdout).contains(&format!("{folder}/index.html")));
        let page = std::fs::read_to_string(format!("{folder}/index.html")).unwrap();
        assert!(page.contains("association.gate") && page.contains(log::SOFTWARE));
        (page.matches("<figure>").count(), page.contains("Errors over the way"))
    };
    let (with_truth, has_errors) = pictures(&recording, "truth");
    let (without, still_has_errors) = pictures(&Recording { truth: Vec::new(), ..recording }, "none/at/all");
    assert!(has_errors && !still_has_errors);
    assert_eq!(with_truth, without + 2);
    assert!(without >= 6, "{without} pictures");
}

/// Distance of a point from the nearest of the corners of the boxes, m.
fn distance_to_corner(x: f64, y: f64) -> f64 {
    let corners = BOXES.iter().flat_map(|[cx, cy, length, width]| {
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(a, b)| (cx + a * length, cy + b * width))
    });
    corners.map(|(cx, cy)| (x - cx).hypot(y - cy)).fold(f64::INFINITY, f64::min)
}

#[test]
fn features_are_mapped_where_they_are() {
    let files = Files::new();
    let (log, map) = (files.path("drive.agvlog"), files.path("features.csv"));
    // A perfect start and a perfect survey: what is left is the error of mapping.
    let mut scenario = scenario();
    scenario.start = StartOptions { position_deviation: 0.001, heading_deviation_deg: 0.01, ..scenario.start };
    scenario.reflectors.survey_deviation = 0.0;
    log::write(Path::new(&log), &simulate(&scenario).unwrap().recording).unwrap();
    for poses in ["truth", "localiser"] {
        let run = agv(&["map", &log, "--output", &map, "--poses", poses, "--json"]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        let landmarks = map_file::read(Path::new(&map)).unwrap();
        let summary = json(&run.stdout);
        let corners: Vec<_> = landmarks.iter().filter(|landmark| landmark.kind == LandmarkKind::Corner).collect();
        assert_eq!(summary["corners"], corners.len());
        assert_eq!(summary["reflectors"], 0);
        // Each box turns at least one corner with both faces to the way.
        let found = corners.iter().filter(|corner| distance_to_corner(corner.x, corner.y) < 0.01).count();
        let hall = corners
            .iter()
            .filter(|corner| [-5.0, 6.0].iter().any(|x| (corner.x - x).abs() < 0.05) && corner.y.abs() > 5.95);
        assert!(found >= 4, "{poses}: {found} of {} corners are those of boxes", corners.len());
        assert!(found + hall.count() >= corners.len() - 1, "{poses}: {landmarks:?}");
    }
    // The map that was written is used: without reflectors, and with an empty map, there would be none.
    let run = agv(&["replay", &log, "--map", &map, "--landmarks", "features", "--json"]);
    let figures = json(&run.stdout);
    let corner = figures["observations"].as_array().unwrap().iter().find(|entry| entry["kind"] == "corner").unwrap();
    assert!(corner["accepted"].as_u64().unwrap() > 50, "{corner}");
    assert!(figures["accuracy"]["position_mm"]["max"].as_f64().unwrap() < 20.0);
}

#[test]
fn reflectors_are_mapped_where_they_are() {
    let files = Files::new();
    let (log, map) = (files.path("drive.agvlog"), files.path("reflectors.csv"));
    let mut recording = drive();
    // The localiser's own survey must not matter.
    recording.landmarks.clear();
    log::write(Path::new(&log), &recording).unwrap();
    let run = agv(&["map", &log, "--output", &map, "--kind", "reflectors"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let landmarks = map_file::read(Path::new(&map)).unwrap();
    assert_eq!(landmarks.len(), REFLECTORS.len());
    for [x, y] in REFLECTORS {
        let nearest = landmarks.iter().map(|landmark| (landmark.x - x).hypot(landmark.y - y)).fold(9.0, f64::min);
        assert!(nearest < 0.01, "the reflector at {x}, {y} is mapped {nearest} m off");
    }

    assert!(refusal(&["map", &log, "-o", &map, "--kind", "reflectors", "--poses", "localiser"]).contains("--poses"));
    recording.truth.clear();
    log::write(Path::new(&log), &recording).unwrap();
    assert!(refusal(&["map", &log, "-o", &map, "--kind", "reflectors"]).contains("reference poses"));
    assert!(refusal(&["map", &log, "-o", &map, "--poses", "truth"]).contains("no true poses"));
}

#[test]
fn reflectors_are_mapped_from_reference_poses_of_the_laser() {
    let files = Files::new();
    let (log, map) = (files.path("drive.agvlog"), files.path("reflectors.csv"));
    let mut recording = drive();
    // The laser is 0.9 m before R, and turned by a quarter.
    recording.references = recording
        .truth
        .iter()
        .map(|truth| {
            let (sine, cosine) = truth.pose.theta.sin_cos();
            agv_host_sim::recording::Reference {
                time: truth.time,
                x: truth.pose.x + 0.9 * cosine,
                y: truth.pose.y + 0.9 * sine,
                heading: Some(truth.pose.theta + FRAC_PI_2),
            }
        })
        .collect();
    recording.truth.clear();
    recording.parameters.lasers.first_mut().theta = FRAC_PI_2;
    for event in &mut recording.events {
        if let agv_host_sim::recording::RecordedEvent::Reflectors(seen) = event {
            seen.observations.iter_mut().for_each(|observation| observation.bearing -= FRAC_PI_2 as f32);
        }
    }
    log::write(Path::new(&log), &recording).unwrap();
    let run = agv(&["map", &log, "--output", &map, "--kind", "reflectors"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    for [x, y] in REFLECTORS {
        let landmarks = map_file::read(Path::new(&map)).unwrap();
        let nearest = landmarks.iter().map(|landmark| (landmark.x - x).hypot(landmark.y - y)).fold(9.0, f64::min);
        assert!(nearest < 0.01, "the reflector at {x}, {y} is mapped {nearest} m off");
    }
}

#[test]
fn a_map_is_refused_with_the_line_that_is_wrong() {
    let files = Files::new();
    let log = files.path("drive.agvlog");
    log::write(Path::new(&log), &drive()).unwrap();
    let good = format!("{}\n3,corner,1.0,2.0,0.001\n\n", map_file::HEADER);
    let lines = [
        ("4,corner,1.0,2.0", "4 fields"),
        ("x,corner,1.0,2.0,0.001", "id is 'x'"),
        ("65536,corner,1.0,2.0,0.001", "id is '65536'"),
        ("4,tree,1.0,2.0,0.001", "kind is 'tree'"),
        ("4,corner,east,2.0,0.001", "x_m is 'east'"),
        ("4,corner,1.0,inf,0.001", "y_m is 'inf'"),
        ("4,corner,1.0,2.0,-0.001", "deviation_m is negative"),
        ("3,end_point,5.0,2.0,0.001", "another landmark 3"),
    ];
    for (line, expected) in lines {
        let map = files.write("map.csv", format!("{good}{line}\n").as_bytes());
        let complaint = refusal(&["replay", &log, "--map", &map]);
        assert!(complaint.contains("map.csv:4: ") && complaint.contains(expected), "{complaint}");
    }
    // Reflectors are counted apart.
    let map = files.write("map.csv", format!("{good}3,reflector,5.0,2.0,0.001\n").as_bytes());
    assert_eq!(map_file::read(Path::new(&map)).unwrap().len(), 2);
    for (content, expected) in
        [(&b""[..], "no data"), (b"\x1f\x8b\x08\0\0", "gzip"), (b"id;kind\n", "text"), (b"\xff\xfb,\0", "binary")]
    {
        let map = files.write("map.csv", content);
        assert!(refusal(&["replay", &log, "--map", &map]).contains(expected));
    }
    assert!(refusal(&["replay", &log, "--map", &files.path("missing.csv")]).contains("no such file"));
}

#[test]
fn bad_logs_are_refused_in_one_line() {
    let files = Files::new();
    let map = files.path("map.csv");
    let good = files.path("good.agvlog");
    log::write(Path::new(&good), &drive()).unwrap();
    let mut headless = std::fs::read(&good).unwrap();
    headless[20] ^= 1;
    let mut newer = std::fs::read(&good).unwrap();
    newer.truncate(5);
    let inputs = [
        (files.path("missing.agvlog"), "no such file"),
        (files.write("empty.agvlog", b""), "empty"),
        (files.write("foreign.agvlog", b"PK\x03\x04 and more"), "zip"),
        (files.write("text.agvlog", b"FLASER 180 1.0 2.0\n"), "not a log"),
        (files.write("headless.agvlog", &headless), "header"),
        (files.write("cut.agvlog", &newer), "header"),
        (files.folder(), ""),
    ];
    for (input, expected) in &inputs {
        for arguments in [vec!["replay", input], vec!["map", input, "--output", &map]] {
            let complaint = refusal(&arguments);
            assert!(complaint.contains(expected), "{complaint}");
        }
    }
    assert!(!Path::new(&map).exists(), "a map of nothing was left behind");
    let both = agv(&["replay", &good, "--landmarks", "none,features"]);
    assert!(both.status.code() == Some(2) && text(&both.stderr).contains("--landmarks"));
    assert!(refusal(&["replay", &good, "--output", &files.path("no/such/folder.agvlog")]).contains("folder.agvlog"));
    let file = files.write("file", b"in the way");
    assert!(refusal(&["replay", &good, "--report", &file]).contains("file/index.html"));
}

#[test]
fn the_default_run_compares_six_ways_and_leaves_a_log() {
    let files = Files::new();
    let folder = files.path("report");
    let run = agv(&["--report", &folder, "--json"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let ways = json(&run.stdout);
    let end = |name: &str| {
        let way = ways.as_array().unwrap().iter().find(|way| way["name"] == name).unwrap();
        way["accuracy"]["position_end_mm"].as_f64().unwrap()
    };
    for name in ["reflectors", "static features", "mixed"] {
        assert!(end(name) < 20.0 && end(name) < end("odometry alone"), "{name}: {} mm", end(name));
    }
    assert!(std::fs::read_to_string(format!("{folder}/index.html")).unwrap().contains("<figure>"));
    let again = agv(&["replay", &format!("{folder}/drive.agvlog")]);
    assert!(text(&again.stdout).contains("recorded ones, bit for bit"), "{}", text(&again.stdout));
    assert!(refusal(&["--report", &files.write("file", b"in the way")]).contains("file"));
}
