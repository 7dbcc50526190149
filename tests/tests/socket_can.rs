//! Real SocketCAN: our buses, `candump`, `cansend` and emulated encoders on the CAN stack of a Linux kernel.
//!
//! Where this machine's kernel has `vcan` and lets us use it, the test runs there. Elsewhere it starts user-mode-linux,
//! a kernel in an ordinary process, with this very test program inside.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use agv_core::measurement::Time;
use agv_core::odometry::{Counted, CounterRange};
use agv_host_sim::bus::{Bus, SocketCanBus};
use agv_host_sim::emulate::encoder::EmulatedEncoder;
use agv_host_sim::import::candump::{Line, parse_line};
use agv_tests::user_mode_linux::{self, Kernel, PACKAGES};
use agv_tests::{is_on_path, skip};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::encoder::EncoderSettings;
use agv_wire::can::encoder_group::{ChannelSettings, EncoderGroup};
use agv_wire::can::frame::{AnyFrame, FdFrame, Frame, extended_id, standard_id};
use agv_wire::can::plausibility::PlausibilityLimits;

/// Names the interface to the program inside.
const INTERFACE: &str = "AGV_CAN_INTERFACE";
/// Longer than anything here takes on a slow machine.
const PATIENCE: Duration = Duration::from_secs(60);

