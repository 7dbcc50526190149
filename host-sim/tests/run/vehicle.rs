//! Controllers with emulated encoders and an emulated laser: what they log replays to the same bits, what is stored survives a
//! restart, and what was lost comes back.

use std::f64::consts::TAU;
use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use agv_controller::GyroChipError;
use agv_core::geometry::Pose;
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, GyroSample, ReflectorObservation, Time};
use agv_core::state::LaserHealth;
use agv_host_sim::bus::{Bus, BusError, InProcessBus, InProcessNode};
use agv_host_sim::link::service::Client;
use agv_host_sim::live::stream::record_stream;
use agv_host_sim::provision::flash_image;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::run::{
    BusState, Demonstration, FLASH, GyroPort, KeptPose, Logs, Options, Ports, RealTime, RunError, Running, Summary, run,
};
use agv_host_sim::serve::nav350::{Drive, Nav350, Options as SensorOptions};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{simulate, standard};
use agv_host_sim::{log, replay};
use agv_settings::leaf::Value;
use agv_settings::{Settings, map_identity};
use agv_wire::can::frame::AnyFrame;
use agv_wire::nav350::SensorFrame;

/// How long anything may take on a machine that is busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits for an event.
pub fn wait(what: &str, mut has_come: impl FnMut() -> bool) {
    let start = Instant::now();
    while !has_come() {
        assert!(start.elapsed() < PATIENCE, "{what} has not come");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The hall without scans, which take long to simulate.
pub fn hall() -> Recording {
    let mut scenario: Scenario = toml::from_str(standard::HALL).unwrap();
    scenario.laser.scans = false;
    simulate(&scenario).unwrap().recording
}

/// Ends a run, also if what looks at it fails.
pub struct End(pub Arc<AtomicBool>);

impl Drop for End {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

fn drive(folder: &Path, log: &Path, watch: impl FnOnce(&Running) + Send) -> Summary {
    let is_stopped = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&is_stopped));
    let watch = move |running: &Running| {
        let _end = end;
        watch(running);
    };
    let remark = |text: &str| println!("{text}");
    let logs = Logs { whole: Some(log.to_owned()), ring: None };
    Demonstration::of(hall()).run(folder, RealTime::default(), logs, &is_stopped, &remark, watch).unwrap()
}

#[test]
fn the_log_of_a_drive_replays_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let [path, heard] = ["drive.agvlog", "heard.agvlog"].map(|name| folder.path().join(name));
    let mut is_busy = false;
    let summary = drive(&folder.path().join("store"), &path, |running| {
        let (is_heard, is_stopped) = (AtomicBool::new(false), Arc::new(AtomicBool::new(false)));
        std::thread::scope(|scope| {
            // A test that fails ends nevertheless.
            let _end = End(Arc::clone(&is_stopped));
            let listening = scope.spawn(|| {
                let begun = || is_heard.store(true, Ordering::Relaxed);
                record_stream(&running.log.to_string(), &heard, &is_stopped, begun, |_| ()).unwrap()
            });
            wait("the log", || is_heard.load(Ordering::Relaxed));
            wait("a pose", || running.condition().was_localised);
            let before = running.poses();
            wait("300 poses", || running.poses() > before + 300);
            is_stopped.store(true, Ordering::Relaxed);
            let listened = listening.join().unwrap();
            assert!(listened.records > 600, "{listened:?}");
        });
        let condition = running.condition();
        assert_eq!(condition.bus, BusState::Open, "{condition:?}");
        is_busy = condition.left_out != [0; 3];
    });
    assert!(summary.was_localised && summary.poses > 300 && summary.mode == "reflectors", "{summary:?}");
    assert!(summary.period_ms.p50 > 0.0 && summary.level_mm.is_some_and(|level| level < 500.0), "{summary:?}");
    // What was left out is in no log.
    if is_busy {
        return agv_tests::too_busy("the_log_of_a_drive_replays_to_the_same_bits");
    }
    let contents = log::read_contents(&path, |_| ()).unwrap();
    assert_eq!((contents.damages.len(), contents.recording.landmarks.len()), (0, hall().landmarks.len()));
    let again = replay::replay_in(&contents.recording, None, |_| ()).unwrap();
    let outputs = replay::compare(&contents.outputs, &again);
    let published = replay::compare_published(&contents.recording, &contents.publishing, &again);
    assert!(outputs.is_equal() && published.is_equal(), "{outputs:?} {published:?}");
    assert!(published.compared > 250, "{published:?}");
}

/// A node that breaks down when it is told to.
struct Breakable {
    node: InProcessNode,
    is_broken: Arc<AtomicBool>,
}

