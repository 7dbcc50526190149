//! Gives what bus and laser of a vehicle said, `tape.bin` of the emulating machine's folder, to the parts of a controller with the
//! parameters and the map of `drive.agvlog`, and writes what it sends on the bus to `sent.bin`.
//!
//! An entry of the tape is its kind (0: a step of the bus, 1: one that hears a frame, 2: the laser's connection is open, 3: a step of the
//! laser with the bytes that it hears), its time (8 bytes, us), the number of its bytes (2 bytes), and these: of a frame the identifier
//! (4 bytes) and its data. What is sent is written as its time, and the bytes of a frame in the same form, padded to 12. The lowest byte
//! comes first.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use agv_controller::{
    Bus, BusOutput, ChangeableSettings, ControllerIdentity, Estimate, Laser, Localization, TELEGRAM, Told, Troubles,
    carried_map,
};
use agv_core::localizer::Localizer;
use agv_core::measurement::Time;
use agv_core::record::Record;
use agv_core::state::Relocalization;
use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::log_file::LogBuffer;
use agv_firmware::board::an500::panic;
use agv_settings::Settings;
use agv_wire::can::frame::{Frame, Id, standard_id};
use agv_wire::nav350::{Revolution, SensorSpeed, Step};
use cortex_m_semihosting::{debug, hprintln};
use heapless::Vec;
use static_cell::{ConstStaticCell, StaticCell};

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    panic::report(info)
}

/// Bytes that the laser says at once, and events of one step of the bus.
const BYTES: usize = 32 * 1024;
const EVENTS: usize = 32;

static BUFFER: ConstStaticCell<LogBuffer> = ConstStaticCell::new(LogBuffer::new());
static ENTRY: ConstStaticCell<[u8; BYTES]> = ConstStaticCell::new([0; BYTES]);
static LOCALIZER: StaticCell<Localizer> = StaticCell::new();
static LASER: StaticCell<Laser<TELEGRAM>> = StaticCell::new();
static REVOLUTION: StaticCell<Revolution> = StaticCell::new();

struct Parts {
    settings: Settings,
    bus: Bus,
    laser: &'static mut Laser<TELEGRAM>,
    revolution: &'static mut Revolution,
    localization: Localization<&'static mut Localizer>,
    /// What the localiser has said that the bus has not heard.
    estimate: Option<Estimate>,
    speed: Option<SensorSpeed>,
    sent: HostFile,
    frames: u32,
}

impl Parts {
    fn step_bus(&mut self, now: Time, heard: Option<&Frame>) {
        let Self { settings, bus, laser, estimate, speed, sent, frames, .. } = self;
        if let Some(estimate) = estimate.take() {
            bus.update(&estimate);
        }
        let mut events: Vec<Told, EVENTS> = Vec::new();
        let mut take = |output: BusOutput| match output {
            BusOutput::Send(frame) => {
                *frames += 1;
                write(sent, now, &frame);
            }
            BusOutput::Event(told) => events.push(told).map_err(drop).expect("a step has few events"),
            BusOutput::Published(_) | BusOutput::Save(_) => {}
        };
        if let Some(frame) = heard {
            bus.hear(frame, now, &mut ChangeableSettings::new(settings), &mut take);
        }
        bus.poll(now, laser.health(now), &mut take);
        if let Some(told) = bus.laser_speed() {
            *speed = Some(told);
        }
        for told in &events {
            self.localization.hear(told, |_| ());
            self.estimate = Some(self.localization.estimate());
        }
        self.search();
    }

    fn step_laser(&mut self, now: Time, bytes: &[u8]) {
        if let Some(speed) = self.speed.take() {
            self.laser.set_speed(speed);
        }
        let mut rest = bytes;
        loop {
            let taken = self.laser.receive(rest, now);
            rest = rest.get(taken..).unwrap_or_default();
            loop {
                match self.laser.poll(now, self.revolution) {
                    Step::Wait(_) | Step::Connect => break,
                    Step::Disconnect(_) | Step::Send(_) | Step::Report(_) => {}
                    Step::Revolution => {
                        self.localization.revolution(self.revolution, |_| ());
                        self.estimate = Some(self.localization.estimate());
                    }
                }
                self.search();
            }
            if rest.is_empty() || taken == 0 {
                break;
            }
        }
    }