fn runs(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[test]
fn the_bus_works_on_a_real_can_stack() {
    const NAME: &str = "the_bus_works_on_a_real_can_stack";
    if let Ok(interface) = std::env::var(INTERFACE) {
        return on_interface(&interface);
    }
    if let Some(missing) = ["candump", "cansend", "ip"].into_iter().find(|program| !is_on_path(program)) {
        return skip(NAME, &format!("there is no {missing} (Debian packages can-utils and iproute2)"));
    }
    let vcan = format!("agv{}", std::process::id() % 100_000);
    if runs("ip", &["link", "add", "dev", &vcan, "mtu", "72", "type", "vcan"]) {
        let is_up = runs("ip", &["link", "set", &vcan, "up"]);
        let outcome = std::panic::catch_unwind(|| on_interface(&vcan));
        runs("ip", &["link", "delete", &vcan]);
        assert!(is_up && outcome.is_ok());
    } else if user_mode_linux::is_there() {
        in_user_mode_linux(NAME);
    } else {
        skip(NAME, &format!("the kernel has no vcan, and the Debian packages {PACKAGES} are not there"));
    }
}

fn in_user_mode_linux(test: &str) {
    let folder = tempfile::tempdir().unwrap();
    let program = std::env::current_exe().unwrap();
    let (status, output) = (folder.path().join("status"), folder.path().join("output"));
    let lines = format!(
        "ip link add dev vcan0 mtu 72 type vcan && ip link set vcan0 up\n\
         {INTERFACE}=vcan0 '{}' --exact {test} --nocapture > '{}' 2>&1\n\
         echo $? > '{}'",
        program.display(),
        output.display(),
        status.display()
    );
    let modules = &["can", "can-raw", "can-dev", "vcan"];
    let console = Kernel { memory: 256, modules, patience: 120, argument: None }.run(folder.path(), &lines);
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let report = format!("{console}\n{}", read(&output));
    assert_eq!(read(&status).trim(), "0", "{report}");
    assert!(read(&output).contains("1 passed"), "{report}");
}

fn on_interface(interface: &str) {
    both_ways(interface);
    candump_sees_what_we_send(interface);
    cansend_is_heard(interface);
    encoders_are_set_up_and_read(interface);
}

fn frames() -> Vec<AnyFrame> {
    vec![
        Frame::of(standard_id(0x181), [0xEF, 0xCD, 0xAB, 0]).into(),
        Frame::of(extended_id(0x1234_5678), [1, 2, 3, 4, 5, 6, 7, 8]).into(),
        Frame::of(extended_id(0x7), []).into(),
        Frame::remote(standard_id(0x701), 1).unwrap().into(),
        FdFrame::new(standard_id(0x213), &[0x11; 12], true).unwrap().into(),
        FdFrame::new(extended_id(0x1FFF_FFFF), &[0xA5; 64], false).unwrap().into(),
    ]
}

fn both_ways(interface: &str) {
    let mut buses = [SocketCanBus::open(interface).unwrap(), SocketCanBus::open(interface).unwrap()];
    for frame in frames() {
        for (from, to) in [(0, 1), (1, 0)] {
            buses[from].send(&frame).unwrap();
            assert_eq!(buses[to].receive(Instant::now() + PATIENCE).unwrap(), Some(frame));
        }
    }
    assert_eq!(buses[0].receive(Instant::now()).unwrap(), None);
    assert!(SocketCanBus::open("nocan77").is_err());
}

fn candump_sees_what_we_send(interface: &str) {
    let mut candump = Command::new("candump").args(["-L", interface]).stdout(Stdio::piped()).spawn().unwrap();
    let (sender, lines) = mpsc::channel();
    let output = BufReader::new(candump.stdout.take().unwrap());
    let reader =
        std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    let mut bus = SocketCanBus::open(interface).unwrap();
    let marker: AnyFrame = Frame::of(standard_id(0x7EE), [0x55]).into();
    let end = Instant::now() + PATIENCE;
    // It listens when it shows the first marker.
    while lines.recv_timeout(Duration::from_millis(50)).is_err() {
        assert!(Instant::now() < end, "candump shows nothing");
        bus.send(&marker).unwrap();
    }
    for frame in frames() {
        bus.send(&frame).unwrap();
    }
    let mut seen = Vec::new();
    while seen.len() < frames().len() {
        let line = lines.recv_timeout(end.saturating_duration_since(Instant::now())).unwrap();
        let Some(Line::Frame(frame)) = parse_line(&line) else { panic!("{line}") };
        assert_eq!(frame.interface, interface);
        if frame.frame != marker {
            seen.push(frame.frame);
        }
    }
    candump.kill().unwrap();
    candump.wait().unwrap();
    let _ = reader.join().unwrap();
    // This candump does not write how many bytes a remote frame asks for.
    let shown: Vec<AnyFrame> = frames()
        .into_iter()
        .map(|frame| match frame.classic() {
            Some(remote) if remote.is_remote() && seen.contains(&Frame::remote(remote.id(), 0).unwrap().into()) => {
                Frame::remote(remote.id(), 0).unwrap().into()
            }
            _ => frame,
        })
        .collect();
    assert_eq!(seen, shown);
}

fn cansend_is_heard(interface: &str) {
    let mut bus = SocketCanBus::open(interface).unwrap();
    for (text, frame) in [
        ("181#EFCDAB00", AnyFrame::from(Frame::of(standard_id(0x181), [0xEF, 0xCD, 0xAB, 0]))),
        ("1F334455#1122", Frame::of(extended_id(0x1F33_4455), [0x11, 0x22]).into()),
        ("701#R", Frame::remote(standard_id(0x701), 0).unwrap().into()),
        ("213##1AABB", FdFrame::new(standard_id(0x213), &[0xAA, 0xBB], true).unwrap().into()),
    ] {
        assert!(runs("cansend", &[interface, text]), "{text}");
        assert_eq!(bus.receive(Instant::now() + PATIENCE).unwrap(), Some(frame), "{text}");
    }
}

fn encoders_are_set_up_and_read(interface: &str) {
    let start = Instant::now();
    let now = || Time::from_micros(start.elapsed().as_micros() as u64);
    let node = |number| NodeId::new(number).unwrap();
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut bus = SocketCanBus::open(interface).unwrap();
            let mut encoders = [1, 2].map(|number| EmulatedEncoder::new(node(number), CounterRange::BITS_24));
            encoders[0].set_position(123_456);
            encoders[1].set_position(16_777_215);
            while !is_over.load(Ordering::Relaxed) && start.elapsed() < PATIENCE {
                for encoder in &mut encoders {
                    while let Some(frame) = encoder.poll(now()) {
                        bus.send(&frame.into()).unwrap();
                    }
                }
                let Some(frame) = bus.receive(Instant::now() + Duration::from_millis(1)).unwrap() else { continue };
                for encoder in &mut encoders {
                    if let Some(answer) = frame.classic().and_then(|frame| encoder.handle(frame)) {
                        bus.send(&answer.into()).unwrap();
                    }
                }
            }
        });
        // Only values are judged: a busy machine may be late by any time.
        let patient =
            PlausibilityLimits { late_after: 60.0, missing_after: 60.0, ..PlausibilityLimits::every(0.010, 1e6, 1e6) };
        let channel = |number, counted| ChannelSettings {
            encoder: EncoderSettings { answer_timeout: 2.0, heartbeat: 0, ..EncoderSettings::new(node(number)) },
            limits: patient,
            counted,
        };
        let channels = [channel(1, Counted::Turn), channel(2, Counted::Steering)];
        let mut group = EncoderGroup::new(&channels, 0.01, now());
        let mut bus = SocketCanBus::open(interface).unwrap();
        let mut samples = 0;
        while samples < 20 && start.elapsed() < PATIENCE {
            while let Some(frame) = group.poll(now()) {
                bus.send(&frame.into()).unwrap();
            }
            let Some(frame) = bus.receive(Instant::now() + Duration::from_millis(1)).unwrap() else { continue };
            if let Some(sample) = frame.classic().and_then(|frame| group.handle(frame, now())) {
                assert_eq!(sample.counts, [123_456, 16_777_215, 0, 0]);
                samples += 1;
            }
        }
        is_over.store(true, Ordering::Relaxed);
        assert_eq!(samples, 20);
        for encoder in group.encoders() {
            assert_eq!(encoder.identity().map(|identity| identity.range), Some(CounterRange::BITS_24));
        }
    });
}
