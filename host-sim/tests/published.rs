//! What a controller publishes while its localiser is busy is told again from its log, to the last bit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use std::collections::VecDeque;
use std::path::Path;

use agv_controller::{Bus, BusOutput, EncoderNodes, Localization, SentPose, Told, Troubles};
use agv_core::localizer::{Event, Localizer, PoseFix};
use agv_core::measurement::Time;
use agv_core::record::Record;
use agv_core::state::LaserHealth;
use agv_host_sim::emulate::gyro::EmulatedGyro;
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::log::{self, Writer};
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::replay::{compare, compare_published, replay};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::{START, simulate};
use agv_settings::Settings;
use agv_wire::can::controller_node::WithoutSettings;
use agv_wire::can::frame::Frame;

/// When the vehicle drives off, ms.
const BEGIN: u64 = 2_000;
/// When the program ends, ms.
const END: u64 = 12_000;
/// How long the localiser takes for a revolution, and for each fourth of them, ms: then there are more samples meanwhile than
/// the publisher has room for.
const BUSY: [u64; 2] = [35, 230];

/// A bus and a localiser that is not always there, as the tasks of a board are.
struct Board {
    bus: Bus,
    localization: Localization<Localizer>,
    told: VecDeque<Told>,
    published: VecDeque<SentPose>,
    is_answered: bool,
    frames: VecDeque<Frame>,
    writer: Writer,
}

impl Board {
    fn new(recording: &Recording, path: &Path) -> Self {
        let settings = Settings { start_search: false, ..Settings::of(recording.parameters) };
        let mut localizer = <Localizer>::new(settings.parameters);
        localizer.add_landmarks(&recording.landmarks).unwrap();
        Self {
            bus: Bus::new(&settings, "test", Troubles::default(), Time::default()),
            localization: Localization::new(localizer, &settings),
            told: VecDeque::new(),
            published: VecDeque::new(),
            is_answered: false,
            frames: VecDeque::new(),
            writer: Writer::begin(path, &settings.parameters, &recording.landmarks).unwrap(),
        }
    }

    /// What the bus does in a millisecond, whatever the localiser does.
    fn step_bus(&mut self, now: Time, motion: &mut EmulatedMotion, gyro: &mut Option<EmulatedGyro>) {
        if std::mem::take(&mut self.is_answered) {
            self.bus.update(&self.localization.estimate());
        }
        let Self { bus, told, published, frames, .. } = self;
        let mut answers = Vec::new();
        let mut take = |output| match output {
            BusOutput::Send(frame) => answers.push(frame),
            BusOutput::Event(event) => told.push_back(event),
            BusOutput::Published(pose) => published.push_back(pose),
            BusOutput::Save => panic!("nobody wants that"),
        };
        frames.extend(motion.poll(now));
        frames.extend(gyro.iter_mut().flat_map(|gyro| gyro.poll(now)));
        for frame in frames.drain(..) {
            bus.hear(&frame, now, &mut WithoutSettings, &mut take);
        }
        bus.poll(now, LaserHealth::Unknown, &mut take);
        for frame in answers {
            frames.extend(motion.handle(&frame));
        }
    }

    /// What the localiser does when it has time.
    fn step_localizer(&mut self) {
        let Self { localization, told, published, writer, is_answered, .. } = self;
        let mut write = |record: &Record| writer.write(record).unwrap();
        while let Some(next) = told.pop_front() {
            let before = next.progress.unwrap().told - 1;
            while let Some(pose) = published.pop_front_if(|pose| pose.progress.told <= before) {
                localization.published(&pose, &mut write);
            }
            localization.hear(&next, &mut write);
            *is_answered = true;
        }
        while let Some(pose) = published.pop_front_if(|pose| pose.progress.told <= localization.told()) {
            localization.published(&pose, &mut write);
        }
    }

    fn handle(&mut self, event: &Event) {
        let Self { localization, writer, .. } = self;
        localization.handle(event, |record| writer.write(record).unwrap());
        self.is_answered = true;
    }
}