impl Breakable {
    fn check(&self) -> Result<(), BusError> {
        let is_broken = self.is_broken.load(Ordering::Relaxed);
        if is_broken { Err(BusError::Closed { name: "wire".to_owned() }) } else { Ok(()) }
    }
}

impl Bus for Breakable {
    fn send(&mut self, frame: &AnyFrame) -> Result<(), BusError> {
        self.check()?;
        self.node.send(frame)
    }

    fn receive(&mut self, deadline: Instant) -> Result<Option<AnyFrame>, BusError> {
        self.check()?;
        self.node.receive(deadline)
    }
}

const KEY: [u8; 32] = [7; 32];

/// Runs a controller with a store of these settings, which is written if there is none.
fn start(
    folder: &Path,
    settings: &Settings,
    change: impl FnOnce(&mut Options),
    watch: impl FnOnce(&Running) + Send,
) -> Result<(Summary, Vec<String>), RunError> {
    std::fs::create_dir_all(folder).unwrap();
    if !folder.join(FLASH).exists() {
        std::fs::write(folder.join(FLASH), flash_image(settings, &[], Some(&KEY)).unwrap()).unwrap();
    }
    let bus = InProcessBus::new();
    let mut options = Options {
        store: folder.to_owned(),
        open_bus: Box::new(move || Ok(Box::new(bus.join()))),
        lines: None,
        gyro: None,
        ports: Ports::Any,
        real_time: RealTime::default(),
        datagrams: Vec::new(),
        socket: None,
        logs: Logs::default(),
    };
    change(&mut options);
    let is_stopped = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&is_stopped));
    let remarks = Mutex::new(Vec::new());
    let note = |text: &str| remarks.lock().unwrap().push(text.to_owned());
    let watch = move |running: &Running| {
        // Whoever asked it to start again does not end it.
        let end = end;
        watch(running);
        if running.is_over() {
            std::mem::forget(end);
        }
    };
    let summary = run(options, &is_stopped, &note, watch)?;
    Ok((summary, remarks.into_inner().unwrap()))
}

fn settings_of_laser(port: u16) -> Settings {
    let mut settings = Settings::default();
    (settings.network.laser, settings.network.laser_port) = (Ipv4Addr::LOCALHOST.octets(), port);
    settings
}

#[test]
fn what_is_stored_over_the_service_port_survives_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let settings = settings_of_laser(1);
    let (summary, _) = start(
        folder.path(),
        &settings,
        |_| (),
        |running| {
            let mut client = Client::connect(&running.service.to_string(), Some(KEY)).unwrap();
            assert_eq!(client.version().unwrap().starts, 1);
            let refusal = client.incidents().unwrap_err().to_string();
            assert!(refusal.contains("[recording]"), "{refusal}");
            client.set("vehicle.wheelbase", Value::Number(1.234)).unwrap();
            client.set("can.publishing_period", Value::Whole(20)).unwrap();
            client.store().unwrap();
            client.reboot().unwrap();
            wait("the restart", || running.is_over());
        },
    )
    .unwrap();
    assert!(summary.is_restart_wanted);
    let (summary, remarks) = start(
        folder.path(),
        &settings,
        |_| (),
        |running| {
            let mut client = Client::connect(&running.service.to_string(), Some(KEY)).unwrap();
            assert_eq!((client.version().unwrap().starts, running.starts), (2, 2));
            assert_eq!(client.get("vehicle.wheelbase").unwrap().value, Value::Number(1.234));
            assert_eq!(client.get("can.publishing_period").unwrap().value, Value::Whole(20));
            wait("poses", || running.condition().poses > 10);
        },
    )
    .unwrap();
    assert!(!summary.is_restart_wanted && !summary.was_localised, "{summary:?}");
    assert!(summary.mode == "not localised" && summary.level_mm.is_none(), "{summary:?}");
    assert!(!remarks.iter().any(|remark| remark.starts_with("settings")), "{remarks:?}");
}

