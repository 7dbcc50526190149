//! A controller whose localiser is busy for longer than the bus waits, on this machine: it writes the log that a vehicle writes.
#![allow(clippy::unwrap_used, clippy::panic, clippy::missing_panics_doc, reason = "a panic is how a test fails")]

use std::collections::VecDeque;
use std::path::Path;

use agv_controller::{Bus, BusOutput, ControllerIdentity, EncoderNodes, Localization, SentPose, Told, Troubles};
use agv_core::localizer::{Event, Localizer, PoseFix};
use agv_core::measurement::Time;
use agv_core::record::Record;
use agv_core::state::LaserHealth;
use agv_host_sim::emulate::gyro::EmulatedGyro;
use agv_host_sim::emulate::motion::EmulatedMotion;
use agv_host_sim::log::Writer;
use agv_host_sim::recording::{RecordedEvent, Recording};
use agv_host_sim::simulate::START;
use agv_settings::Settings;
use agv_wire::can::controller_node::WithoutSettings;
use agv_wire::can::frame::Frame;

/// When the vehicle drives off, ms.
const BEGIN: u64 = 2_000;
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
            bus: Bus::new(&settings, ControllerIdentity::default(), Troubles::default(), Time::default()),
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
            BusOutput::Save(_) => panic!("nobody wants that"),
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

/// Drives for some seconds from the pose that the recording is told, and writes the log of what was said.
pub fn drive(recording: &Recording, seconds: u64, path: &Path) {
    let nodes = EncoderNodes::of(&Settings::of(recording.parameters));
    let mut motion = EmulatedMotion::new(recording, &nodes).unwrap().standing();
    let mut gyro = EmulatedGyro::of(recording, &Settings::of(recording.parameters).gyro_frame);
    let mut board = Board::new(recording, path);
    let begin = Time::from_micros(1_000 * BEGIN);
    let mut seen = recording.events.iter().filter(|event| matches!(event, RecordedEvent::Reflectors(_))).peekable();
    let (mut busy_until, mut revolutions) = (0, 0);
    for millisecond in 1..BEGIN + 1_000 * seconds {
        let now = Time::from_micros(1_000 * millisecond);
        if now == begin {
            motion.begin(now);
            if let Some(gyro) = &mut gyro {
                gyro.begin(now);
            }
            let told = recording.events.iter().find_map(|event| match event {
                RecordedEvent::SetPose(fix) => Some(*fix),
                _ => None,
            });
            board.handle(&Event::SetPose(PoseFix { time: now, ..told.unwrap() }));
        }
        board.step_bus(now, &mut motion, &mut gyro);
        if millisecond < busy_until {
            continue;
        }
        board.step_localizer();
        let is_due = |event: &&RecordedEvent| {
            event.span().is_some_and(|(_, last)| begin.offset(last.since(START)) <= now && now >= begin)
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
