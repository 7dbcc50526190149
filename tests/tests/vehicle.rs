//! The vehicle's firmware in emulation, on the bus and the network that it will have.
//!
//! Everything here takes real time, so what is asserted are values, and times only where the firmware must meet them with
//! a wide margin on a busy machine.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_core::geometry::Pose;
use agv_core::localizer::Event;
use agv_core::measurement::{EncoderFault, Time};
use agv_core::state::{LaserHealth, Mode, Relocalization};
use agv_host_sim::acceptance::{self, Halts, Verdict};
use agv_host_sim::drive::{Figures, Track};
use agv_host_sim::emulate::vehicle::{self, Driven, VehicleOptions, Watch};
use agv_host_sim::link::service::{Client, ServiceError};
use agv_host_sim::live::stream::StreamSummary;
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::Comparisons;
use agv_host_sim::simulate::scenario::{MotionReport, Scenario};
use agv_host_sim::simulate::simulate;
use agv_host_sim::{log, replay};
use agv_settings::leaf::Value;
use agv_settings::service::Refusal;
use agv_tests::sound_drive;

/// One emulator at a time: they work in real time.
static ALONE: Mutex<()> = Mutex::new(());

const KEY: [u8; 32] = [0x42; 32];

/// The image, and the right to run it. None, and a word about it, if it is missing or there is no emulator.
fn image(test: &str) -> Option<(PathBuf, MutexGuard<'static, ()>)> {
    let image = agv_tests::image(test, "an500", "vehicle").filter(|_| agv_tests::emulator(test))?;
    Some((image, ALONE.lock().unwrap_or_else(PoisonError::into_inner)))
}

/// The standard hall: reflectors everywhere.
fn hall() -> Recording {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios/warehouse_hall.toml");
    simulate(&Scenario::read(&path).unwrap()).unwrap().recording
}

struct Drive {
    driven: Driven,
    folder: tempfile::TempDir,
}

fn drive(image: &Path, recording: &Recording, seconds: f64, watch: impl FnOnce(&Watch) + Send) -> Drive {
    let folder = tempfile::tempdir().unwrap();
    let options = VehicleOptions { key: Some(KEY), ..VehicleOptions::new(image, folder.path()) };
    let driven = vehicle::drive(recording, &options, seconds, watch).unwrap();
    Drive { driven, folder }
}

/// What the firmware said is what the host says, bit for bit.
fn assert_replayed(drive: &Drive, least: usize) {
    let contents = log::read_contents(&drive.driven.log, |_| ()).unwrap();
    assert_eq!(drive.driven.stream.damages, 0);
    assert!(contents.damages.is_empty(), "{:?}", contents.damages);
    let again = replay::replay(&contents.recording, |_| ()).unwrap();
    let comparison = replay::compare(&contents.outputs, &again);
    assert_eq!(comparison.first_difference, None);
    assert!(comparison.compared >= least, "{}", comparison.compared);
    let published = replay::compare_published(&contents.recording, &contents.publishing, &again);
    assert_eq!(published.first_difference, None);
    assert!(published.compared >= least / 2, "{} poses were published", published.compared);
    let said = Comparisons { outputs: Some(comparison), published: Some(published) };
    let track = Track::new(&contents.recording, &again);
    let figures = Figures::new(&contents.recording, &again, &track);
    let lines = acceptance::test(&figures, &track, &contents.recording.landmarks, &said, &Halts::default());
    assert_eq!((&*lines[0].what, lines[0].verdict), ("the same bits", Verdict::Pass), "{lines:?}");
}

/// Waits until something is so, and says how long that took.
fn until(patience: f64, what: &str, mut is_so: impl FnMut() -> bool) -> f64 {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed().as_secs_f64() < patience, "{what}");
        std::thread::sleep(Duration::from_millis(2));
    }
    start.elapsed().as_secs_f64()
}

fn wait_for_drive(watch: &Watch, seconds: f64) {
    until(60.0 + seconds, "the vehicle does not drive", || {
        watch.is_over() || watch.driven().is_some_and(|driven| driven.as_secs_f64() >= seconds)
    });
}