#[test]
fn a_bus_that_was_lost_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let (bus, is_broken) = (InProcessBus::new(), Arc::new(AtomicBool::new(true)));
    let (breaks, attempts) = (Arc::clone(&is_broken), Arc::new(AtomicUsize::new(0)));
    let counts = Arc::clone(&attempts);
    let change = move |options: &mut Options| {
        options.open_bus = Box::new(move || {
            counts.fetch_add(1, Ordering::Relaxed);
            let bus = Breakable { node: bus.join(), is_broken: Arc::clone(&breaks) };
            bus.check().map(|()| Box::new(bus) as Box<dyn Bus>)
        });
    };
    let (_, remarks) = start(folder.path(), &settings_of_laser(1), change, |running| {
        let is = |state| move || running.condition().bus == state;
        // A loss is told before the bus is tried again.
        let wait_for_attempt = || {
            let before = attempts.load(Ordering::Relaxed);
            wait("an attempt", || attempts.load(Ordering::Relaxed) > before);
        };
        // With the second attempt the first has failed, and was told.
        wait("the second attempt", || attempts.load(Ordering::Relaxed) > 1);
        for _ in 0..2 {
            is_broken.store(false, Ordering::Relaxed);
            wait("the bus", is(BusState::Open));
            let before = running.condition().poses;
            wait("poses", || running.condition().poses > before + 5);
            is_broken.store(true, Ordering::Relaxed);
            wait("the loss", is(BusState::Lost));
            wait_for_attempt();
        }
    })
    .unwrap();
    let lost: Vec<_> = remarks.iter().filter(|remark| remark.contains("wire")).collect();
    assert_eq!(lost.len(), 3, "one line for each loss: {remarks:?}");
}

#[test]
fn a_laser_that_was_gone_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let sensor = Nav350::new(Drive::new(&hall(), SensorFrame::default()).unwrap(), SensorOptions::default());
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let settings = settings_of_laser(listener.local_addr().unwrap().port());
    let (_, remarks) = start(
        folder.path(),
        &settings,
        |_| (),
        |running| {
            let is = |health| move || running.condition().laser == health;
            for _ in 0..2 {
                let is_gone = AtomicBool::new(false);
                std::thread::scope(|scope| {
                    scope.spawn(|| sensor.serve(&listener, &is_gone));
                    wait("the laser", is(LaserHealth::Sound));
                    is_gone.store(true, Ordering::Relaxed);
                });
                wait("its loss", is(LaserHealth::Silent));
            }
        },
    )
    .unwrap();
    let count = |word: &str| remarks.iter().filter(|remark| remark.contains(word)).count();
    assert!(count("connected") >= 2 && count("lost") >= 2, "{remarks:?}");
}

#[test]
fn poses_are_told_as_lines() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("pose");
    let receiver = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    receiver.set_read_timeout(Some(PATIENCE)).unwrap();
    let address: SocketAddr = receiver.local_addr().unwrap();
    let path = socket.clone();
    let change = move |options: &mut Options| {
        options.datagrams = vec![address];
        options.socket = Some(path);
    };
    // What an earlier start has left is no obstacle.
    drop(std::os::unix::net::UnixListener::bind(&socket).unwrap());
    start(folder.path(), &settings_of_laser(1), change, |_| {
        let mut bytes = [0; 2048];
        let count = receiver.recv(&mut bytes).unwrap();
        let datagram: serde_json::Value = serde_json::from_slice(&bytes[..count]).unwrap();
        let stream = UnixStream::connect(&socket).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let lines: Vec<String> = BufReader::new(stream).lines().take(3).map(Result::unwrap).collect();
        for line in lines {
            let told: serde_json::Value = serde_json::from_str(&line).unwrap();
            assert_eq!(told["mode"], "not localised", "{line}");
            assert!(told["level_m"].is_null() && told["alarm"] == "no_pose", "{line}");
            let keys = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
            assert_eq!(keys(&told), keys(&datagram));
        }
    })
    .unwrap();
}

#[test]
fn a_store_that_is_used_or_none_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let settings = settings_of_laser(1);
    start(
        folder.path(),
        &settings,
        |_| (),
        |_| {
            let second = start(folder.path(), &settings, |_| (), |_| panic!("it runs"));
            let refusal = second.err().unwrap().to_string();
            assert!(refusal.contains("another controller runs with this store"), "{refusal}");
        },
    )
    .unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let change = |options: &mut Options| options.store = file.clone();
    assert!(start(folder.path(), &settings, change, |_| panic!("it runs")).is_err());
}

