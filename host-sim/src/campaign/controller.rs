//! The controller of a vehicle in simulated time: the parts of the core as the firmware puts them together.

use agv_core::landmarks::{Landmark, MapError};
use agv_core::localizer::{Event, Localizer, OutputPredictor, PoseFix, StartSearch};
use agv_core::measurement::Time;
use agv_core::state::PoseOutput;
use agv_core::wire::can::encoder_pair::EncoderPair;
use agv_core::wire::can::frame::Frame;
use agv_core::wire::nav350::{Configuration, Revolution, Session, Step};
use agv_settings::Settings;
use agv_settings::encoders::{SYNC_PERIOD, channels};

/// Motions that the localiser may be behind, as in the firmware.
const MOTIONS: usize = 16;
/// Slices of the search that there is time for in a millisecond.
const SLICES: usize = 8;

/// What the firmware is made of, without its board.
pub struct Controller {
    session: Box<Session>,
    revolution: Box<Revolution>,
    encoders: EncoderPair,
    localizer: Box<Localizer>,
    predictor: OutputPredictor<MOTIONS>,
    search: Box<StartSearch>,
}

/// What the controller wants of its laser.
pub enum LaserOrder {
    /// A connection.
    Connect,
    /// No connection any more.
    Disconnect,
    /// These bytes sent.
    Send(Vec<u8>),
}

impl Controller {
    /// A controller that is switched on at `now`.
    ///
    /// # Errors
    /// If the map does not fit.
    pub fn new(settings: &Settings, landmarks: &[Landmark], now: Time) -> Result<Self, MapError> {
        let [drive, steering] = channels(settings);
        let mut localizer: Box<Localizer> = Box::new(Localizer::new(settings.parameters));
        localizer.add_landmarks(landmarks)?;
        let mut search = Box::new(StartSearch::new(&settings.parameters, settings.start_search));
        search.index(localizer.reflectors());
        Ok(Self {
            session: Box::new(Session::new(Configuration::default())),
            revolution: Box::default(),
            encoders: EncoderPair::new(&drive, &steering, SYNC_PERIOD, now),
            predictor: OutputPredictor::new(&settings.parameters),
            localizer,
            search,
        })
    }

    /// The connection to the laser is open.
    pub fn connected(&mut self, now: Time) {
        self.session.connected(now);
    }

    /// The connection to the laser cannot be opened, or was closed by the other side.
    pub fn closed(&mut self) {
        self.session.closed();
    }

    /// Takes bytes of the laser.
    pub fn hear_laser(&mut self, bytes: &[u8], now: Time, mut order: impl FnMut(LaserOrder)) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let taken = self.session.receive(rest, now);
            rest = &rest[taken..];
            self.poll_laser(now, &mut order);
        }
    }

    /// Does what there is to do with the laser.
    pub fn poll_laser(&mut self, now: Time, mut order: impl FnMut(LaserOrder)) {
        loop {
            match self.session.poll(now, &mut self.revolution) {
                Step::Wait(_) => return,
                Step::Connect => return order(LaserOrder::Connect),
                Step::Disconnect(_) => order(LaserOrder::Disconnect),
                Step::Send(bytes) => order(LaserOrder::Send(bytes.to_vec())),
                Step::Report(_) => {}
                Step::Revolution => {
                    let revolution = std::mem::take(&mut self.revolution);
                    if let Some(reflectors) = revolution.reflectors() {
                        self.handle(&Event::Reflectors(reflectors));
                    }
                    if let Some(scan) = revolution.scan() {
                        self.handle(&Event::Scan(scan));
                    }
                    self.revolution = revolution;
                }
            }
        }
    }

    /// Takes a frame of the bus.
    pub fn hear_bus(&mut self, frame: &Frame, now: Time) {
        if let Some(sample) = self.encoders.handle(frame, now) {
            self.predictor.encoders(&sample);
            self.handle(&Event::Encoders(sample));
        }
    }

    /// Does what there is to do on the bus.
    pub fn poll_bus(&mut self, now: Time, mut send: impl FnMut(Frame)) {
        if let Some(faults) = self.encoders.poll_faults(now) {
            self.predictor.doubt_encoders(&faults);
            self.handle(&Event::EncoderFaults(faults));
        }
        while let Some(frame) = self.encoders.poll(now) {
            send(frame);
        }
    }

    /// Somebody tells where the vehicle is.
    pub fn tell(&mut self, fix: PoseFix) {
        self.handle(&Event::SetPose(fix));
    }

    /// Searches a pose if there is none, as long as a millisecond allows.
    pub fn search(&mut self) {
        for _ in 0..SLICES {
            let (is_busy, found) = self.search.advance(self.localizer.reflectors());
            if let Some(fix) = found {
                self.tell(fix);
            }
            if !is_busy {
                return;
            }
        }
    }

    /// What it publishes.
    #[must_use]
    pub fn output(&self) -> Option<PoseOutput> {
        self.predictor.output()
    }

    fn handle(&mut self, event: &Event) {
        let output = self.localizer.handle(event).pose;
        self.predictor.update(&output, &self.localizer.odometry_bias());
        self.search.handle(event, output.mode, self.localizer.reflectors());
    }
}