/// A drive on a machine that keeps the encoders waiting for so long.
fn waiting(longest_stall: f64) -> Driven {
    let stream = StreamSummary::default();
    let (poses, emergencies) = (Vec::new(), Vec::new());
    let (begin, first) = (Instant::now(), Time::default());
    Driven {
        log: PathBuf::new(),
        stream,
        poses,
        emergencies,
        begin,
        first,
        longest_stall,
        longest_delay: 0.0,
        line_delays: Vec::new(),
        longest_laser_delay: 0.0,
    }
}

#[test]
fn a_wrong_drive_is_tried_again_only_where_the_machine_was_busy() {
    // How long each drive waits, and whether it is right; how many are made, and whether one is judged to be sound.
    let judged = |drives: &[(f64, bool)]| {
        let made = AtomicUsize::new(0);
        let drive = || {
            let (wait, is_right) = drives[made.fetch_add(1, Ordering::Relaxed)];
            (waiting(wait), is_right)
        };
        let sound =
            catch_unwind(AssertUnwindSafe(|| sound_drive("", drive, |drive| &drive.0, |drive| assert!(drive.1))));
        (made.into_inner(), sound.is_ok_and(|drive| drive.is_some()))
    };
    assert_eq!(judged(&[(0.1, true)]), (1, true));
    assert_eq!(judged(&[(0.02, false), (0.0, true)]), (2, true));
    assert_eq!(judged(&[(0.0, false), (0.0, true)]), (1, false));
    assert_eq!(judged(&[(0.02, false); 5]), (5, false));
}

#[test]
fn it_drives_through_the_hall() {
    let Some((image, _alone)) = image("it_drives_through_the_hall") else { return };
    let recording = hall();
    let seconds = if std::env::var_os("AGV_LONG").is_some() { f64::MAX } else { 20.0 };
    let judge = |drive: &Drive| {
        let errors = vehicle::errors(&drive.driven, &recording).unwrap();
        println!("{errors:?}");
        assert!(errors.poses > 1500 && errors.localised_share > 0.9, "{errors:?}");
        assert!(errors.position_p95_m < 0.02 && errors.heading_p95_deg < 0.1, "{errors:?}");
        assert!(agv_tests::faults(&drive.driven).is_empty(), "{:?}", drive.driven.emergencies);
    };
    let drive = || drive(&image, &recording, seconds, |_| ());
    let Some(drive) = sound_drive("it_drives_through_the_hall", drive, |drive| &drive.driven, judge) else { return };
    assert_replayed(&drive, 2000);
    let lines = firmware_log(&image, drive.folder.path());
    println!("{lines:#?}");
    assert!(lines.iter().any(|line| line.contains("72 landmarks")), "{lines:?}");
    check_stack(&lines);
}

/// Four counters, and a vehicle whose own controller tells its speed: chosen by settings alone, in the same image.
#[test]
fn vehicles_of_other_kinds_drive_through_the_hall() {
    const TEST: &str = "vehicles_of_other_kinds_drive_through_the_hall";
    let Some((image, _alone)) = image(TEST) else { return };
    for reports in [MotionReport::BiSteerable, MotionReport::TricycleSpeed] {
        let mut scenario = Scenario::read(Path::new("warehouse_hall")).unwrap();
        scenario.laser.scans = false;
        scenario.vehicle.reports = reports;
        let recording = simulate(&scenario).unwrap().recording;
        let judge = |drive: &Drive| {
            let errors = vehicle::errors(&drive.driven, &recording).unwrap();
            println!("{reports:?} {errors:?}");
            assert!(errors.poses > 900 && errors.localised_share > 0.9, "{reports:?} {errors:?}");
            assert!(errors.position_p95_m < 0.02 && errors.heading_p95_deg < 0.1, "{reports:?} {errors:?}");
            // Before, it has said that it does not know where it is, and that it has not stood for long enough to be told.
            let mut faults = agv_tests::faults(&drive.driven).into_iter();
            assert!(faults.all(|heard| heard.heard < drive.driven.begin), "{reports:?} {:?}", drive.driven.emergencies);
        };
        let drive = || drive(&image, &recording, 12.0, |_| ());
        let Some(drive) = sound_drive(TEST, drive, |drive| &drive.driven, judge) else { return };
        assert_replayed(&drive, 900);
        let given = first_given(&drive.driven).unwrap().between(&recording.truth[0].pose);
        assert!(given.x.hypot(given.y) < 0.05, "{reports:?}: it was said to be {given:?} beside its place");
    }
}

