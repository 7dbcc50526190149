//! `agv run`: the demonstration as people run it, a controller with a configuration, and what is refused.
#![cfg(unix)]

mod faults;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::{Files, agv, json_keys, refusal, text};

/// How long anything may take on a machine that is busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// A controller in a program of its own, which ends with this value.
struct Running {
    child: Child,
    /// What it says, line by line.
    said: BufReader<std::process::ChildStderr>,
    /// Lines that nobody has waited for yet: its threads speak in no order.
    unclaimed: Vec<String>,
}

impl Running {
    fn start(arguments: &[&str]) -> Self {
        Self::start_as(env!("CARGO_BIN_EXE_agv"), arguments)
    }

    fn start_as(program: &str, arguments: &[&str]) -> Self {
        let mut child =
            Command::new(program).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let said = BufReader::new(child.stderr.take().unwrap());
        Self { child, said, unclaimed: Vec::new() }
    }

    /// The first line that has a word in it, and was not given before.
    fn hear(&mut self, word: &str) -> String {
        if let Some(place) = self.unclaimed.iter().position(|line| line.contains(word)) {
            return self.unclaimed.remove(place);
        }
        loop {
            let mut line = String::new();
            assert!(self.said.read_line(&mut line).unwrap() > 0, "no word of {word}: {:?}", self.unclaimed);
            if line.contains(word) {
                return line;
            }
            self.unclaimed.push(line);
        }
    }

    /// Addresses of log stream and service port, once it is there.
    fn ports(&mut self) -> [String; 2] {
        let line = self.hear("agv view --live");
        let behind = |word: &str| {
            let rest = line.split_once(word).unwrap().1;
            rest.split([' ', ';', '\n']).find(|part| !part.is_empty()).unwrap().to_owned()
        };
        [behind("--live "), behind("agv ctl ")]
    }

