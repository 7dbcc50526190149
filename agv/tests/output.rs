//! Results that cannot be written, and files that stand where others shall.

use std::fs::File;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};

use agv_host_sim::log;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

use crate::nav350::commands::Server;
use crate::support::{Files, GRAPH, agv, refusal, text};

/// A log of a short drive.
fn short_drive(files: &Files) -> String {
    let mut recording = simulate(&Scenario::default()).unwrap().recording;
    recording.events.truncate(300);
    let path = files.path("drive.agvlog");
    log::write(Path::new(&path), &recording).unwrap();
    path
}

fn into_full_device(arguments: &[&str]) -> (Option<i32>, String) {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_agv")).args(arguments).stdout(full).output().unwrap();
    (output.status.code(), text(&output.stderr).to_owned())
}

#[test]
fn a_result_that_cannot_be_printed_is_a_failure() {
    let files = Files::new();
    let log = short_drive(&files);
    let scenario = files.write("s.toml", b"seed = 1\n");
    for arguments in [
        &["replay", &log, "--json"][..],
        &["replay", &log],
        &["completion", "bash"],
        &["completion", "zsh"],
        &["simulate", &scenario, "--json"],
        &["settings"],
        &["calibrate", "--help"],
        &["--help"],
        &["--version"],
    ] {
        let (code, complaint) = into_full_device(arguments);
        assert_eq!(code, Some(1), "{arguments:?}: {complaint}");
        let last = complaint.lines().last().unwrap_or_default();
        assert!(last.starts_with("agv: the result cannot be written"), "{arguments:?}: {complaint}");
        assert_eq!(complaint.matches("os error 28").count(), 1, "{complaint}");
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let files = Files::new();
    let log = short_drive(&files);
    for arguments in [&["completion", "bash"][..], &["replay", &log, "--json"], &["--help"], &["replay", "--help"]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_agv"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn a_reason_is_said_once() {
    let files = Files::new();
    let log = short_drive(&files);
    for (output, reason) in
        [("/dev/full", "No space left on device"), (&files.path("no/folder/x")[..], "there is no folder")]
    {
        for arguments in [
            ["replay", &log, "--output", output],
            ["export", "csv", &log, &format!("--output={output}")],
            ["export", "mcap", &log, &format!("--output={output}")],
        ] {
            let complaint = refusal(&arguments.iter().copied().filter(|word| !word.is_empty()).collect::<Vec<_>>());
            assert_eq!(complaint.matches(reason).count(), 1, "{arguments:?}: {complaint}");
            assert!(complaint.contains(output), "{complaint}");
        }
    }
}

/// A server that does to each connection what it is told.
fn serve(talk: impl Fn(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    // The thread ends with the program.
    std::thread::spawn(move || listener.incoming().flatten().for_each(&talk));
    address
}

/// The bytes of a folder's files, without those that a running command removes meanwhile.
fn folder_size(folder: &str) -> u64 {
    std::fs::read_dir(folder).unwrap().flatten().filter_map(|entry| entry.metadata().ok()).map(|file| file.len()).sum()
}

#[test]
fn what_measures_nothing_is_a_failure_and_an_old_recording_survives_it() {
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let silent = serve(std::mem::forget);
    let babbling = serve(|mut stream| while stream.write_all(&[0xAA; 1 << 16]).is_ok() {});
    for (host, reason) in [(&closed, "no connection"), (&silent, "no"), (&babbling, "1 MiB came without an answer")] {
        let files = Files::new();
        let keep = files.write("keep.agvlog", b"a long day's work");
        for output in [&keep, &files.path("new.agvlog")] {
            let complaint = refusal(&["record", "--nav350", host, "--duration", "3", "-o", output]);
            assert!(complaint.contains(&format!("{host}: nothing was measured")), "{complaint}");
            assert!(complaint.contains(reason), "{complaint}");
        }
        assert_eq!(std::fs::read(&keep).unwrap(), b"a long day's work");
        assert_eq!(std::fs::read_dir(files.folder()).unwrap().count(), 1);
    }
}

/// Runs a command that may write no byte to any file.
fn without_room(arguments: &[&str]) -> std::process::Output {
    // What a full disk does, without one: the limit is an error instead of a signal.
    let script = "trap '' XFSZ; ulimit -f 0; exec \"$@\"";
    let mut bash = Command::new("bash");
    bash.args(["-c", script, "bash", env!("CARGO_BIN_EXE_agv")]).args(arguments).output().unwrap()
}

#[test]
fn a_command_that_fails_while_it_writes_leaves_what_was_there() {
    let files = Files::new();
    let log = short_drive(&files);
    let scenario = files.write("s.toml", b"seed = 1\n");
    let layout = files.write("layout.csv", b"globID,x_mm,y_mm,type,subtype,size_mm,layer1\n7,-1000,2000,1,2,80,0\n");
    let graph = files.write("graph.log", GRAPH.as_bytes());
    let key = files.write("agv.key", "0".repeat(64).as_bytes());
    let [table, imk, folder] = ["old.csv", "old.imk", "old"].map(|name| files.path(name));
    let [page, manual] = ["old/index.html", "old/agv.1"].map(|name| files.path(name));
    std::fs::create_dir(&folder).unwrap();
    for (arguments, output) in [
        (&["simulate", &scenario, "--output", &table][..], &table),
        (&["replay", &log, "--output", &table], &table),
        (&["replay", &log, "--report", &folder], &page),
        (&["report", &log, "--output", &table], &table),
        (&["map", &log, "--output", &table, "--poses", "truth"], &table),
        (&["map", &log, "--output", &table, "--poses", "truth", "--kind", "contours"], &table),
        (&["export", "csv", &log, "--output", &table], &table),
        (&["export", "tum", &log, "--output", &table], &table),
        (&["export", "mcap", &log, "--output", &table], &table),
        (&["layout", "convert", &layout, &imk], &imk),
        (&["layout", "check", &layout, "--report", &folder], &page),
        (&["import", "graph", &graph, "--output", &table], &table),
        (&["provision", "--key", &key, "--output", &table], &table),
        (
            &["calibrate", "plan", "--area", "14x11", "--steering", "18..50", "--time", "300", "--scenario", &table],
            &table,
        ),
        (&["manual", "--output", &folder], &manual),
    ] {
        std::fs::write(output, b"before").unwrap();
        let run = without_room(arguments);
        let complaint = text(&run.stderr);
        assert_eq!(run.status.code(), Some(1), "{arguments:?}: {complaint}");
        let last = complaint.lines().last().unwrap_or_default();
        assert!(last.starts_with("agv: ") && last.contains("os error 27"), "{arguments:?}: {complaint}");
        assert_eq!(std::fs::read(output).unwrap(), b"before", "{arguments:?}");
        std::fs::remove_file(output).unwrap();
    }
    // Nothing half done is left beside.
    assert_eq!(std::fs::read_dir(files.folder()).unwrap().count(), 6);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
}

#[test]
fn nothing_is_written_but_aside() {
    fn sources(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                sources(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    for room in ["agv", "host-sim", "lab", "lidar3d"] {
        sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(room).join("src"), &mut found);
    }
    // A board's own files, and what is written aside.
    let may = ["output_file.rs", "emulate/board.rs", "emulate/vehicle/mod.rs"];
    let others: Vec<_> = found.iter().filter(|path| !may.iter().any(|end| path.ends_with(end))).collect();
    assert!(found.len() > 300 && found.len() == others.len() + may.len(), "{} {}", found.len(), others.len());
    for path in others {
        let source = std::fs::read_to_string(path).unwrap();
        let is_direct = |way: &&str| source.contains(*way);
        let direct = ["fs::write(", "File::create(", "write_to_file("].into_iter().find(is_direct);
        // The same call with another name is none.
        let aside = source.matches("OutputFile::create(").count();
        let is_aside = direct == Some("File::create(") && source.matches("File::create(").count() == aside;
        assert!(direct.is_none() || is_aside, "{}: {direct:?}", path.display());
    }
}

#[test]
fn a_babbling_server_does_not_fill_the_disk() {
    let babbling = serve(|mut stream| while stream.write_all(&[0xAA; 1 << 16]).is_ok() {});
    let files = Files::new();
    let output = files.path("new.agvlog");
    let mut child = Command::new(env!("CARGO_BIN_EXE_agv"))
        .args(["record", "--nav350", &babbling, "--duration", "4", "-o", &output])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut largest = 0;
    while child.try_wait().unwrap().is_none() {
        largest = largest.max(folder_size(&files.folder()));
        std::thread::yield_now();
    }
    // A mebibyte for each connection, and pauses between them that grow.
    assert!((1 << 20..8 << 20).contains(&largest), "{largest} bytes");
}

#[test]
fn a_recording_that_begins_sets_the_older_one_aside() {
    let files = Files::new();
    let server = Server::start(&[]);
    let output = files.write("drive.agvlog", b"before");
    for (scans, older) in [("1", "drive.agvlog.old"), ("1", "drive.agvlog.old2")] {
        let run = agv(&["record", "--nav350", &server.host, "--scans", scans, "-o", &output]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        assert!(text(&run.stderr).contains(older), "{}", text(&run.stderr));
        assert!(log::read(Path::new(&output)).unwrap().1.is_empty());
    }
    assert_eq!(std::fs::read(files.path("drive.agvlog.old")).unwrap(), b"before");
    assert!(log::read(Path::new(&files.path("drive.agvlog.old2"))).unwrap().1.is_empty());
}

#[test]
fn the_file_that_is_missing_is_named_once() {
    let files = Files::new();
    let missing = files.path("missing.csv");
    for arguments in [
        &["campaign", &missing][..],
        &["-q", "campaign", &missing],
        &["simulate", &missing],
        &["emulate", "--image", &missing],
        &["replay", &missing],
        &["provision", "--key", &missing, "--output", "x"],
        &["nav350", "layout", "convert", &missing, "x.csv"],
        &["view", &missing],
    ] {
        let complaint = refusal(arguments);
        assert_eq!(complaint.matches(&missing).count(), 1, "{arguments:?}: {complaint}");
        assert_eq!(complaint.to_lowercase().matches("no such file").count(), 1, "{arguments:?}: {complaint}");
    }
}

#[test]
fn frames_without_a_vehicle_are_no_odometry() {
    let files = Files::new();
    let input =
        files.write("can.log", b"(1436509053.249713) can0 044#2A366C2B\n(1436509053.349713) can0 181#E8030000\n");
    let output = files.write("out.agvlog", b"before");
    let complaint = refusal(&["import", "candump", &input, "-o", &output]);
    assert!(complaint.contains("--like") && complaint.contains("--drive"), "{complaint}");
    assert_eq!(std::fs::read(&output).unwrap(), b"before");
}

#[test]
fn quiet_goes_before_a_command_too() {
    for arguments in
        [&["-q", "completion", "bash"][..], &["--quiet", "completion", "bash"], &["completion", "bash", "-q"]]
    {
        assert!(agv(arguments).status.success(), "{arguments:?}");
    }
    let stray = agv(&["--report", "x", "completion", "bash"]);
    assert_eq!(stray.status.code(), Some(2));
    assert!(text(&stray.stderr).contains("--report"));
}

#[test]
fn a_layout_with_a_byte_order_mark_is_read() {
    let files = Files::new();
    let input = files.write("hall.imk", b"\xEF\xBB\xBF# globID x_mm y_mm\r\n7 -1000 2000 1 2 80 0\r\n");
    let output = agv(&["nav350", "layout", "convert", &input, &files.path("hall.csv"), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("\"1\""), "{}", text(&output.stdout));
}

#[test]
fn a_scan_that_is_too_long_for_a_log_is_named() {
    let files = Files::new();
    let beams = vec!["1.0"; 20_000].join(" ");
    let line = format!("FLASER 20000 {beams} 0 0 0 0 0 0 1.0 host 1.0\n");
    let input = files.write("long.log", line.as_bytes());
    let complaint = refusal(&["import", "carmen", &input, "-o", &files.path("out.agvlog")]);
    assert!(complaint.contains("20000 beams") && complaint.contains("32768 bytes"), "{complaint}");
}

#[test]
fn the_report_of_several_drives_has_what_a_replay_has() {
    let files = Files::new();
    let log = short_drive(&files);
    let page = files.path("page.html");
    let report = agv(&["report", &log, "--json", "-o", &page]);
    let report: serde_json::Value = serde_json::from_slice(&report.stdout).unwrap();
    let replay: serde_json::Value = serde_json::from_slice(&agv(&["replay", &log, "--json"]).stdout).unwrap();
    for key in replay.as_object().unwrap().keys() {
        assert!(report[0].get(key).is_some(), "{key}");
    }
}

#[test]
fn a_map_without_landmarks_is_not_taken_for_that_of_the_log() {
    let files = Files::new();
    let log = short_drive(&files);
    let map = files.write("empty.csv", b"id,kind,x_m,y_m,deviation_m\n");
    assert!(refusal(&["replay", &log, "--map", &map]).contains("no landmarks"));
    let both = agv(&["replay", &log, "--landmarks", "none,reflectors"]);
    assert_eq!((both.status.code(), both.stdout.len()), (Some(2), 0));
}

#[test]
fn values_that_no_vehicle_has_are_named_with_their_bounds() {
    let files = Files::new();
    let log = short_drive(&files);
    for (entry, expected) in [
        ("wheelbase_m = 1500.0", "wheelbase_m must be from 0.05 to 50, and is 1500"),
        ("wheelbase_m = -1.5", "wheelbase_m must be from 0.05 to 50, and is -1.5"),
        ("drive_scale_m_per_tick = 0.0", "drive_scale_m_per_tick must be anything but 0"),
    ] {
        let vehicle = files.write("vehicle.toml", entry.as_bytes());
        let complaint = refusal(&["replay", &log, "--vehicle", &vehicle]);
        assert!(complaint.contains(expected), "{complaint}");
    }
    let complaint = refusal(&["replay", &log, "--set", "features.nearest=40"]);
    assert!(complaint.contains("features.nearest (40) does not go with features.farthest (30)"), "{complaint}");
    let key = files.write("agv.key", "0".repeat(64).as_bytes());
    let flash = files.path("flash.bin");
    let complaint = refusal(&["provision", "--key", &key, "--set", "vehicle.wheelbase=", "-o", &flash]);
    assert!(complaint.contains("vehicle.wheelbase must be a number, not ''"), "{complaint}");
}