/// Where the controller was first said to be, by those who look on or by its own search.
fn first_given(driven: &Driven) -> Option<Pose> {
    let events = log::read_contents(&driven.log, |_| ()).unwrap().recording.events;
    events.iter().find_map(|event| match event.view() {
        Event::SetPose(fix) => Some(fix.pose),
        _ => None,
    })
}

/// What the firmware has logged, line by line.
fn firmware_log(image: &Path, folder: &Path) -> Vec<String> {
    let table = defmt_decoder::Table::parse(&std::fs::read(image).unwrap()).unwrap().unwrap();
    let mut decoder = table.new_stream_decoder();
    decoder.received(&std::fs::read(folder.join("defmt.bin")).unwrap());
    let mut lines = Vec::new();
    loop {
        match decoder.decode() {
            Ok(frame) => lines.push(frame.display(false).to_string()),
            Err(defmt_decoder::DecodeError::UnexpectedEof) => return lines,
            Err(defmt_decoder::DecodeError::Malformed) => lines.push("a line that is damaged".to_owned()),
        }
    }
}

/// The last two numbers that the firmware has said behind a word.
fn last_numbers(lines: &[String], word: &str) -> (usize, usize) {
    let mut said = lines.iter().rev().filter_map(|line| line.split_once(word));
    let (_, rest) = said.next().expect("the firmware says how deep its stack is");
    let numbers: Vec<usize> = rest.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    (numbers[0], numbers[1])
}

/// The deepest stack, as the firmware has measured it by painting, takes at most half of what is reserved while it runs, and nine
/// tenths while it builds its large values.
fn check_stack(lines: &[String]) {
    let (at_start, reserved) = last_numbers(lines, "stack at the start: ");
    println!("{:<24} {:>8}", "at the start, bytes", at_start);
    assert!(at_start > 1000 && at_start <= reserved / 10 * 9, "{at_start} of {reserved}");
    let (deepest, reserved) = last_numbers(lines, "stack: ");
    println!("{:<24} {:>8}", "deepest stack, bytes", deepest);
    println!("{:<24} {:>8}", "reserved", reserved);
    assert!(deepest > 1000 && deepest <= reserved / 2, "{deepest} of {reserved}");
}

#[test]
fn a_vehicle_that_is_told_nothing_finds_itself() {
    let Some((image, _alone)) = image("a_vehicle_that_is_told_nothing_finds_itself") else { return };
    let recording = hall();
    let told_nothing = || {
        let folder = tempfile::tempdir().unwrap();
        let options = VehicleOptions { is_told: false, ..VehicleOptions::new(&image, folder.path()) };
        let driven = vehicle::drive(&recording, &options, 5.0, |_| ()).unwrap();
        Drive { driven, folder }
    };
    let judge = |Drive { driven, .. }: &Drive| {
        assert!(driven.poses.first().is_some_and(|heard| heard.pose.mode == Mode::NotLocalised));
        let last = driven.poses.last().unwrap().pose;
        assert_eq!((last.mode, last.health.start_search), (Mode::Reflectors, Relocalization::Idle));
        let errors = vehicle::errors(driven, &recording).unwrap();
        println!("{errors:?}");
        // The machine may be busy: a wrong place would be metres away.
        assert!(errors.position_p95_m < 0.1, "{errors:?}");
    };
    let name = "a_vehicle_that_is_told_nothing_finds_itself";
    let Some(Drive { driven, folder }) = sound_drive(name, told_nothing, |drive| &drive.driven, judge) else { return };
    let found = |driven: &Driven| {
        let events = log::read_contents(&driven.log, |_| ()).unwrap().recording.events;
        events.iter().filter(|event| matches!(event.view(), Event::SetPose(_))).count()
    };
    assert_eq!(found(&driven), 1);
    assert_replayed(&Drive { driven, folder }, 300);
}

