//! What plays on the bus: the encoders, other nodes, and who tells the vehicle where it is.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use agv_controller::EncoderNodes;
use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::state::Mode;
use agv_settings::Settings;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::{Content, PoseReceiver};
use agv_wire::can::frame::Frame;

use super::error::VehicleError;
use super::line_watch::{LineDelay, LineWatch};
use super::own_nodes;
use super::watch::{BusTrouble, Heard, HeardEmergency, HeardPose};
use crate::bus::{Bus, SlcanBus};
use crate::emulate::board::{Board, BoardError};
use crate::emulate::foreign_traffic::ForeignTraffic;
use crate::emulate::gyro::EmulatedGyro;
use crate::emulate::motion::EmulatedMotion;
use crate::emulate::run_delay::RunDelay;
use crate::recording::{Recording, truth_or_stand_at};
use crate::serve::nav350::Nav350;

/// Standard deviations of the pose that the controller is told, m and rad.
const START_DEVIATIONS: [f64; 2] = [0.05, 0.02];
/// How long the controller may take to localise.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);
/// Most frames of other nodes at once.
const LONGEST_BURST: f64 = 20.0;
/// How long the vehicle stands when everything is ready.
pub(super) const LEAD: Duration = Duration::from_millis(500);
/// How long the controller may take to answer that it knows where it is, before it is told again.
pub(super) const BETWEEN_ORDERS: Duration = Duration::from_millis(500);

/// What is known beforehand, and what others see of it.
pub(super) struct Stage<'a> {
    pub recording: &'a Recording,
    pub settings: &'a Settings,
    pub sensor: &'a Nav350,
    pub heard: &'a Mutex<Heard>,
    pub trouble: &'a BusTrouble,
    pub stopped: &'a AtomicBool,
    /// The time of the recording at which the drive begins.
    pub first: Time,
    pub is_told: bool,
}

/// The nodes on the bus, as far as they have come.
struct Play<'a> {
    stage: &'a Stage<'a>,
    bus: SlcanBus,
    controller: NodeId,
    motion: EmulatedMotion,
    gyro: Option<EmulatedGyro>,
    receiver: PoseReceiver,
    foreign: ForeignTraffic,
    /// Frames of other nodes that there is time for.
    foreign_due: f64,
    start: Instant,
    /// When the loop came by last.
    looked: Instant,
    /// How long the machine keeps the emulator waiting.
    delay: RunDelay,
    line: LineWatch,
    /// When the drive ends, once it has begun.
    end: Option<Instant>,
    last_order: Instant,
    orders: u8,
    /// Frames of the sensors that were sent.
    sent: u32,
}

pub(super) const FIRST_NODE: NodeId = match NodeId::new(1) {
    Some(node) => node,
    None => panic!("1 is a node"),
};

impl Stage<'_> {
    /// Plays until the drive is over, or somebody ends it.
    pub fn run(
        &self,
        bus: SlcanBus,
        mut board: Board,
        is_streaming: &AtomicBool,
        seconds: f64,
    ) -> Result<(), VehicleError> {
        let mut play = self.begin(bus, board.run_delay())?;
        loop {
            play.note_stall();
            play.watch_line()?;
            if self.stopped.load(Ordering::Relaxed) || play.end.is_some_and(|end| Instant::now() > end) {
                return Ok(());
            }
            play.send_foreign()?;
            if !board.is_running() {
                return Err(board.ended().into());
            }
            // Everything that the localiser is told is in the stream, from the first sample on.
            if is_streaming.load(Ordering::Acquire) {
                play.send_sensors()?;
            }
            play.answer()?;
            if play.end.is_some() {
                continue;
            }
            if self.mode().is_some_and(Mode::is_localised) {
                play.drive_off(seconds);
            } else if self.is_told && play.motion.are_operational() && play.last_order.elapsed() > BETWEEN_ORDERS {
                play.last_order = Instant::now();
                play.tell_pose()?;
            }
            if play.start.elapsed() > PATIENCE {
                return Err(VehicleError::NotLocalised(self.mode()));
            }
        }
    }

    fn begin(&self, bus: SlcanBus, delay: RunDelay) -> Result<Play<'_>, VehicleError> {
        let controller = NodeId::new(self.settings.nodes.controller).unwrap_or(FIRST_NODE);
        let start = Instant::now();
        Ok(Play {
            stage: self,
            bus,
            controller,
            motion: EmulatedMotion::new(self.recording, &EncoderNodes::of(self.settings))?.standing(),
            gyro: EmulatedGyro::of(self.recording, &self.settings.gyro_frame),
            receiver: PoseReceiver::new(controller),
            foreign: ForeignTraffic::new(1, &own_nodes(self.settings)),
            foreign_due: 0.0,
            start,
            looked: start,
            delay,
            line: LineWatch::new(start),
            end: None,
            last_order: start,
            orders: 0,
            sent: 0,
        })
    }

    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn mode(&self) -> Option<Mode> {
        self.heard().poses.last().map(|heard| heard.pose.mode)
    }

    /// Where the vehicle is. None if the recording has no truth.
    fn pose(&self) -> Option<Pose> {
        let driven = self.heard().begin.map_or(0.0, |begin| begin.elapsed().as_secs_f64());
        truth_or_stand_at(&self.recording.truth, self.first.offset(driven))
    }
}

