//! A vehicle with everything on it, in simulated time: sensors that see a simulated drive, lines with faults, and the
//! controller.

use agv_controller::{Controller, EncoderNodes, LaserOrder};
use agv_core::contours::KeptMap;
use agv_core::geometry::Pose;
use agv_core::localizer::{ContourCapacities, Localizer, PoseFix};
use agv_core::maps::MapError;
use agv_core::measurement::Time;
use agv_core::state::PoseOutput;
use agv_settings::Settings;
use agv_wire::can::controller::{PoseReceiver, PublishedPose};
use agv_wire::can::frame::Frame;
use agv_wire::nav350::SensorFrame;

use super::fault::{Fault, FaultKind, Line};
use agv_host_sim::emulate::gyro::EmulatedGyro;
use agv_host_sim::emulate::motion::{EmulatedMotion, MotionError};
use agv_host_sim::recording::{RecordedEvent, Recording, truth_at};
use agv_host_sim::serve::nav350::{Connection, Drive, DriveError, Sensor, SensorClockOptions};
use agv_host_sim::simulate::START;
use agv_host_sim::simulate::random::{Random, Stream};

/// Why a run cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// The laser has nothing to see.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// Nothing tells how the vehicle moves.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The map does not fit.
    #[error("the map has more reflectors than the controller has room for, or one that is not finite")]
    Map(MapError),
}

/// How long a vehicle stands that is told where it starts, s.
const STANDS: f64 = 5.0;
/// Step of the simulated time, us: what the firmware's bus task sleeps at most.
const STEP: u64 = 1_000;
/// Steps between two poses that are judged.
const STEPS_A_POSE: u64 = 10;
/// Time that a telegram and a frame take, s.
const LASER_LATENCY: f64 = 0.001;
const BUS_LATENCY: f64 = 0.000_3;
/// Largest value of the laser's clock, ms.
const CLOCK_RANGE: f64 = 4_294_967_296.0;

/// How a drive is made.
#[derive(Clone, Copy, Debug)]
pub struct RigOptions<'a> {
    /// How long it lasts, s.
    pub seconds: f64,
    /// Seed of the faults of the lines.
    pub seed: u64,
    /// How long everything has been switched on when the recording begins, s. Meanwhile the laser tells its first revolution again and again.
    pub stands: f64,
    /// When the controller is told where it starts, s after the recording begins; never if absent.
    pub told: Option<f64>,
    /// Its map of contours, if it has one.
    pub contours: Option<KeptMap<'a>>,
}

impl<'a> RigOptions<'a> {
    /// A vehicle that has stood for 5 s, and is told where it starts when the recording begins.
    #[must_use]
    pub const fn told(seconds: f64, seed: u64, contours: Option<KeptMap<'a>>) -> Self {
        Self { seconds, seed, stands: STANDS, told: Some(0.0), contours }
    }
}

/// What is heard a hundred times a second, from when everything was switched on.
#[derive(Clone, Copy)]
pub struct Heard<'a> {
    /// Now.
    pub now: Time,
    /// Time of the recording, s; negative before it begins.
    pub time: f64,
    /// What the controller would publish.
    pub output: Option<&'a PoseOutput>,
    /// What its bus has said last, and the time that it states.
    pub published: Option<(&'a PublishedPose, Time)>,
    /// Where the vehicle is at any time.
    pub truth: &'a dyn Fn(Time) -> Option<Pose>,
}

/// A controller to which a map of contours can be lent.
pub type ContourController<'a> = Controller<Localizer<ContourCapacities<'a>>>;

/// Everything on the vehicle.
struct Rig<'a> {
    recording: &'a Recording,
    contours: Option<KeptMap<'a>>,
    faults: &'a [&'a Fault],
    /// None while the power is cut.
    controller: Option<Box<ContourController<'a>>>,
    motion: EmulatedMotion,
    gyro: Option<EmulatedGyro>,
    sensor: Sensor,
    connection: Option<Connection>,
    from_laser: Line<Vec<u8>>,
    to_laser: Line<Vec<u8>>,
    from_bus: Line<Frame>,
    receiver: PoseReceiver,
    /// What the bus has said last, and the time that it states.
    published: Option<(PublishedPose, Time)>,
}