#[test]
fn trouble_is_said_on_the_bus_and_survived() {
    let Some((image, _alone)) = image("trouble_is_said_on_the_bus_and_survived") else { return };
    let recording = hall();
    let mut delays = Vec::new();
    let drive = drive(&image, &recording, 30.0, |watch| {
        let laser = |health| move || watch.pose().is_some_and(|heard| heard.pose.health.laser == health);
        wait_for_drive(watch, 2.0);

        // The laser's connection breaks, and nobody answers for a while.
        watch.is_laser_on.store(false, Ordering::Relaxed);
        delays.push(until(5.0, "the laser's silence", laser(LaserHealth::Silent)));
        std::thread::sleep(Duration::from_secs(1));
        watch.is_laser_on.store(true, Ordering::Relaxed);
        until(20.0, "the laser's return", laser(LaserHealth::Sound));

        // The driving wheel's encoder is silent.
        watch.trouble.is_drive_silent.store(true, Ordering::Relaxed);
        let is_missing = || watch.pose().is_some_and(|heard| heard.pose.health.drive == Some(EncoderFault::Missing));
        delays.push(until(5.0, "the encoder's silence", is_missing));
        let mode = watch.pose().unwrap().pose.mode;
        assert!(matches!(mode, Mode::WithoutOdometry | Mode::Lost), "{mode:?}");
        watch.trouble.is_drive_silent.store(false, Ordering::Relaxed);
        until(10.0, "the encoder's return", || watch.pose().is_some_and(|heard| heard.pose.health.drive.is_none()));

        // Frames with wrong bits: the positions that they say are not believed.
        watch.trouble.corrupted_in.store(7, Ordering::Relaxed);
        std::thread::sleep(Duration::from_secs(2));
        watch.trouble.corrupted_in.store(0, Ordering::Relaxed);
        let is_sound = || {
            watch.pose().is_some_and(|heard| heard.pose.health.drive.is_none() && heard.pose.health.steering.is_none())
        };
        until(10.0, "the encoders' recovery", is_sound);
        // Wrong counts may have led it astray, which it says; while it moves nobody may tell it where it is.
        until(20.0, "the pose's recovery, or that it is lost", || {
            matches!(watch.pose().map(|heard| heard.pose.mode), Some(Mode::Reflectors | Mode::Lost))
        });

        // The service port is flooded by two peers, and a third one opens connections without a word.
        let start = Instant::now();
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| flood(watch.ports.service, start));
            }
            scope.spawn(|| {
                let mut open = Vec::new();
                while start.elapsed().as_secs_f64() < 4.0 {
                    open.extend(TcpStream::connect(("127.0.0.1", watch.ports.service)));
                    std::thread::sleep(Duration::from_millis(50));
                }
            });
        });
        let poses = watch.poses_since(start);
        let worst = poses.windows(2).map(|pair| (pair[1].heard - pair[0].heard).as_secs_f64()).fold(0.0, f64::max);
        assert!(poses.len() > 200 && worst < 0.5, "{} poses, {worst} s", poses.len());
        assert!(!matches!(poses.last().unwrap().pose.mode, Mode::NotLocalised));
    });
    println!("{delays:?}");
    // 200 ms, and what a busy machine adds to the way through emulator and sockets.
    assert!(delays.iter().all(|delay| *delay < 0.3), "{delays:?}");
    let contents = log::read_contents(&drive.driven.log, |_| ()).unwrap();
    assert!(contents.recording.events.len() > 2000);
    let errors = vehicle::errors(&drive.driven, &recording).unwrap();
    assert!(errors.longest_gap_s < 0.5, "{errors:?}");
}

