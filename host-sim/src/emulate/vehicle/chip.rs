//! A drive in virtual time: the controller is a program that emulates its chip, and that is told what encoders and laser say.
//!
//! A millisecond after the other, the program is given a line of JSON with what is said to the chip, and answers with what the
//! chip has said. So nothing depends on how fast this machine is.

use std::io::{BufRead, BufReader, Cursor, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::measurement::Time;
use agv_core::state::Mode;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::PoseReceiver;
use agv_wire::can::frame::{Frame, Id, standard_id};
use agv_wire::nav350::SensorFrame;
use serde::{Deserialize, Serialize};

use super::stage::{BETWEEN_ORDERS, FIRST_NODE, LEAD, PATIENCE, initial_pose};
use super::{Driven, HeardEmergency, HeardPose, VehicleError, own_nodes, settings_like, write_contours, write_flash};
use crate::contour_map::ContourMap;
use crate::emulate::board::{ADDRESS, HOST};
use crate::emulate::foreign_traffic::ForeignTraffic;
use crate::emulate::gyro::EmulatedGyro;
use crate::emulate::motion::EmulatedMotion;
use crate::live::stream::LogCopy;
use crate::log::Reader;
use crate::recording::{Recording, truth_or_stand_at};
use crate::serve::nav350::{Connection, Drive, Sensor, SensorClockOptions};

/// Port of the laser.
const LASER_PORT: u16 = 2111;
/// Step of the time, us.
const STEP: u64 = 1_000;

/// What the program is told first.
#[derive(Serialize)]
struct Vehicle<'a> {
    /// The settings' flash.
    flash: &'a Path,
    /// That of the map of contours, if there is one.
    contours: Option<&'a Path>,
    controller: [u8; 4],
    host: [u8; 4],
    laser_port: u16,
    log_port: u16,
}

/// What is said to the chip, and until when it runs, us. Bytes are hexadecimal.
#[derive(Serialize)]
struct Said {
    until: u64,
    frames: Vec<SaidFrame>,
    laser: String,
}

/// A frame as its identifier, whether that has 29 bits, whether it asks for data, and its data.
type SaidFrame = (u32, bool, bool, String);

/// What the chip has said.
#[derive(Deserialize)]
struct Answer {
    /// Times, us, identifiers, bytes.
    frames: Vec<(u64, u32, String)>,
    /// Whether the laser's connection is another one than before.
    is_connected_anew: bool,
    laser: String,
    log: String,
    /// Why it runs no more.
    ended: Option<String>,
}

/// How much of its stack the program in the chip has used.
#[derive(Deserialize)]
struct Used {
    /// Bytes.
    stack: u32,
}

/// The program that emulates the chip.
struct Chip {
    child: Child,
    answers: BufReader<std::process::ChildStdout>,
}

impl Chip {
    fn start(mut program: Command, vehicle: &Vehicle) -> Result<Self, VehicleError> {
        let mut child = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let answers = child.stdout.take().ok_or_else(|| std::io::Error::other("the program has no output"))?;
        let mut chip = Self { child, answers: BufReader::new(answers) };
        chip.tell(&serde_json::to_string(vehicle).map_err(std::io::Error::from)?)?;
        Ok(chip)
    }

    fn tell(&mut self, line: &str) -> std::io::Result<()> {
        let input = self.child.stdin.as_mut().ok_or_else(|| std::io::Error::other("the program has no input"))?;
        writeln!(input, "{line}")
    }

    fn ask<T: for<'a> Deserialize<'a>>(&mut self, line: &str) -> std::io::Result<T> {
        self.tell(line)?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        Ok(serde_json::from_str(&answer)?)
    }