    fn search(&mut self) {
        loop {
            let before: Relocalization = self.localization.relocalization();
            let mut has_spoken = false;
            let is_busy = self.localization.search(|_| has_spoken = true);
            if has_spoken || self.localization.relocalization() != before {
                self.estimate = Some(self.localization.estimate());
            }
            if !is_busy {
                break;
            }
        }
    }
}

fn write(sent: &mut HostFile, now: Time, frame: &Frame) {
    let mut bytes = [0; 20];
    bytes[..8].copy_from_slice(&now.micros().to_le_bytes());
    if let Id::Standard(id) = frame.id() {
        bytes[8..12].copy_from_slice(&u32::from(id.as_raw()).to_le_bytes());
    }
    bytes[12..].copy_from_slice(&frame.padded());
    sent.write(&bytes).expect("the folder can be written");
}

/// The next entry of the tape: its kind, its time and its bytes. None at its end.
fn read<'a>(tape: &mut HostFile, bytes: &'a mut [u8; BYTES]) -> Option<(u8, Time, &'a [u8])> {
    let mut head = [0; 11];
    if tape.read(&mut head).expect("the tape can be read") < head.len() {
        return None;
    }
    let time = u64::from_le_bytes([head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8]]);
    let length = usize::from(u16::from_le_bytes([head[9], head[10]]));
    let room = bytes.get_mut(..length).expect("an entry has room");
    let length = tape.read(room).expect("the tape can be read");
    Some((head[0], Time::from_micros(time), &room[..length]))
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut log = HostFile::open(c"drive.agvlog").expect("drive.agvlog is in the folder");
    let mut tape = HostFile::open(c"tape.bin").expect("tape.bin is in the folder");
    let sent = HostFile::create(c"sent.bin").expect("the folder can be written");
    let mut made: Option<(Settings, &'static mut Localizer)> = None;
    let damages = BUFFER.take().for_each(&mut log, |record| match (record, &mut made) {
        (Record::Header(header), None) => {
            let localizer = LOCALIZER.init_with(|| Localizer::new(*header.parameters));
            made = Some((Settings::of(*header.parameters), localizer));
        }
        (Record::Landmarks(landmarks), Some((_, localizer))) => {
            localizer.add_landmarks(landmarks).expect("the map has room for the landmarks");
        }
        _ => {}
    });
    damages.expect("the log can be read");
    let (settings, localizer) = made.expect("a log begins with parameters");
    let map = carried_map(localizer.reflectors().landmarks());
    let identity = ControllerIdentity { hardware: "linux", serial: 0, map, stored: None };
    let entry = ENTRY.take();
    let mut next = read(&mut tape, entry);
    let start = next.as_ref().map_or(Time::default(), |(_, time, _)| *time);
    let localization = Localization::new(localizer, &settings);
    let mut parts = Parts {
        bus: Bus::new(&settings, identity, Troubles::default(), start),
        laser: LASER.init_with(|| Laser::new(settings.laser.configuration())),
        revolution: REVOLUTION.init_with(Revolution::new),
        estimate: Some(localization.estimate()),
        localization,
        settings,
        speed: None,
        sent,
        frames: 0,
    };
    while let Some((kind, now, bytes)) = next {
        match (kind, bytes) {
            (0, _) => parts.step_bus(now, None),
            (1, [a, b, c, d, data @ ..]) => {
                let id = u32::from_le_bytes([*a, *b, *c, *d]) as u16;
                let frame = Frame::new(standard_id(id), data).expect("a frame has at most 8 bytes");
                parts.step_bus(now, Some(&frame));
            }
            (2, _) => parts.laser.connected(now),
            (3, bytes) => parts.step_laser(now, bytes),
            _ => core::panic!("the tape has an entry of no kind"),
        }
        next = read(&mut tape, entry);
    }
    hprintln!("{} frames", parts.frames);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