/// A vehicle that stands among four reflectors which look the same from the other side.
fn among_equals(pose: Pose) -> Recording {
    let corners = [(6.0, 4.0), (-6.0, 4.0), (-6.0, -4.0), (6.0, -4.0)];
    let landmark = |(id, (x, y))| Landmark { id, kind: LandmarkKind::Reflector, x, y, deviation: 0.005 };
    let landmarks: Vec<Landmark> = (0..).zip(corners).map(landmark).collect();
    let frame = SensorFrame::default();
    let parameters = hall().parameters;
    let laser = pose.compose(parameters.lasers.first());
    let mut events = Vec::new();
    for turn in 0..8 {
        let start = Time::from_seconds(1.0 + 0.125 * f64::from(turn));
        events.push(RecordedEvent::Encoders(EncoderSample { time: start, drive: 1000, steering: 0 }));
        let see = |landmark: &Landmark| {
            let there = laser.between(&Pose::new(landmark.x, landmark.y, 0.0));
            let bearing = there.y.atan2(there.x);
            let time = start.offset(frame.interval(frame.angle(bearing).rem_euclid(TAU)));
            ReflectorObservation { time, range: there.x.hypot(there.y) as f32, bearing: bearing as f32 }
        };
        let mut seen: Vec<_> = landmarks.iter().map(see).collect();
        seen.sort_by_key(|one| one.time);
        events.push(RecordedEvent::Reflectors(seen.into()));
    }
    Recording { parameters, landmarks, events, truth: Vec::new(), references: Vec::new(), state: None }
}

#[test]
fn where_it_was_last_decides_between_equals_only_if_it_fits() {
    let folder = tempfile::tempdir().unwrap();
    let stands = Pose::new(1.0, 0.5, 0.3);
    let attempt = |kept: Option<Pose>| {
        let is_stopped = Arc::new(AtomicBool::new(false));
        let end = End(Arc::clone(&is_stopped));
        let remarks = Mutex::new(Vec::new());
        let note = |text: &str| remarks.lock().unwrap().push(text.to_owned());
        let map = map_identity(&among_equals(stands).landmarks);
        if let Some(kept) = kept {
            KeptPose::new(&kept, map).write(folder.path()).unwrap();
        }
        let mut pose = None;
        let watch = |running: &Running| {
            let _end = end;
            assert_eq!(running.map, map);
            // Whether it knows, or has had three seconds for it.
            wait("an answer", || running.condition().was_localised || running.poses() > 300);
            pose = running.condition().pose.filter(|_| running.condition().was_localised).map(|pose| pose.pose);
        };
        let demonstration = Demonstration::of(among_equals(stands));
        demonstration.run(folder.path(), RealTime::default(), Logs::default(), &is_stopped, &note, watch).unwrap();
        (pose, remarks.into_inner().unwrap())
    };
    let (pose, remarks) = attempt(None);
    assert_eq!(pose, None, "{remarks:?}");
    // It was moved to the other side and further: what it sees does not fit there.
    let (pose, remarks) = attempt(Some(Pose::new(3.0, 0.5, 0.3)));
    assert_eq!(pose, None, "{remarks:?}");
    let (pose, remarks) = attempt(Some(Pose::new(1.02, 0.48, 0.31)));
    let way = stands.between(&pose.unwrap_or_else(|| panic!("{remarks:?}")));
    assert!(way.x.hypot(way.y) < 0.05 && way.theta.abs() < 0.02, "{pose:?}");
    assert!(remarks.iter().any(|remark| remark.contains("two places look alike")), "{remarks:?}");
}

/// A gyro that turns at 0.125 rad/s from its tenth look on.
struct SteadyGyro(u32);

impl GyroPort for SteadyGyro {
    fn poll(&mut self, now: Time) -> Result<Option<GyroSample>, GyroChipError> {
        self.0 += 1;
        match self.0 {
            0..10 => Err(GyroChipError::Bus),
            _ => Ok(self.0.is_multiple_of(10).then_some(GyroSample { time: now, rate: 0.125 })),
        }
    }
}

#[test]
fn a_gyro_of_the_machine_is_heard_by_the_localiser() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("drive.agvlog");
    let mut settings = settings_of_laser(1);
    settings.parameters.gyro.is_fitted = true;
    let path = log.clone();
    let change = move |options: &mut Options| {
        options.logs.whole = Some(path);
        options.gyro = Some(Box::new(|_| Box::new(SteadyGyro(0))));
    };
    let (_, remarks) = start(folder.path(), &settings, change, |running| {
        wait("poses", || running.poses() > 50);
        wait("a sign of life of all threads", || running.have_all_run());
    })
    .unwrap();
    let said: Vec<_> = remarks.iter().filter(|remark| remark.starts_with("gyro: ")).collect();
    assert_eq!(said, ["gyro: it does not answer", "gyro: it tells its rate again"]);
    let events = log::read_contents(&log, |_| ()).unwrap().recording.events;
    let is_rate = |event: &&RecordedEvent| matches!(event, RecordedEvent::Gyro(sample) if sample.rate == 0.125);
    assert!(events.iter().filter(is_rate).count() > 10);
}
