//! The emulated board on a real CAN interface of Linux: its serial line is an SLCAN adapter of user-mode-linux, where
//! `candump` hears its poses, this program's encoders move the vehicle, and `cansend` tells it where it is.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_host_sim::bus::{Bus, BusError, SocketCanBus};
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::emulate::vehicle::settings_like;
use agv_host_sim::import::candump::{Line, SeenFrame, log_line, parse_line};
use agv_host_sim::provision::flash_image;
use agv_host_sim::recording::Recording;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_tests::user_mode_linux::Kernel;
use agv_tests::{emulator, image, is_on_path, python, repository, skip};
use agv_wire::can::canopen::NodeId;
use agv_wire::can::controller::{Content, PoseReceiver, PublishedPose};
use agv_wire::can::frame::AnyFrame;
use serde_json::Value;

/// Names the interface to the program inside.
const INTERFACE: &str = "AGV_BOARD_INTERFACE";
const NAME: &str = "the_board_is_a_node_of_a_real_bus";
/// Where `candump` writes, in the folder that this names.
const FOLDER: &str = "AGV_BOARD_FOLDER";
/// Frames of that kernel come late, so encoders are heard every so many ms.
const ENCODER_PERIOD: u16 = 50;
const START: Pose = Pose { x: 12.5, y: -3.25, theta: 0.5 };

fn controller() -> NodeId {
    NodeId::new(16).unwrap()
}

fn drive() -> Recording {
    let mut scenario = Scenario::read(&repository("host-sim/scenarios/warehouse_hall.toml")).unwrap();
    scenario.laser.scans = false;
    simulate(&scenario).unwrap().recording
}

#[test]
fn the_board_is_a_node_of_a_real_bus() {
    if let Ok(interface) = std::env::var(INTERFACE) {
        return inside(&interface, Path::new(&std::env::var(FOLDER).unwrap()));
    }
    let Some(image) = image(NAME, "an500", "vehicle").filter(|_| emulator(NAME)) else { return };
    let programs = ["linux.uml", "insmod", "slcand", "candump", "cansend", "stty", "ip"];
    if let Some(missing) = programs.into_iter().find(|program| !is_on_path(program)) {
        return skip(NAME, &format!("there is no {missing}"));
    }
    let folder = tempfile::tempdir().unwrap();
    let recording = drive();
    let mut settings = settings_like(&recording, 2112);
    settings.encoder_period = ENCODER_PERIOD;
    let flash = flash_image(&settings, &recording.landmarks, None).unwrap();
    std::fs::write(folder.path().join("flash.bin"), flash).unwrap();
    let (board, terminal) = start_board(&image, folder.path());
    assert!(Command::new("stty").args(["-F", &terminal, "raw", "-echo"]).status().unwrap().success());
    let report = in_user_mode_linux(&terminal, folder.path());
    drop(board);
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap_or_default();
    assert_eq!(read("status").trim(), "0", "{report}\n{}", read("output"));
    check_candump(&read("candump.log"));
}

