//! The commands against an emulated sensor.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use agv_host_sim::layout_file;
use agv_host_sim::log;
use agv_host_sim::recording::RecordedEvent;

use crate::support::{Files, agv, refusal, text};

/// A running `agv nav350 serve`.
pub struct Server {
    child: Child,
    pub host: String,
}

impl Server {
    pub fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_agv"))
            .args(["nav350", "serve", "--port", "0"])
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
        let port = line.trim().rsplit(' ').next().unwrap().to_owned();
        Self { child, host: format!("127.0.0.1:{port}") }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

const SCENARIO: &str = "[world]\nkind = \"block_storage\"\nreflectors = \"aisle\"\n";

fn succeed(arguments: &[&str]) -> String {
    let output = agv(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout).to_owned()
}

#[test]
fn a_sensor_is_probed_recorded_and_given_a_layout() {
    let files = Files::new();
    let scenario = files.write("aisle.toml", SCENARIO.as_bytes());
    let server = Server::start(&["--scenario", &scenario]);
    let host = server.host.as_str();

    let probe = succeed(&["nav350", "probe", host]);
    let probe = probe.split_whitespace().collect::<Vec<_>>().join(" ");
    for expected in ["dialect Binary", "DeviceIdent NAV350 emulated", "beams 1440", "mode navigation"] {
        assert!(probe.contains(expected), "{expected}: {probe}");
    }

    let (imk, csv, again) = (files.path("a.imk"), files.path("a.csv"), files.path("b.csv"));
    succeed(&["nav350", "layout", "download", host, &imk]);
    succeed(&["nav350", "layout", "convert", &imk, &csv]);
    succeed(&["nav350", "layout", "upload", host, &csv]);
    succeed(&["nav350", "layout", "download", host, &again]);
    let layout = layout_file::load(Path::new(&imk)).unwrap();
    assert!(layout.len() > 5);
    assert_eq!(layout_file::load(Path::new(&again)).unwrap(), layout);

    let recorded = files.path("live.agvlog");
    succeed(&["record", "--nav350", host, "--scans", "2", "--duration", "120", "-o", &recorded]);
    let (recording, damages) = log::read(Path::new(&recorded)).unwrap();
    assert!(damages.is_empty());
    assert!(recording.events.iter().any(|event| matches!(event, RecordedEvent::Scan(_))));
}

#[test]
fn bad_input_is_refused_in_one_line() {
    let files = Files::new();
    let bad = files.write("bad.imk", b"1 2 3");
    let output = files.path("out.csv");
    assert!(refusal(&["nav350", "layout", "convert", &bad, &output]).contains("bad.imk:1:"));
    refusal(&["nav350", "layout", "convert", &files.path("none.imk"), &output]);
    refusal(&["nav350", "layout", "convert", &bad, &files.path("out.txt")]);
    refusal(&["nav350", "serve", "--speed", "0"]);
    // Nobody listens there.
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    refusal(&["nav350", "probe", &free]);
}