fn flood(port: u16, start: Instant) {
    let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { return };
    let _ = stream.set_write_timeout(Some(Duration::from_millis(100)));
    let _ = stream.set_read_timeout(Some(Duration::from_millis(1)));
    // The shortest question there is, again and again.
    let questions = [1_u8, 0, 0].repeat(1000);
    let mut answers = [0; 4096];
    while start.elapsed().as_secs_f64() < 4.0 {
        if stream.write(&questions).is_err() && stream.read(&mut answers).is_ok_and(|count| count == 0) {
            return;
        }
        let _ = stream.read(&mut answers);
    }
}

#[test]
fn it_is_commissioned_over_the_service_port() {
    const TEST: &str = "it_is_commissioned_over_the_service_port";
    let (Some((image, _alone)), Some(agv)) = (image(TEST), agv_tests::agv(TEST)) else { return };
    let recording = hall();
    let watch = |watch: &Watch| {
        let host = format!("127.0.0.1:{}", watch.ports.service);
        until(60.0, "poses", || watch.pose().is_some());
        // While the vehicle stands: everything can be read, and changed by who has the key.
        let mut reader = Client::connect(&host, None).unwrap();
        assert!(reader.version().unwrap().software.starts_with("agv-firmware"));
        let settings = reader.list().unwrap();
        let usual = agv_settings::Settings::default();
        assert_eq!(settings.len(), agv_settings::LEAVES.iter().filter(|leaf| leaf.matters(&usual)).count());
        assert_eq!(reader.download_map().unwrap(), recording.landmarks);
        assert!(matches!(reader.set("limits.fastest", Value::Number(3.0)), Err(ServiceError::NoKey)));
        drop(reader);
        wait_for_drive(watch, 2.0);
        let mut writer = Client::connect(&host, Some(KEY)).unwrap();
        let moving = writer.set("limits.fastest", Value::Number(3.0));
        assert!(matches!(moving, Err(ServiceError::Refused(Refusal::Moving))), "{moving:?}");
        assert_eq!(writer.get("limits.fastest").unwrap().value, Value::Number(5.0));
        let mut stranger = Client::connect(&host, Some([1; 32])).unwrap();
        let foreign = stranger.set("limits.fastest", Value::Number(3.0));
        assert!(matches!(foreign, Err(ServiceError::Refused(Refusal::Tag))), "{foreign:?}");
    };
    let judge = |drive: &Drive| {
        assert!(agv_tests::faults(&drive.driven).is_empty(), "{:?}", drive.driven.emergencies);
    };
    let drive = || drive(&image, &recording, 6.0, watch);
    let Some(Drive { folder, .. }) = sound_drive(TEST, drive, |drive| &drive.driven, judge) else { return };

    // A board that stands is given a map and a setting, and has them after a restart.
    let mut standing = recording.clone();
    standing.events.retain(|event| !matches!(event.view(), agv_core::localizer::Event::Encoders(_)));
    let (board, bus) = agv_host_sim::emulate::board::Board::start(&image, folder.path()).unwrap();
    drop(bus);
    let host = format!("127.0.0.1:{}", board.ports.service);
    let connect = |key| {
        let mut client = None;
        until(30.0, "the service port", || {
            client = Client::connect(&host, key).ok();
            client.is_some()
        });
        client.unwrap()
    };
    let mut client = connect(Some(KEY));
    let starts = client.version().unwrap().starts;
    client.set("limits.fastest", Value::Number(2.5)).unwrap();
    let map = &recording.landmarks[..60];
    client.upload_map(map, |_| ()).unwrap();
    drop(client);
    apply_and_reboot(&agv, &host, folder.path());
    let mut client = connect(Some(KEY));
    assert_eq!(client.version().unwrap().starts, starts + 1);
    assert_eq!(client.get("limits.fastest").unwrap().value, Value::Number(2.5));
    assert_eq!(client.get("vehicle.wheelbase").unwrap().value, Value::Number(1.482));
    assert_eq!(client.get("laser.theta").unwrap().value, Value::Number(0.007));
    assert_eq!(client.download_map().unwrap(), map);
    assert_eq!(client.last_panic().unwrap(), "");
}