/// The emulator, which ends with this value.
struct Board(Child);

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The board with its serial line on a pseudo terminal, and the name of that.
fn start_board(image: &Path, folder: &Path) -> (Board, String) {
    let said = folder.join("qemu.txt");
    let file = std::fs::File::create(&said).unwrap();
    let child = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "pty"])
        .args(["-nic", "user,model=lan9118", "-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(file.try_clone().unwrap())
        .stderr(file)
        .spawn()
        .unwrap();
    let board = Board(child);
    let start = Instant::now();
    loop {
        let text = String::from_utf8_lossy(&std::fs::read(&said).unwrap()).into_owned();
        if let Some(place) = text.find("/dev/pts/") {
            let name: String = text[place..].chars().take_while(|letter| !letter.is_whitespace()).collect();
            return (board, name);
        }
        assert!(start.elapsed() < Duration::from_secs(30), "{text}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn in_user_mode_linux(terminal: &str, folder: &Path) -> String {
    let program = std::env::current_exe().unwrap();
    let place = folder.display();
    let lines = format!(
        "slcand -o -s6 -t hw ttyS0 can0\n\
         for i in 1 2 3 4 5 6 7 8 9 10; do ip link set can0 up txqueuelen 1000 && break; sleep 0.2; done\n\
         {INTERFACE}=can0 {FOLDER}='{place}' '{}' --exact {NAME} --nocapture > '{place}/output' 2>&1\n\
         echo $? > '{place}/status'",
        program.display(),
    );
    let modules = &["can", "can-raw", "can-dev", "slcan"];
    let serial_line = format!("ssl0=tty:{terminal}");
    Kernel { memory: 256, modules, patience: 150, argument: Some(&serial_line) }.run(folder, &lines)
}

/// What runs in user-mode-linux.
fn inside(interface: &str, folder: &Path) {
    let log = std::fs::File::create(folder.join("candump.log")).unwrap();
    let mut candump = Command::new("candump").args(["-L", interface]).stdout(log).spawn().unwrap();
    let node = |number| NodeId::new(number).unwrap();
    let nodes = EncoderNodes::new([1, 2, 3, 4].map(node), controller());
    let mut motion = EmulatedMotion::new(&drive(), &nodes).unwrap().standing();
    let mut bus = SocketCanBus::open(interface).unwrap();
    let mut receiver = PoseReceiver::new(controller());
    let start = Instant::now();
    let now = || Time::from_micros(1_000_000).offset(start.elapsed().as_secs_f64());
    let mut poses: Vec<PublishedPose> = Vec::new();
    let (mut told, mut begun): (Option<Instant>, Option<Instant>) = (None, None);
    // Frames wait for seconds in that kernel's queues, so the way is waited for, not a time.
    let way = |pose: &PublishedPose| (pose.pose.x - START.x).hypot(pose.pose.y - START.y);
    // Before it is told where it is, the vehicle is far from there.
    let has_driven = |pose: &PublishedPose, least: f64| (least..5.0).contains(&way(pose));
    while begun.is_none() || !poses.last().is_some_and(|pose| has_driven(pose, 1.5)) {
        assert!(start.elapsed() < Duration::from_secs(100), "{:?}", poses.last());
        for frame in motion.poll(now()) {
            send(&mut bus, &frame.into());
        }
        if let Some(frame) = bus.receive(Instant::now() + Duration::from_millis(2)).unwrap()
            && let Some(frame) = frame.classic()
        {
            for answer in motion.handle(frame) {
                send(&mut bus, &answer.into());
            }
            poses.extend(receiver.handle(frame));
        }
        let is_placed = poses.last().is_some_and(|pose| (pose.pose.x - START.x).abs() < 0.01);
        if begun.is_none() && is_placed {
            begun = Some(Instant::now());
            motion.begin(now());
        } else if begun.is_none()
            && motion.are_operational()
            && told.is_none_or(|told| told.elapsed() > Duration::from_secs(2))
        {
            told = Some(Instant::now());
            cansend_pose(interface, (start.elapsed().as_secs() % 16) as u8);
        }
    }
    // The other program is behind us, and its output is behind it.
    while !heard(folder).is_some_and(|pose| has_driven(&pose, 1.2)) {
        assert!(start.elapsed() < Duration::from_secs(120), "candump has not heard that the vehicle moves");
        for frame in motion.poll(now()) {
            send(&mut bus, &frame.into());
        }
        let _ = bus.receive(Instant::now() + Duration::from_millis(2));
    }
    let _ = candump.kill();
    let _ = candump.wait();
    println!("1 passed inside, {} poses", poses.len());
}

/// The last pose that `candump` has written.
fn heard(folder: &Path) -> Option<PublishedPose> {
    let text = std::fs::read_to_string(folder.join("candump.log")).ok()?;
    let mut receiver = PoseReceiver::new(controller());
    let frames = text.lines().filter_map(|line| match parse_line(line) {
        Some(Line::Frame(seen)) => seen.frame.classic().copied(),
        _ => None,
    });
    frames.filter_map(|frame| receiver.handle(&frame)).last()
}

/// Sends a frame; a queue that is full is no failure of the board.
fn send(bus: &mut SocketCanBus, frame: &AnyFrame) {
    for _ in 0..50 {
        match bus.send(frame) {
            Err(BusError::Io { .. }) => std::thread::sleep(Duration::from_millis(2)),
            outcome => return outcome.unwrap(),
        }
    }
}

/// Tells the vehicle where it is, through `cansend`.
fn cansend_pose(interface: &str, counter: u8) {
    let Pose { x, y, theta } = START;
    let contents = [
        Content::InitialPosition { x, y },
        Content::InitialHeading { heading: theta, position_deviation: 0.05, heading_deviation: 0.02 },
    ];
    for content in contents {
        let frame = content.encode(controller(), counter).into();
        let line = log_line(&SeenFrame { time: None, interface: interface.to_owned(), frame });
        let frame = line.split_whitespace().last().unwrap();
        assert!(Command::new("cansend").args([interface, frame]).status().unwrap().success());
    }
}

/// The poses that `candump` has heard, as our DBC decodes them in another program, move as the encoders did.
fn check_candump(log: &str) {
    let mut positions = Vec::new();
    let mut identifiers: BTreeMap<String, usize> = BTreeMap::new();
    let mut text = String::new();
    // The last line may be cut.
    for line in log.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n')) {
        let Some(Line::Frame(_)) = parse_line(line) else { continue };
        let frame = line.split_whitespace().last().unwrap();
        let Some((identifier, _)) = frame.split_once('#') else { continue };
        *identifiers.entry(identifier.to_owned()).or_default() += 1;
        if identifier == "190" {
            text.push_str(frame);
            text.push('\n');
        }
    }
    // Positions, headings, covariances and states of the controller; both encoders.
    for (identifier, least) in [("190", 100), ("290", 100), ("390", 100), ("490", 100), ("181", 10), ("182", 10)] {
        assert!(identifiers.get(identifier).is_some_and(|count| *count > least), "{identifiers:?}");
    }
    let Some(mut python) = python(NAME, "cantools, canopen") else { return };
    let mut python = python
        .arg(repository("agv/tests/can/agv_description.py"))
        .args([repository("docs/agv.dbc"), repository("docs/agv.eds")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = python.stdin.take().unwrap();
    let writer = std::thread::spawn(move || input.write_all(text.as_bytes()));
    let output = python.wait_with_output().unwrap();
    let _ = writer.join();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let decoded: Value = serde_json::from_str(line).unwrap();
        positions.push([&decoded["signals"]["X"], &decoded["signals"]["Y"]].map(|number| number.as_f64().unwrap()));
    }
    let placed: Vec<_> = positions.iter().filter(|[x, _]| *x > 1.0).collect();
    let ([first_x, first_y], [last_x, last_y]) = (placed[0], placed[placed.len() - 1]);
    assert!((first_x - START.x).abs() < 0.1 && (first_y - START.y).abs() < 0.1, "{first_x} {first_y}");
    // Along the heading that it was told.
    let heading = (last_y - first_y).atan2(last_x - first_x);
    assert!((last_x - first_x).hypot(last_y - first_y) > 1.0 && (heading - START.theta).abs() < 0.1, "{heading}");
}
