//! A NAV350 behind a bad network: 200 ms of jitter in each direction, and two of a hundred packets lost.
//!
//! The network is that of a Linux kernel, with its `netem`: of this machine where its kernel has that, else of
//! user-mode-linux, a kernel in an ordinary process, with this very test program inside.
#![cfg(target_os = "linux")]

use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use agv_core::geometry::difference;
use agv_core::measurement::Time;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::{Happening, Link};
use agv_host_sim::serve::nav350::{Drive, Nav350, Options, Turn};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_tests::user_mode_linux::{self, Kernel, PACKAGES};
use agv_tests::{is_on_path, skip};
use agv_wire::nav350::{Configuration, Revolution, SensorFrame};

const NAME: &str = "the_session_holds_on_a_bad_network";
/// Set for the program inside.
const INSIDE: &str = "AGV_BAD_NETWORK";
/// How long revolutions are received, s.
const SECONDS: f64 = 25.0;
/// Packets that are sent at least, so that the share of the lost ones can be told.
const PACKETS: u64 = 501;
/// How long it may take until one more arrives and that many are sent, s after the start.
const LONGEST: f64 = 70.0;
/// Delay of a packet in either direction, s: uniform between zero and this.
const JITTER: f64 = 0.2;
/// Packets as on Ethernet, one at a time, each with its own delay and its own fate. They keep their order, as behind a
/// queue or a radio.
const IN_ORDER: &str = "ip link set dev lo mtu 1500 gso_max_segs 1 up && \
                        tc qdisc add dev lo root netem delay 100ms 100ms loss 2% rate 100mbit";
/// They overtake each other, too.
const OUT_OF_ORDER: &str = "ip link set dev lo mtu 1500 gso_max_segs 1 up && \
                            tc qdisc add dev lo root netem delay 100ms 100ms loss 2%";

/// Runs a script in a network of its own, if this machine's kernel has what it takes.
fn in_namespace(script: &str) -> Command {
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--net", "sh", "-c", script]).stdin(Stdio::null());
    command
}

#[test]
fn the_session_holds_on_a_bad_network() {
    if std::env::var_os(INSIDE).is_some() {
        return inside();
    }
    if let Some(missing) = ["ip", "tc", "unshare"].into_iter().find(|program| !is_on_path(program)) {
        return skip(NAME, &format!("there is no {missing} (Debian packages iproute2 and util-linux)"));
    }
    hold_on(IN_ORDER);
    if std::env::var_os("AGV_LONG").is_some() {
        hold_on(OUT_OF_ORDER);
    }
}

fn hold_on(network: &str) {
    let program = std::env::current_exe().unwrap();
    let run = format!("{INSIDE}=1 '{}' --exact {NAME} --nocapture 2>&1", program.display());
    let has_netem = in_namespace(network).stderr(Stdio::null()).status().is_ok_and(|status| status.success());
    let output = if has_netem {
        let output = in_namespace(&format!("{network} && {run}; tc -s qdisc show dev lo")).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    } else if user_mode_linux::is_there() {
        in_user_mode_linux(network, &run)
    } else {
        return skip(NAME, &format!("the kernel has no netem, and the Debian packages {PACKAGES} are not there"));
    };
    println!("{output}");
    assert!(output.contains("1 passed"), "{output}");
    // The network was as bad as it should be.
    let count = |word: &str| -> u64 {
        let (before, after) = output.rsplit_once(word).unwrap_or_default();
        let text = if word == " pkt" { before.rsplit(' ').next() } else { after.split([',', ' ']).next() };
        text.and_then(|text| text.parse().ok()).unwrap_or_default()
    };
    let (sent, dropped) = (count(" pkt"), count("(dropped "));
    println!("{sent} packets, {dropped} lost");
    assert!(sent >= PACKETS && (sent / 200..sent / 15).contains(&dropped), "{sent} {dropped}");
}

fn in_user_mode_linux(network: &str, run: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("output");
    let lines = format!("( {network} && {run}; tc -s qdisc show dev lo ) > '{}' 2>&1", output.display());
    let kernel = Kernel { memory: 512, modules: &["sch_netem"], patience: 150, argument: None };
    let console = kernel.run(folder.path(), &lines);
    let said = std::fs::read_to_string(&output).unwrap_or_default();
    format!("{said}\n{console}")
}

/// A revolution that has arrived, and its turn of the drive.
struct Arrived {
    turn: usize,
    /// When its first beam was measured by the session, less when it was, s.
    error: f64,
    heard: Time,
}