/// What the controller is given, call by call.
#[derive(Clone, Copy, Debug)]
pub enum Given<'a> {
    /// Where the vehicle is.
    Told(PoseFix),
    /// Bytes of the laser.
    LaserBytes(&'a [u8]),
    /// Time for the laser.
    LaserPolled,
    /// The connection to the laser.
    Connected,
    /// A frame of the bus.
    BusFrame(&'a Frame),
    /// Time for the bus.
    BusPolled,
    /// Time to search.
    Searched,
}

/// Drives a recorded drive with faults. `recording` has what the sensors see, faults of measurements included.
///
/// # Errors
/// See [`RigError`].
pub fn drive(
    recording: &Recording,
    faults: &[&Fault],
    options: &RigOptions,
    hear: impl FnMut(&Heard),
) -> Result<(), RigError> {
    drive_listening(recording, faults, options, hear, |_, _| ())
}

/// The same; `listen` gets all that the controller is given, and when.
///
/// # Errors
/// See [`RigError`].
pub fn drive_listening(
    recording: &Recording,
    faults: &[&Fault],
    options: &RigOptions,
    hear: impl FnMut(&Heard),
    listen: impl FnMut(Time, Given),
) -> Result<(), RigError> {
    drive_rig(Rig::new(recording, faults, options)?, options, hear, listen)
}

fn drive_rig(
    mut rig: Rig<'_>,
    options: &RigOptions,
    mut hear: impl FnMut(&Heard),
    mut listen: impl FnMut(Time, Given),
) -> Result<(), RigError> {
    let recording = rig.recording;
    // Everything is switched on for one step at least.
    let begin = Time::from_seconds(options.stands).max(Time::from_micros(STEP));
    let told = options.told.map(|told| begin.offset(told));
    let steps = ((options.stands + options.seconds) * 1e6) as u64 / STEP;
    for step in 1..=steps {
        let now = Time::from_micros(step * STEP);
        let time = now.since(begin);
        if now == begin {
            rig.begin(now);
        }
        if Some(now) == told {
            rig.tell_start(now, &mut listen);
        }
        rig.switch(now, time)?;
        rig.control(now, time, &mut listen);
        rig.answer(now, time);
        if step % STEPS_A_POSE == 0 {
            let output = rig.controller.as_ref().and_then(|controller| controller.output());
            let truth = |at: Time| truth_at(&recording.truth, START.offset(at.since(begin).max(0.0)));
            let published = rig.published.as_ref().map(|(pose, stated)| (pose, *stated));
            hear(&Heard { now, time, output: output.as_ref(), published, truth: &truth });
        }
    }
    Ok(())
}

impl<'a> Rig<'a> {
    fn new(recording: &'a Recording, faults: &'a [&'a Fault], options: &RigOptions<'a>) -> Result<Self, RigError> {
        let RigOptions { seed, stands, contours, .. } = *options;
        let settings = Settings::of(recording.parameters);
        let nodes = EncoderNodes::of(&settings);
        let motion = EmulatedMotion::new(recording, &nodes)?.standing();
        let drive = Drive::new(recording, SensorFrame::default())?;
        let receiver = PoseReceiver::new(nodes.controller);
        let mut rig = Self {
            recording,
            contours,
            faults,
            controller: None,
            gyro: EmulatedGyro::of(recording, &settings.gyro_frame),
            motion,
            sensor: Sensor::new(drive, clock(faults, stands), None, true),
            connection: None,
            from_laser: Line::new(LASER_LATENCY, Random::new(seed, Stream::Telegrams)),
            to_laser: Line::new(LASER_LATENCY, Random::new(seed, Stream::Telegrams)),
            from_bus: Line::new(BUS_LATENCY, Random::new(seed, Stream::Frames)),
            receiver,
            published: None,
        };
        rig.power_on(Time::default())?;
        Ok(rig)
    }

    fn has(&self, what: FaultKind, time: f64) -> bool {
        self.faults.iter().any(|fault| fault.what == what && fault.is_active(time))
    }

    fn power_on(&mut self, now: Time) -> Result<(), RigError> {
        self.controller = Some(new_controller(self.recording, self.contours, now)?);
        Ok(())
    }

    /// Lets the recording begin.
    fn begin(&mut self, now: Time) {
        self.motion.begin(now);
        if let Some(gyro) = &mut self.gyro {
            gyro.begin(now);
        }
        self.sensor.begin(now.since(Time::default()));
    }

    /// Tells the controller where the recording says that it starts.
    fn tell_start(&mut self, now: Time, listen: &mut impl FnMut(Time, Given)) {
        if let (Some(controller), Some(RecordedEvent::SetPose(fix))) =
            (&mut self.controller, self.recording.events.first())
        {
            let mut fix = *fix;
            fix.time = now;
            listen(now, Given::Told(fix));
            controller.tell(fix, |_| ());
        }
    }

    /// Cuts the power and the laser's network, and gives them back.
    fn switch(&mut self, now: Time, time: f64) -> Result<(), RigError> {
        if self.has(FaultKind::PowerCut, time) {
            (self.controller, self.connection) = (None, None);
            self.clear_laser_lines();
        } else if self.controller.is_none() {
            self.power_on(now)?;
        }
        if self.has(FaultKind::LaserUnreachable, time) && self.connection.take().is_some() {
            self.clear_laser_lines();
            if let Some(controller) = &mut self.controller {
                controller.unreachable();
            }
        }
        Ok(())
    }

    fn clear_laser_lines(&mut self) {
        self.from_laser.clear();
        self.to_laser.clear();
    }

    /// What the controller does.
    fn control(&mut self, now: Time, time: f64, listen: &mut impl FnMut(Time, Given)) {
        let Some(mut controller) = self.controller.take() else { return };
        let mut orders = Vec::new();
        while let Some(bytes) = self.from_laser.receive(now) {
            listen(now, Given::LaserBytes(&bytes));
            controller.hear_laser(&bytes, now, |order| orders.push(order.map(<[u8]>::to_vec)), |_| ());
        }
        listen(now, Given::LaserPolled);
        controller.poll_laser(now, |order| orders.push(order.map(<[u8]>::to_vec)), |_| ());
        for order in orders {
            self.obey(order, &mut controller, (now, time), listen);
        }
        while let Some(frame) = self.from_bus.receive(now) {
            listen(now, Given::BusFrame(&frame));
            // What answers a frame is no pose.
            controller.hear_bus(&frame, now, |_| (), |_| ());
        }
        let Self { receiver, published, motion, from_bus, faults, .. } = self;
        let answer = |frame: &Frame| {
            if let Some(pose) = receiver.handle(frame) {
                *published = Some((pose, stated(&pose, now)));
            }
            for answer in motion.handle(frame) {
                from_bus.send_frame(now, time, answer, faults);
            }
        };
        listen(now, Given::BusPolled);
        controller.poll_bus(now, answer, |_| ());
        listen(now, Given::Searched);
        controller.search(|_| ());
        self.controller = Some(controller);
    }

    /// Does what the controller wants of its laser.
    fn obey(
        &mut self,
        order: LaserOrder<Vec<u8>>,
        controller: &mut ContourController<'_>,
        (now, time): (Time, f64),
        listen: &mut impl FnMut(Time, Given),
    ) {
        match order {
            LaserOrder::Connect if self.has(FaultKind::LaserUnreachable, time) => controller.unreachable(),
            LaserOrder::Connect => {
                self.connection = Some(Connection::default());
                listen(now, Given::Connected);
                controller.connected(now);
            }
            LaserOrder::Disconnect => {
                self.connection = None;
                self.clear_laser_lines();
            }
            LaserOrder::Send(bytes) if self.has(FaultKind::LaserSilent, time) => drop(bytes),
            LaserOrder::Send(bytes) => self.to_laser.send_telegram(now, time, bytes, &[]),
        }
    }

    /// What the sensors say.
    fn answer(&mut self, now: Time, time: f64) {
        let sensor_time = now.since(Time::default());
        if let Some(connection) = &mut self.connection {
            let mut answers = Vec::new();
            while let Some(bytes) = self.to_laser.receive(now) {
                answers.push(connection.receive(&mut self.sensor, &bytes, sensor_time));
            }
            answers.extend(connection.poll(&self.sensor, sensor_time));
            for answer in answers {
                self.from_laser.send_telegram(now, time, answer, self.faults);
            }
        }
        for frame in self.motion.poll(now).into_iter().chain(self.gyro.iter_mut().flat_map(|gyro| gyro.poll(now))) {
            self.from_bus.send_frame(now, time, frame, self.faults);
        }
    }
}

/// A controller with the map of a recording, and one of contours if there is one, that is switched on at `now`.
///
/// # Errors
/// [`RigError::Map`] if the map does not fit.
pub fn new_controller<'a>(
    recording: &Recording,
    contours: Option<KeptMap<'a>>,
    now: Time,
) -> Result<Box<ContourController<'a>>, RigError> {
    let mut localizer = Localizer::<ContourCapacities>::new(recording.parameters);
    localizer.set_contours(contours);
    localizer.add_landmarks(&recording.landmarks).map_err(RigError::Map)?;
    Ok(Box::new(Controller::new(&Settings::of(recording.parameters), localizer, now)))
}

/// The time that a pose states, of which its frames carry the low 16 bits of the milliseconds.
fn stated(pose: &PublishedPose, now: Time) -> Time {
    let milliseconds = now.micros() / 1000;
    let age = (milliseconds as u16).wrapping_sub(pose.time) as i16;
    Time::from_micros(1000 * milliseconds.saturating_add_signed(-i64::from(age)))
}

/// What the laser's clock shows, so many seconds before the recording begins.
fn clock(faults: &[&Fault], stands: f64) -> SensorClockOptions {
    let mut clock = SensorClockOptions { start: 1_000_000, ..SensorClockOptions::default() };
    for fault in faults {
        match fault.what {
            FaultKind::LaserClockJumps { milliseconds } => clock.jumps.push((stands + fault.from, milliseconds)),
            FaultKind::LaserClockDrifts { share } => clock.drift = share,
            FaultKind::LaserClockWraps => clock.start = (CLOCK_RANGE - (stands + fault.from) * 1e3) as u32,
            _ => {}
        }
    }
    clock
}
