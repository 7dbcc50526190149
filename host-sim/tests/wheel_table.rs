//! Tables of wheels: columns by name and by number, units, and what is wrong with them in one line.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::PI;
use std::path::PathBuf;

use agv_core::geometry::Pose;
use agv_core::odometry::VehicleOdometer;
use agv_host_sim::calibrate::wheeled::clock::Clock;
use agv_host_sim::calibrate::wheeled::path::LinearisedPath;
use agv_host_sim::import::wheel_table::{TableColumns, read, read_all};
use agv_host_sim::import::{optiodom, wheel_recording};
use agv_host_sim::recording::RecordedEvent;

const COLUMNS: &str = r#"
time = { column = "t", unit = "ms" }
[[wheel]]
turn = { column = "left", unit = "ticks", ticks = 1000 }
[[wheel]]
turn = { column = "right", unit = "m/s" }
radius = 0.1
steering = { column = "angle", unit = "deg" }
[reference]
time = { column = "seen", unit = "s" }
x = { column = "x", unit = "mm" }
y = { column = "y", unit = "m" }
heading = { column = "h", unit = "deg" }
"#;

fn columns() -> TableColumns {
    toml::from_str(COLUMNS).unwrap()
}

fn table(folder: &tempfile::TempDir, text: &str) -> PathBuf {
    let path = folder.path().join("drive.csv");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn columns_are_found_by_their_names_and_come_in_si() {
    let folder = tempfile::tempdir().unwrap();
    let path = table(
        &folder,
        "t,left,right,angle,seen,x,y,h\n1000,100,0.5,0,7.0,500,1,179\n1100,600,0.5,90,7.1,1000,2,-179\n1200,,,,7.3,0,0,0\n",
    );
    let drive = read(&path, &columns()).unwrap();
    assert_eq!(drive.steps.len(), 1);
    let step = &drive.steps[0];
    assert!((step.end - 0.1).abs() < 1e-12);
    assert!((step.motions[0].turn - PI).abs() < 1e-12 && step.motions[0].steering_end == 0.0);
    assert!((step.motions[1].turn - 0.5).abs() < 1e-12);
    assert!(step.motions[1].steering_start == 0.0 && (step.motions[1].steering_end - 0.5 * PI).abs() < 1e-12);
    // A row may say of the reference alone; both count from the first row of the wheels.
    assert_eq!(drive.poses.len(), 3);
    let (first, second) = (drive.poses[0], drive.poses[1]);
    assert!((first.time - 6.0).abs() < 1e-12 && first.x == 0.5 && first.y == 1.0);
    assert!((second.heading - first.heading - 2.0_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn what_is_wrong_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let heading = "t,left,right,angle,seen,x,y,h\n";
    let fault = |text: &str| read(&table(&folder, text), &columns()).unwrap_err().to_string();
    let bad = [
        ("t,left,right,angle,seen,x,y\n", ":1: there is no column \"h\" among t, left, right, angle, seen, x, y"),
        (&format!("{heading}0,a,1,0,0,0,0,0\n"), ":2: column left is no number: \"a\""),
        (
            &format!("{heading}1,1,1,0,0,0,0,0\n0,1,1,0,1,0,0,0\n"),
            ":3: time runs backward, from 0.001 s to 0 s: where a second run begins, begin a second file",
        ),
        (&format!("{heading}0,1,1,0,1,0,0,0\n1,1,1,0,0,0,0,0\n"), ":3: the time of the reference runs backward"),
        (&format!("{heading}0,1\n"), ":2: there are 2 columns, and right is the 3th"),
        (heading, ": there are no data in the file"),
        ("", ": there are no data in the file"),
    ];
    for (text, expected) in bad {
        let found = fault(text);
        assert!(found.ends_with(expected) && !found.contains('\n'), "{found:?} is not {expected:?}");
    }
    let mut wrong = columns();
    wrong.wheel[0].turn.as_mut().unwrap().unit = "furlongs".to_owned();
    let found = read(&table(&folder, heading), &wrong).unwrap_err().to_string();
    assert!(found.contains("column \"left\" has no known unit: \"furlongs\"; there are s, ms"), "{found}");
    wrong.wheel[0].turn.as_mut().unwrap().unit = "m".to_owned();
    let found = read(&table(&folder, heading), &wrong).unwrap_err().to_string();
    assert!(found.ends_with("column \"left\" cannot be in m"), "{found}");
}

#[test]
fn a_session_of_the_optiodom_robots_is_read() {
    let Some(folder) = agv_host_sim::data::for_test("a_session_of_the_optiodom_robots_is_read", "optiodom") else {
        return;
    };
    let session = optiodom::read(&folder.join("omni3/square/221220201934")).unwrap();
    assert_eq!((session.runs.len(), session.nominal.wheels.len()), (11, 3));
    // The first run: 1284 rows, by `wc`, and the sum of the first wheel's ticks, by `awk`.
    let drive = &session.runs[0].1;
    assert_eq!((drive.poses.len(), drive.steps.len()), (1284, 1283));
    let turns: f64 = drive.steps.iter().map(|step| step.motions[0].turn).sum();
    assert!((turns - -166_609.0 / 12_288.0 * 2.0 * PI).abs() < 0.01, "{turns}");
    let missing = optiodom::read(&folder.join("omni3/square/1")).unwrap_err().to_string();
    assert!(missing.ends_with("there is no such file"), "{missing}");
}

const DESCRIPTION: &str = r#"
sensor = { x = 0.2, y = 0.0, theta = 0.0 }
[vehicle.wheels.differential]
track = 0.5
left = { radius = 0.1, turn = { scale = 1e-4, range = 65536 } }
right = { radius = 0.1, turn = { scale = 1e-4, range = 65536 } }
[table]
time = { column = "t", unit = "s" }
wheel = [{ turn = { column = "left", unit = "rad" } }, { turn = { column = "right", unit = "rad" } }]
reference = { x = { column = "x", unit = "m" }, y = { column = "y", unit = "m" }, heading = { column = "h", unit = "rad" } }
"#;

/// Both wheels on circles: the log's own counters, which wrap, lead to where the circles end.
#[test]
fn a_table_becomes_a_drive_of_its_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "t,left,right,x,y,h\n".to_owned();
    let (rate, radius, steps) = (0.01, 1.0, 157);
    for step in 0..=steps {
        let turned = rate * f64::from(step);
        let way = |offset: f64| turned * (radius + offset) / 0.1;
        let (left, right) = (way(-0.25), way(0.25));
        text += &format!("{},{left},{right},0,0,{turned}\n", 0.05 * f64::from(step));
    }
    let (path, columns) = (table(&folder, &text), folder.path().join("columns.toml"));
    std::fs::write(&columns, DESCRIPTION).unwrap();
    let recording = wheel_recording::read(&path, &columns).unwrap().recording;
    assert_eq!((recording.events.len(), recording.references.len()), (steps as usize + 1, steps as usize + 1));
    let parameters = &recording.parameters;
    let mut odometer = VehicleOdometer::new(&parameters.vehicle, &parameters.odometer());
    let mut pose = Pose::default();
    for event in &recording.events {
        let RecordedEvent::Wheels(sample) = event else { panic!("{event:?}") };
        if let Ok(motion) = odometer.wheels(sample) {
            pose = pose.compose(&motion.displacement);
        }
    }
    let turned = rate * f64::from(steps);
    assert!((pose.theta - turned).abs() < 1e-3 && (pose.x - turned.sin()).abs() < 1e-3, "{pose:?}");
    // It comes back from a log as it was.
    let log = folder.path().join("drive.agvlog");
    agv_host_sim::log::write(&log, &recording).unwrap();
    assert_eq!(agv_host_sim::log::read(&log).unwrap().0, recording);
    // Wheels that the vehicle does not have, and a description that is none.
    let three = DESCRIPTION.replace("wheel = [", "wheel = [{}, ");
    std::fs::write(&columns, three).unwrap();
    let found = wheel_recording::read(&path, &columns).unwrap_err().to_string();
    assert!(found.ends_with("columns.toml:1: the vehicle has 2 wheels, and 3 are described"), "{found}");
    std::fs::write(&columns, DESCRIPTION.replace("track = 0.5", "trak = 0.5")).unwrap();
    let found = wheel_recording::read(&path, &columns).unwrap_err().to_string();
    assert!(found.contains("columns.toml:") && found.contains("track") && !found.contains('\n'), "{found}");
}

/// What the log's vehicle makes of the counters is what the table's own wheels make of the turns, for every kind of robot.
#[test]
fn a_run_of_every_robot_is_dead_reckoned_from_its_log_as_from_its_table() {
    let test = "a_run_of_every_robot_is_dead_reckoned_from_its_log_as_from_its_table";
    let Some(folder) = agv_host_sim::data::for_test(test, "optiodom") else { return };
    for session in
        ["tricyc/free/140120211525", "diff/free/030120210001", "omni3/square/221220201934", "omni4/square/080920201205"]
    {
        let folder = folder.join(session);
        let read = optiodom::read(&folder).unwrap();
        let (name, drive) = &read.runs[0];
        let recording = optiodom::read_run(&folder.join(format!("{name}.csv"))).unwrap();
        let path = LinearisedPath::new(drive, &read.nominal, &[]).unwrap();
        let end = path.sensor_at(1e6, &Clock::default()).pose;
        let parameters = agv_core::localizer::Parameters {
            integration: agv_core::odometry::Integration::Arc,
            ..recording.parameters
        };
        let mut odometer = VehicleOdometer::new(&parameters.vehicle, &parameters.odometer());
        let mut pose = Pose::default();
        for event in &recording.events {
            let motion = match event {
                RecordedEvent::Wheels(sample) => odometer.wheels(sample),
                RecordedEvent::Encoders(sample) => odometer.encoders(sample),
                _ => panic!("{event:?}"),
            };
            pose = motion.map_or(pose, |motion| pose.compose(&motion.displacement));
        }
        let off = (pose.x - end.x).hypot(pose.y - end.y);
        let turned = agv_core::geometry::difference(pose.theta, end.z);
        assert!(off < 2e-3 && turned.abs() < 2e-3, "{session}: {pose:?} is not {end:?}");
        assert!(end.x.hypot(end.y) > 0.02 || end.z.abs() > 0.5, "{session} goes nowhere");
    }
}

#[test]
fn tables_of_other_countries_and_encodings_say_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..20).map(|row| format!("{},{},0.5,0,{}.5,500,1,179\n", 100 * row, 50 * row, row)).collect();
    let text = format!("t,left,right,angle,seen,x,y,h\n{rows}");
    let right = read(&table(&folder, &text), &columns()).unwrap();
    let semicolons = text.replace(',', ";").replace('.', ",");
    let wide = |order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        std::iter::once(0xFEFF).chain(semicolons.encode_utf16()).flat_map(order).collect()
    };
    for (case, bytes) in [
        ("semicolons and decimal commas", semicolons.clone().into_bytes()),
        ("tabulators", text.replace(',', "\t").into_bytes()),
        ("a stated separator", format!("sep=;\r\n{}", semicolons.replace('\n', "\r\n")).into_bytes()),
        ("a byte order mark", [b"\xEF\xBB\xBF", text.as_bytes()].concat()),
        ("UTF-16, low byte first", wide(u16::to_le_bytes)),
        ("UTF-16, high byte first", wide(u16::to_be_bytes)),
        ("remarks", format!("# made \"by hand\n{text}").into_bytes()),
    ] {
        let path = folder.path().join("drive.csv");
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(read(&path, &columns()).unwrap_or_else(|error| panic!("{case}: {error}")), right, "{case}");
    }
    // Rows of one time are told once, and a cut row not at all.
    let doubled: String = text
        .lines()
        .flat_map(|line| [line, "\n", if line.starts_with("100,") { "100,50,0.5,0,,,,\n" } else { "" }])
        .collect();
    let (drive, account) = read_all(&table(&folder, &doubled), &columns()).unwrap();
    assert_eq!(
        (drive.steps.len(), account.left_out()[0].to_string().as_str()),
        (19, "1 rows of the time of the row before, first at line 4")
    );
    let (drive, account) = read_all(&table(&folder, &text[..text.len() - 12]), &columns()).unwrap();
    assert_eq!((drive.steps.len() >= 18, account.warnings().len()), (true, 1));
}