    /// Ends it as a service manager does; whether it was content.
    fn terminate(mut self) -> (bool, String) {
        let killed = Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        let mut printed = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut printed).unwrap();
        (self.child.wait().unwrap().success(), printed)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_demonstration_ends_by_itself_and_tells_its_figures() {
    let run = agv(&["run", "--demo", "--seconds", "6", "--json", "--quiet"]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let told: Value = serde_json::from_slice(&run.stdout).unwrap();
    let keys = ["level_mm", "missed", "mode", "period_ms", "poses", "restarts"];
    let mut found: Vec<&str> = told.as_object().unwrap().keys().map(String::as_str).collect();
    found.sort_unstable();
    assert_eq!(found, keys, "{told}");
    assert!(["p50", "p999", "max"].iter().all(|key| json_keys(&told["period_ms"]).contains(&(*key).to_owned())));
    assert!(told["poses"].as_u64().unwrap() > 100 && told["restarts"] == 0, "{told}");
    assert!(told["level_mm"].as_f64().is_some() && told["period_ms"]["p50"].as_f64().unwrap() > 0.0, "{told}");
}

#[test]
fn other_commands_meet_it_as_they_meet_a_board() {
    let files = Files::new();
    let store = files.path("store");
    let own = files.path("own.agvlog");
    let mut running = Running::start(&["run", "--demo", "--no-page", "--store", &store, "--output", &own]);
    let [log, service] = running.ports();
    let version = agv(&["ctl", &service, "version"]);
    assert!(text(&version.stdout).contains("agv-run "), "{}", text(&version.stderr));
    let list = agv(&["ctl", &service, "list", "--json"]);
    let settings: Value = serde_json::from_slice(&list.stdout).unwrap();
    assert_eq!(settings["nav350.address"], "127.0.0.1");
    // The page of another program shows it.
    let drive = files.path("drive.agvlog");
    let mut view = Running::start(&["view", "--live", &log, "--port", "0", "--json", "--output", &drive]);
    let mut url = String::new();
    BufReader::new(view.child.stdout.as_mut().unwrap()).read_line(&mut url).unwrap();
    let url: Value = serde_json::from_str(&url).unwrap();
    let host = url["url"].as_str().unwrap().trim_start_matches("http://").trim_end_matches('/').to_owned();
    let start = Instant::now();
    loop {
        let status: Value = serde_json::from_str(&get(&host, "/api/status")).unwrap();
        if status["poses"].as_u64().is_some_and(|poses| poses > 100) {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "{status}");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(view.terminate().0);
    let (is_content, printed) = running.terminate();
    assert!(is_content && printed.contains("missed deadlines"), "{printed}");
    // What was heard has poses; the log from the first event on replays to the same bits.
    assert!(agv(&["replay", &drive, "--json", "--quiet"]).status.success());
    let replayed = agv(&["replay", &own, "--json", "--quiet"]);
    let told: Value = serde_json::from_slice(&replayed.stdout).unwrap();
    for kind in ["outputs", "published"] {
        assert!(told[kind]["compared"].as_u64().unwrap() > 50, "{}", told[kind]);
        assert!(told[kind]["first_difference"].is_null(), "{}", told[kind]);
    }
}

/// What a page of this machine says.
fn get(host: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(host).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.split_once("\r\n\r\n").unwrap().1.to_owned()
}

/// A port of this machine that nobody listens to just now.
fn free_port() -> u16 {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
}

/// The configuration of a controller at free ports whose bus is behind an adapter at one, without a laser; and the file of its key.
fn provisioned(files: &Files, adapter: u16, status: u16) -> [String; 2] {
    let key = files.write("agv.key", crate::ctl::KEY.as_bytes());
    let [log, service, laser] = std::array::from_fn(|_| free_port());
    let store = files.path("store");
    std::fs::create_dir(&store).unwrap();
    let (image, set) = (format!("{store}/flash.bin"), |name: &str, value: u16| format!("{name}={value}"));
    let [log, service, laser] = [set("log.port", log), set("service.port", service), set("nav350.port", laser)];
    let provision = ["provision", "--key", &key, "--set", &log, "--set", &service, "--set", &laser, "--output", &image];
    let made = agv(&[&provision[..], &["--set", "nav350.address=127.0.0.1"]].concat());
    assert!(made.status.success(), "{}", text(&made.stderr));
    let configuration = format!(
        "store = \"{store}\"\nbus = \"slcan-tcp:127.0.0.1:{adapter}\"\nlisten = \"127.0.0.1\"\n[real_time]\n\
         [status]\nlisten = \"127.0.0.1:{status}\"\n"
    );
    [files.write("vehicle.toml", configuration.as_bytes()), key]
}

/// An adapter that has room for one client hears the controller on the first connection.
#[test]
fn the_bus_is_opened_once() {
    let files = Files::new();
    let bus = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let [configuration, _] = provisioned(&files, bus.local_addr().unwrap().port(), free_port());
    let running = Running::start(&["run", "--config", &configuration]);
    let (mut adapter, _) = bus.accept().unwrap();
    drop(bus);
    adapter.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut heard = Vec::new();
    while !text(&heard).contains("t1908") {
        let mut bytes = [0; 4096];
        let count = adapter.read(&mut bytes).unwrap();
        assert!(count > 0, "the connection was closed behind {:?}", text(&heard));
        heard.extend(&bytes[..count]);
    }
    assert!(running.terminate().0);
}

#[test]
fn a_controller_tells_its_state_and_keeps_its_settings() {
    let files = Files::new();
    let [status, adapter] = std::array::from_fn(|_| free_port());
    let [configuration, key] = provisioned(&files, adapter, status);
    let mut running = Running::start(&["run", "--config", &configuration]);
    let [_, service] = running.ports();
    // There is no adapter yet: it is tried again.
    running.hear("can: ");
    let bus = TcpListener::bind((Ipv4Addr::LOCALHOST, adapter)).unwrap();
    let (mut adapter, _) = bus.accept().unwrap();
    let mut commands = [0; 16];
    adapter.read_exact(&mut commands[..8]).unwrap();
    let change = |arguments: &[&str]| {
        let run = agv(&[&["ctl", &service, "--key", &key], arguments].concat());
        assert!(run.status.success(), "{}", text(&run.stderr));
    };
    change(&["set", "vehicle.wheelbase", "1.234"]);
    change(&["store"]);
    change(&["reboot"]);
    running.hear("starts again");
    running.ports();
    // There is no laser.
    running.hear("fault 7300h: the laser is silent or faulty");
    let get_setting = agv(&["ctl", &service, "get", "vehicle.wheelbase", "--json"]);
    assert!(text(&get_setting.stdout).contains("1.234"), "{}", text(&get_setting.stderr));
    let host = format!("127.0.0.1:{status}");
    let start = Instant::now();
    let told = loop {
        let told: Value = serde_json::from_str(&get(&host, "/status")).unwrap();
        if told["starts"] == 2 {
            break told;
        }
        assert!(start.elapsed() < PATIENCE, "{told}");
    };
    assert!(told["laser"] != "sound" && told["is_localised"] == false, "{told}");
    let metrics = get(&host, "/metrics");
    assert!(
        metrics.contains("\nagv_localised 0\n") && metrics.contains("# TYPE agv_poses_total counter\nagv_poses_total "),
        "{metrics}"
    );
    assert!(metrics.contains("\nagv_level_metres +Inf\n"), "{metrics}");
    assert!(get(&host, "/").contains("<title>agv run</title>"));
    let (is_content, printed) = running.terminate();
    assert!(is_content && printed.contains("started again            1"), "{printed}");
}

#[test]
fn what_cannot_be_run_is_refused_in_one_line() {
    let files = Files::new();
    let refused = |text: &str| refusal(&["run", "--config", &files.write("vehicle.toml", text.as_bytes())]);
    assert!(refusal(&["run", "--config", &files.path("none.toml")]).contains("none.toml"));
    let wrong = refused("store = \"s\"\nbuss = \"can0\"\n");
    assert!(wrong.contains("vehicle.toml:2: ") && wrong.contains("buss"), "{wrong}");
    let wrong = refused("store = \"s\"\nbus = \"can:0\"\n");
    assert!(wrong.contains("slcan:/dev/ttyACM0"), "{wrong}");
    let wrong = refused("store = \"s\"\nbus = \"can0\"\n[real_time]\nbus_priority = 100\n");
    assert!(wrong.contains("vehicle.toml:4: ") && wrong.contains("from 1 to 99"), "{wrong}");
    let discrete = |lines: &str| refused(&format!("store = \"s\"\nbus = \"can0\"\n[discrete]\n{lines}\n"));
    let wrong = discrete("pose_valid = 3");
    assert!(wrong.contains("vehicle.toml:4: ") && wrong.contains("chip says of which one"), "{wrong}");
    let wrong = discrete("pose_valid = \"A\"\nfault = \"A\"");
    assert!(wrong.contains("vehicle.toml:5: ") && wrong.contains("line A is pose_valid already"), "{wrong}");
    let wrong = discrete("fault = \"A\"\ninverted = [\"reset\"]");
    assert!(wrong.contains("vehicle.toml:5: ") && wrong.contains("reset is no line"), "{wrong}");
    let wrong = discrete("chip = \"/dev/null\"\nfault = 3\n[status]\nlisten = \"127.0.0.1:0\"");
    assert!(wrong.contains("[discrete] fault, line 3: "), "{wrong}");
    let gyro = |lines: &str| refused(&format!("store = \"s\"\nbus = \"can0\"\n[gyro]\n{lines}\n"));
    let wrong = gyro("i2c = \"a\"\nspi = \"b\"");
    assert!(wrong.contains("vehicle.toml:5: ") && wrong.contains("not on both"), "{wrong}");
    let wrong = gyro("i2c = \"/dev/none\"\n[status]\nlisten = \"127.0.0.1:0\"");
    assert!(wrong.contains("[gyro] /dev/none: "), "{wrong}");
    let wrong = refused("store = \"/dev/null/s\"\nbus = \"can0\"\n[status]\nlisten = \"127.0.0.1:0\"\n");
    assert!(wrong.contains("/dev/null/s"), "{wrong}");
    let taken = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let text = format!("store = \"s\"\nbus = \"can0\"\n[status]\nlisten = \"{}\"\n", taken.local_addr().unwrap());
    assert!(refused(&text).contains("another address is set with listen in [status]"));
    assert!(refusal(&["run", "--demo", "--seconds", "0"]).contains("greater than zero"));
    for wrong in [&["run"][..], &["run", "--demo", "--config", "vehicle.toml"]] {
        assert_eq!(agv(wrong).status.code(), Some(2));
    }
}