/// Drives, and gives the log of what was said.
fn drive(recording: &Recording, path: &Path) {
    let nodes = EncoderNodes::of(&Settings::of(recording.parameters));
    let mut motion = EmulatedMotion::new(recording, &nodes).unwrap().standing();
    let mut gyro = EmulatedGyro::of(recording, &Settings::of(recording.parameters).gyro_frame);
    let mut board = Board::new(recording, path);
    let begin = Time::from_micros(1_000 * BEGIN);
    let mut seen = recording.events.iter().filter(|event| matches!(event, RecordedEvent::Reflectors(_))).peekable();
    let (mut busy_until, mut revolutions) = (0, 0);
    for millisecond in 1..END {
        let now = Time::from_micros(1_000 * millisecond);
        if now == begin {
            motion.begin(now);
            if let Some(gyro) = &mut gyro {
                gyro.begin(now);
            }
            let pose = recording.truth.first().unwrap().pose;
            board.handle(&Event::SetPose(PoseFix {
                time: now,
                pose,
                position_deviation: 0.05,
                heading_deviation: 0.01,
            }));
        }
        board.step_bus(now, &mut motion, &mut gyro);
        if millisecond < busy_until {
            continue;
        }
        board.step_localizer();
        let is_due = |event: &&RecordedEvent| {
            event.time().is_some_and(|time| begin.offset(time.since(START)) <= now && now >= begin)
        };
        if let Some(RecordedEvent::Reflectors(reflectors)) = seen.next_if(is_due) {
            let mut reflectors = reflectors.clone();
            for one in &mut reflectors.observations {
                one.time = begin.offset(one.time.since(START));
            }
            revolutions += 1;
            busy_until = millisecond + BUSY[usize::from(revolutions % 4 == 0)];
            board.handle(&RecordedEvent::Reflectors(reflectors).view());
            // It is answered when the time has passed.
            board.is_answered = false;
        } else if millisecond == busy_until {
            board.is_answered = true;
        }
    }
    board.writer.finish().unwrap();
}

#[test]
fn what_was_published_is_published_again() {
    assert_published_again(false);
}

#[test]
fn what_was_published_with_a_gyro_is_published_again() {
    assert_published_again(true);
}

fn assert_published_again(has_gyro: bool) {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/warehouse_hall.toml");
    let mut scenario = Scenario::read(&scenario).unwrap();
    scenario.laser.scans = false;
    scenario.gyro.fitted = has_gyro;
    let recording = simulate(&scenario).unwrap().recording;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.agvlog");
    drive(&recording, &path);
    let contents = log::read_contents(&path, |_| ()).unwrap();
    let again = replay(&contents.recording, |_| ()).unwrap();
    assert!(compare(&contents.outputs, &again).is_equal());
    let publishing = &contents.publishing;
    let late = publishing.poses.iter().filter(|pose| pose.published.behind > 1).count();
    let samples = contents.recording.events.iter().filter(|event| matches!(event, RecordedEvent::Encoders(_))).count();
    assert!(samples > 900, "{samples} samples");
    let rates = contents.recording.events.iter().filter(|event| matches!(event, RecordedEvent::Gyro(_))).count();
    assert_eq!(rates > 900, has_gyro, "{rates} rates");
    assert_eq!(contents.recording.parameters.gyro.is_fitted, has_gyro);
    println!("{} poses were published, {late} of them while the localiser was busy", publishing.poses.len());
    assert!(publishing.poses.len() > 900 && late > 100 && publishing.behind.len() > 100);
    let comparison = compare_published(&contents.recording, publishing, &again);
    assert_eq!(comparison.first_difference, None);
    assert_eq!(comparison.compared, publishing.poses.len());

    // Each pose is compared, with what it rests on.
    let mut other = publishing.clone();
    let last = other.poses.last_mut().unwrap();
    last.published.pose.pose.x += 1e-12;
    let events = last.events;
    assert_eq!(compare_published(&contents.recording, &other, &again).first_difference, Some(events));
    let mut other = publishing.clone();
    other.behind.clear();
    assert!(!compare_published(&contents.recording, &other, &again).is_equal());
}