    fn stack(&mut self) -> std::io::Result<u32> {
        Ok(self.ask::<Used>(r#"{"until": null}"#)?.stack)
    }

    fn step(&mut self, said: &Said) -> Result<Answer, VehicleError> {
        let answer: Answer = self.ask(&serde_json::to_string(said).map_err(std::io::Error::from)?)?;
        match answer.ended {
            Some(why) => Err(VehicleError::Chip(why)),
            None => Ok(answer),
        }
    }
}

impl Drop for Chip {
    fn drop(&mut self) {
        // It ends with its input; one that does not is ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(text: &str) -> Result<Vec<u8>, VehicleError> {
    let byte = |digits: &[u8]| u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok();
    let bytes: Option<Vec<u8>> = text.as_bytes().chunks(2).map(byte).collect();
    bytes.ok_or_else(|| VehicleError::Chip(format!("{text} are no bytes")))
}

/// The sensors, and what was heard of the controller.
struct Play<'a> {
    recording: &'a Recording,
    is_told: bool,
    controller: NodeId,
    motion: EmulatedMotion,
    gyro: Option<EmulatedGyro>,
    sensor: Sensor,
    connection: Option<Connection>,
    receiver: PoseReceiver,
    /// The time of the recording at which the drive begins.
    first: Time,
    /// When it begins, us since power came.
    begin: Option<u64>,
    last_order: u64,
    orders: u8,
    foreign: ForeignTraffic,
    foreign_rate: f64,
    /// Frames of other nodes that are due.
    foreign_due: f64,
    frames: Vec<Frame>,
    laser: Vec<u8>,
    log: Vec<u8>,
    origin: Instant,
    poses: Vec<HeardPose>,
    emergencies: Vec<HeardEmergency>,
}

/// What a drive in the emulated chip has brought.
pub struct InChip {
    /// The drive.
    pub driven: Driven,
    /// Bytes of the stack that were used since the program's loop began.
    pub stack: u32,
}

/// What is in the chip beside the reflectors of the recording, and what it is told.
#[derive(Clone, Copy, Default)]
pub struct InChipOptions<'a> {
    /// The map of contours.
    pub contours: Option<&'a ContourMap>,
    /// Whether it has to find out where it is.
    pub is_not_told: bool,
    /// Frames of other nodes in each second, from when the drive begins.
    pub foreign_rate: f64,
}

/// Lets the vehicle drive for `seconds` of a recording, or to its end, with the controller that `program` emulates. Settings, map and
/// log are in `folder`.
///
/// # Errors
/// [`VehicleError`] if something does not begin or breaks down.
pub fn drive_in_chip(
    recording: &Recording,
    program: Command,
    folder: &Path,
    seconds: f64,
    options: InChipOptions,
) -> Result<InChip, VehicleError> {
    let settings = settings_like(recording, LASER_PORT);
    let flash = write_flash(folder, &settings, &recording.landmarks, None)?;
    let contours = write_contours(folder, options.contours)?;
    let log_port = settings.network.log_port;
    let vehicle = Vehicle {
        flash: &flash,
        contours: contours.as_deref(),
        controller: ADDRESS,
        host: HOST,
        laser_port: LASER_PORT,
        log_port,
    };
    let mut chip = Chip::start(program, &vehicle)?;
    let sensor_drive = Drive::new(recording, SensorFrame::default())?;
    let controller = NodeId::new(settings.nodes.controller).unwrap_or(FIRST_NODE);
    let mut play = Play {
        recording,
        is_told: !options.is_not_told,
        controller,
        motion: EmulatedMotion::new(recording, &EncoderNodes::of(&settings))?.standing(),
        gyro: EmulatedGyro::of(recording, &settings.gyro_frame),
        first: sensor_drive.turns().first().map_or(Time::default(), |turn| turn.start),
        sensor: Sensor::new(sensor_drive, SensorClockOptions::default(), None, true),
        connection: None,
        receiver: PoseReceiver::new(controller),
        begin: None,
        last_order: 0,
        orders: 0,
        foreign: ForeignTraffic::new(1, &own_nodes(&settings)),
        foreign_rate: options.foreign_rate,
        foreign_due: 0.0,
        frames: Vec::new(),
        laser: Vec::new(),
        log: Vec::new(),
        origin: Instant::now(),
        poses: Vec::new(),
        emergencies: Vec::new(),
    };
    let length = (1e6 * seconds.min(play.motion.duration())) as u64;
    for step in 1.. {
        let until = step * STEP;
        let said = play.said(until);
        let answer = chip.step(&said)?;
        play.take(&answer, until)?;
        if play.begin.is_some_and(|begin| until > begin + length) {
            break;
        }
        if play.begin.is_none() && Duration::from_micros(until) > PATIENCE {
            return Err(VehicleError::NotLocalised(play.mode()));
        }
    }
    let stack = chip.stack()?;
    Ok(InChip { driven: play.finish(&folder.join("stream.agvlog"))?, stack })
}

impl Play<'_> {
    fn mode(&self) -> Option<Mode> {
        self.poses.last().map(|heard| heard.pose.mode)
    }