/// What tells the controller that it is at a pose, as well as somebody who looks at it knows.
pub(super) fn initial_pose(pose: Pose, controller: NodeId, counter: u8) -> [Frame; 2] {
    let Pose { x, y, theta } = pose;
    let [position_deviation, heading_deviation] = START_DEVIATIONS;
    [
        Content::InitialPosition { x, y },
        Content::InitialHeading { heading: theta, position_deviation, heading_deviation },
    ]
    .map(|content| content.encode(controller, counter))
}

impl Play<'_> {
    /// Now, as the encoders take it.
    fn now(&self) -> Time {
        Time::from_micros(1_000_000).offset(self.start.elapsed().as_secs_f64())
    }

    /// Notes how long the loop took, and how many frames of other nodes there was time for.
    fn note_stall(&mut self) {
        let now = Instant::now();
        let passed = now - self.looked;
        self.looked = now;
        let rate = f64::from(self.stage.trouble.foreign.load(Ordering::Relaxed));
        // What a stall has held up is left out: a bus takes no more frames than it has time for.
        self.foreign_due = (self.foreign_due + rate * passed.as_secs_f64()).min(LONGEST_BURST);
        if self.end.is_some() {
            let delay = self.delay.look(now).as_secs_f64();
            let mut heard = self.stage.heard();
            heard.longest_stall = heard.longest_stall.max(passed.as_secs_f64());
            heard.longest_delay = delay;
            heard.line_delays.extend(LineDelay::of(now - passed, passed));
        }
    }

    /// Notes how late the board's driver hears what is sent.
    fn watch_line(&mut self) -> Result<(), BoardError> {
        if self.end.is_some()
            && let Some(delay) = self.line.poll(&mut self.bus, self.looked)?
        {
            self.stage.heard().line_delays.push(delay);
        }
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BoardError> {
        Ok(self.bus.send(&(*frame).into())?)
    }

    fn send_foreign(&mut self) -> Result<(), BoardError> {
        while self.foreign_due >= 1.0 {
            self.foreign_due -= 1.0;
            let frame = self.foreign.next_frame();
            self.send(&frame)?;
            self.stage.trouble.foreign_sent.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }

    fn send_sensors(&mut self) -> Result<(), BoardError> {
        let now = self.now();
        for frame in self.motion.poll(now) {
            self.send_sensor_frame(&frame)?;
        }
        for frame in self.gyro.iter_mut().flat_map(|gyro| gyro.poll(now)).collect::<Vec<_>>() {
            self.send_sensor_frame(&frame)?;
        }
        Ok(())
    }

    /// Sends what an encoder says, with the trouble that there is.
    fn send_sensor_frame(&mut self, frame: &Frame) -> Result<(), BoardError> {
        let trouble = self.stage.trouble;
        let is_drive = matches!(
            Message::decode(frame),
            Ok(Message::TransmitPdo { node, .. } | Message::Heartbeat { node, .. })
                if node.number() == self.stage.settings.nodes.encoders[0].node
        );
        if is_drive && trouble.is_drive_silent.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.sent = self.sent.wrapping_add(1);
        let every = trouble.corrupted_in.load(Ordering::Relaxed);
        if every > 0 && self.sent.is_multiple_of(every) {
            let mut data = frame.data().to_vec();
            let bit = (self.sent / every) as usize % (8 * data.len().max(1));
            if let Some(byte) = data.get_mut(bit / 8) {
                *byte ^= 1 << (bit % 8);
            }
            if let Some(frame) = Frame::new(frame.id(), &data) {
                return self.send(&frame);
            }
        }
        self.send(frame)
    }

    /// Waits for a frame of the controller for a millisecond, and answers it.
    fn answer(&mut self) -> Result<(), BoardError> {
        let received = self.bus.receive(Instant::now() + Duration::from_millis(1))?;
        let Some(frame) = received.as_ref().and_then(|frame| frame.classic()) else { return Ok(()) };
        for answer in self.motion.handle(frame) {
            self.bus.send(&answer.into())?;
        }
        let time = Instant::now();
        if let Some(pose) = self.receiver.handle(frame) {
            self.stage.heard().poses.push(HeardPose { heard: time, pose });
        } else if let Ok(Message::Emergency { node, emergency }) = Message::decode(frame)
            && node == self.controller
        {
            self.stage.heard().emergencies.push(HeardEmergency { heard: time, emergency });
        }
        Ok(())
    }

    /// Tells the controller where it is.
    fn tell_pose(&mut self) -> Result<(), BoardError> {
        let Some(pose) = self.stage.pose() else { return Ok(()) };
        self.orders = (self.orders + 1) % 16;
        for frame in initial_pose(pose, self.controller, self.orders) {
            self.send(&frame)?;
        }
        Ok(())
    }

    /// Begins the drive, laser and encoders together.
    fn drive_off(&mut self, seconds: f64) {
        let stage = self.stage;
        let begin = Instant::now() + LEAD;
        stage.sensor.begin(begin);
        let first_sample =
            stage.recording.events.iter().find(|event| event.is_odometry()).and_then(|event| event.time());
        let shift = first_sample.map_or(0.0, |time| time.since(stage.first));
        let now = self.now();
        self.motion.begin(now.offset(LEAD.as_secs_f64() + shift));
        if let Some(gyro) = &mut self.gyro {
            gyro.begin(now.offset(LEAD.as_secs_f64() + shift));
        }
        stage.heard().begin = Some(begin);
        self.end = Some(begin + Duration::from_secs_f64(seconds.min(self.motion.duration())));
    }
}