/// The turn that a revolution is of, bit for bit.
fn turn_of(turns: &[Turn], revolution: &Revolution) -> Option<usize> {
    let scan = revolution.scan()?;
    let is_same = |turn: &Turn| {
        turn.ranges.len() == scan.ranges.len()
            && turn
                .ranges
                .iter()
                .zip(scan.ranges)
                .all(|(millimetres, range)| (*millimetres as f32 * 1e-3).to_bits() == range.to_bits())
    };
    let number = turns.iter().position(is_same)?;
    let turn = &turns[number];
    assert_eq!(scan.intensities, turn.remission);
    let reflectors = revolution.reflectors().expect("scan and reflectors come together").observations;
    assert_eq!(reflectors.len(), turn.reflectors.len());
    for (found, served) in reflectors.iter().zip(&turn.reflectors) {
        // The sensor tells whole millimetres and milliseconds.
        let range = f64::from(served.range);
        assert!((f64::from(found.range) - range).abs() < 0.8e-3);
        assert!(difference(found.bearing.into(), served.bearing.into()).abs() * range < 0.8e-3);
        let since_start = found.time.since(scan.start) - served.time.since(turn.start);
        assert!(since_start.abs() < 2.5e-3, "{since_start}");
    }
    Some(number)
}

/// Packets that the loopback interface has sent in this network.
fn sent_packets() -> u64 {
    let interfaces = std::fs::read_to_string("/proc/self/net/dev").unwrap();
    let loopback = interfaces.lines().find_map(|line| line.trim_start().strip_prefix("lo:"));
    let sent = loopback.and_then(|counts| counts.split_whitespace().nth(9));
    sent.and_then(|count| count.parse().ok()).expect("the loopback interface counts packets")
}

/// What runs on that network.
fn inside() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    let mut scenario = Scenario::read(&path).unwrap();
    scenario.laser.scans = true;
    scenario.laser.intensities = true;
    let recording = simulate(&scenario).unwrap().recording;
    let drive = Drive::new(&recording, SensorFrame::default()).unwrap();
    let turns = drive.turns().to_vec();
    let sensor = Nav350::new(drive, Options { stands: true, ..Options::default() });
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let is_stopped = AtomicBool::new(false);
    let clock = Clock::new(1.0);
    let mut link = Link::new(&address, Configuration::default(), clock);
    // The drive begins when the session is about to run; it runs on if the session is later.
    let begin = clock.now().offset(5.0);
    sensor.begin(Instant::now() + clock.until(begin));
    let (mut arrived, mut happenings): (Vec<Arrived>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut connected, mut lost) = (0, 0);
    std::thread::scope(|scope| {
        let _stop = StopOnDrop(&is_stopped);
        scope.spawn(|| sensor.serve(&listener, &is_stopped).unwrap());
        let mut end = begin.offset(SECONDS);
        loop {
            link.run(end, |time, happening| -> Result<(), std::convert::Infallible> {
                match happening {
                    Happening::Connected => connected += 1,
                    Happening::Lost(reason) => {
                        lost += 1;
                        happenings.push(format!("{:.1} s: lost: {reason}", time.since(begin)));
                    }
                    Happening::Report(report) => happenings.push(format!("{:.1} s: {report}", time.since(begin))),
                    Happening::Sent(_) | Happening::Received(_) => {}
                    Happening::Revolution(revolution) => {
                        let turn = turn_of(&turns, revolution).expect("the revolution is one of the drive");
                        let start = revolution.scan().unwrap().start;
                        // While the vehicle stands the first turn is repeated.
                        if turn > 0 {
                            let truth = begin.offset(turns[turn].start.since(turns[0].start));
                            arrived.push(Arrived { turn, error: start.since(truth), heard: time });
                        }
                    }
                }
                Ok(())
            })
            .unwrap();
            // A connection that was lost just then is to come back, too.
            let is_heard = arrived.last().is_some_and(|last| last.heard.since(begin) > SECONDS - 2.0);
            if (is_heard && sent_packets() >= PACKETS) || end.since(begin) > LONGEST {
                break;
            }
            end = end.offset(1.0);
        }
    });
    println!("{}", happenings.join("\n"));
    let last = arrived.last().expect("a revolution arrives").heard.since(begin);
    assert!(last > SECONDS - 2.0, "the session has not come back: {last}");
    let made = (last / 0.125) as usize;
    let share = arrived.len() as f64 / made as f64;
    println!("{connected} connections, {lost} lost; {} of {made} revolutions, {:.0} %", arrived.len(), 100.0 * share);
    let mut errors: Vec<f64> = arrived.iter().map(|one| one.error.abs()).collect();
    errors.sort_by(f64::total_cmp);
    let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
    println!("time of a revolution: median {:.0} ms, worst {:.0} ms", 1e3 * median, 1e3 * worst);
    assert!(arrived.len() >= 10, "{}", arrived.len());
    assert!(arrived.windows(2).all(|pair| pair[0].turn < pair[1].turn));
    assert!(connected - lost <= 1, "{connected} {lost}");
    assert!(worst < JITTER, "{worst}");
}

/// Ends threads even if the test panics, so that it fails instead of hanging.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