    /// What is said to the chip, which then runs until that time.
    fn said(&mut self, until: u64) -> Said {
        let frames = std::mem::take(&mut self.frames);
        let said = |frame: &Frame| {
            let (identifier, is_extended) = match frame.id() {
                Id::Standard(id) => (u32::from(id.as_raw()), false),
                Id::Extended(id) => (id.as_raw(), true),
            };
            (identifier, is_extended, frame.is_remote(), hexadecimal(frame.data()))
        };
        let frames = frames.iter().map(said).collect();
        Said { until, frames, laser: hexadecimal(&std::mem::take(&mut self.laser)) }
    }

    /// Hears what the chip has said until now, and lets the sensors answer.
    fn take(&mut self, answer: &Answer, now: u64) -> Result<(), VehicleError> {
        for (time, identifier, data) in &answer.frames {
            let id = standard_id(u16::try_from(*identifier).unwrap_or_default());
            if let Some(frame) = Frame::new(id, &bytes(data)?) {
                self.hear(&frame, *time);
            }
        }
        self.log.extend(bytes(&answer.log)?);
        self.answer_laser(answer, now)?;
        // Everything that the localiser is told is in the log, from the first sample on.
        if self.log.is_empty() {
            return Ok(());
        }
        let time = Time::from_micros(now);
        self.frames.extend(self.motion.poll(time));
        self.frames.extend(self.gyro.iter_mut().flat_map(|gyro| gyro.poll(time)));
        if self.begin.is_some() {
            self.foreign_due += self.foreign_rate * STEP as f64 * 1e-6;
            while self.foreign_due >= 1.0 {
                self.foreign_due -= 1.0;
                self.frames.push(self.foreign.next_frame());
            }
            return Ok(());
        }
        if self.mode().is_some_and(Mode::is_localised) {
            self.drive_off(now);
        } else if self.is_told
            && self.motion.are_operational()
            && now > self.last_order + BETWEEN_ORDERS.as_micros() as u64
        {
            self.last_order = now;
            self.orders = (self.orders + 1) % 16;
            let pose = truth_or_stand_at(&self.recording.truth, self.first);
            self.frames.extend(pose.into_iter().flat_map(|pose| initial_pose(pose, self.controller, self.orders)));
        }
        Ok(())
    }

    fn hear(&mut self, frame: &Frame, time: u64) {
        self.frames.extend(self.motion.handle(frame));
        let heard = self.origin + Duration::from_micros(time);
        if let Some(pose) = self.receiver.handle(frame) {
            self.poses.push(HeardPose { heard, pose });
        } else if let Ok(Message::Emergency { node, emergency }) = Message::decode(frame)
            && node == self.controller
        {
            self.emergencies.push(HeardEmergency { heard, emergency });
        }
    }

    fn answer_laser(&mut self, answer: &Answer, now: u64) -> Result<(), VehicleError> {
        let now = now as f64 * 1e-6;
        if answer.is_connected_anew {
            self.connection = Some(Connection::default());
        }
        let Some(connection) = &mut self.connection else { return Ok(()) };
        let asked = bytes(&answer.laser)?;
        if !asked.is_empty() {
            self.laser.extend(connection.receive(&mut self.sensor, &asked, now));
        }
        self.laser.extend(connection.poll(&self.sensor, now).unwrap_or_default());
        Ok(())
    }

    /// Begins the drive, laser and encoders together.
    fn drive_off(&mut self, now: u64) {
        let begin = Time::from_micros(now + LEAD.as_micros() as u64);
        self.sensor.begin(begin.since(Time::default()));
        let events = &self.recording.events;
        let first_sample = events.iter().find(|event| event.is_odometry()).and_then(|event| event.time());
        let first_sample = begin.offset(first_sample.map_or(0.0, |time| time.since(self.first)));
        self.motion.begin(first_sample);
        if let Some(gyro) = &mut self.gyro {
            gyro.begin(first_sample);
        }
        self.begin = Some(begin.micros());
    }

    /// Writes the log.
    fn finish(self, log: &Path) -> Result<Driven, VehicleError> {
        let mut copy = LogCopy::new(log);
        let mut reader = Reader::of(log, Box::new(Cursor::new(self.log)))?;
        while let Some(item) = reader.next()? {
            copy.take(&item)?;
        }
        Ok(Driven {
            log: log.to_owned(),
            stream: copy.finish()?.unwrap_or_default(),
            poses: self.poses,
            emergencies: self.emergencies,
            begin: self.origin + Duration::from_micros(self.begin.unwrap_or_default()),
            first: self.first,
            longest_stall: 0.0,
            longest_delay: 0.0,
            line_delays: Vec::new(),
            longest_laser_delay: 0.0,
        })
    }
}