/// Brings a file of the vehicle to a controller with the command, stores everything, and starts it again.
fn apply_and_reboot(agv: &Path, host: &str, folder: &Path) {
    let [vehicle, key] = ["vehicle.toml", "agv.key"].map(|name| folder.join(name).to_str().unwrap().to_owned());
    std::fs::write(&vehicle, "wheelbase_m = 1.482\nlaser_theta_rad = 0.007\n").unwrap();
    std::fs::write(&key, "42".repeat(32)).unwrap();
    let ctl = |words: &[&str]| {
        let run = std::process::Command::new(agv).args(["ctl", host, "--key", &key]).args(words).output().unwrap();
        assert!(run.status.success(), "{words:?}: {}", String::from_utf8_lossy(&run.stderr));
        String::from_utf8(run.stdout).unwrap()
    };
    let before = ctl(&["get", "vehicle.wheelbase"]);
    let shown = ctl(&["apply", &vehicle, "--dry-run"]);
    assert!(shown.contains("-> 1.482 m") && shown.contains("-> 0.007 rad"), "{shown}");
    assert_eq!(ctl(&["get", "vehicle.wheelbase"]), before);
    let done = ctl(&["apply", &vehicle]);
    assert!(done.contains("-> 1.482 m") && done.contains("reboot"), "{done}");
    assert!(ctl(&["apply", &vehicle]).contains("nothing differs"));
    ctl(&["store"]);
    ctl(&["reboot"]);
}

#[test]
fn a_port_that_another_took_is_chosen_again() {
    use agv_host_sim::emulate::board::{Board, BoardError, Ports};
    let Some((image, _alone)) = image("a_port_that_another_took_is_chosen_again") else { return };
    let folder = tempfile::tempdir().unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let free = || {
        let port = || std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        Ports { log: port(), service: port() }
    };
    let at_taken = Ports { service: taken.local_addr().unwrap().port(), ..free() };
    let mut asked = 0;
    let (mut board, _bus) = Board::start_at(&image, folder.path(), || {
        asked += 1;
        Ok(if asked == 1 { at_taken } else { free() })
    })
    .unwrap();
    assert!(board.is_running() && asked == 2 && board.ports.service != at_taken.service);
    drop(board);
    let refused = Board::start_at(&image, folder.path(), || Ok(at_taken)).err().unwrap();
    assert!(matches!(&refused, BoardError::Ended(words) if words.contains("host forwarding")), "{refused}");
}

#[test]
fn rubbish_in_flash_is_said_and_replaced() {
    let Some((image, _alone)) = image("rubbish_in_flash_is_said_and_replaced") else { return };
    let folder = tempfile::tempdir().unwrap();
    let rubbish: Vec<u8> = (0..262_144_u32).map(|place| (place.wrapping_mul(2_654_435_761) >> 23) as u8).collect();
    std::fs::write(folder.path().join("flash.bin"), &rubbish).unwrap();
    let (_board, mut bus) = agv_host_sim::emulate::board::Board::start(&image, folder.path()).unwrap();
    let (mut has_said_so, mut modes) = (false, Vec::new());
    let node = agv_wire::can::canopen::NodeId::new(16).unwrap();
    let mut receiver = agv_wire::can::controller::PoseReceiver::new(node);
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < 20.0 && (!has_said_so || modes.len() < 20) {
        use agv_host_sim::bus::Bus;
        use agv_wire::can::canopen::Message;
        let Some(frame) = bus.receive(Instant::now() + Duration::from_millis(100)).unwrap() else { continue };
        let frame = frame.classic().unwrap();
        if let Ok(Message::Emergency { emergency, .. }) = Message::decode(frame) {
            has_said_so |= emergency.code == 0x6300;
        }
        modes.extend(receiver.handle(frame).map(|pose| pose.mode));
    }
    assert!(has_said_so && modes.len() >= 20);
    assert!(modes.iter().all(|mode| *mode == Mode::NotLocalised), "{modes:?}");
    let replaced = std::fs::read(folder.path().join("flash.bin")).unwrap();
    assert!(replaced.iter().filter(|byte| **byte == 0xFF).count() > 250_000);
}
