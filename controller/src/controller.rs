//! All parts as one value.

use agv_core::localizer::{Localize, Localizer, PoseFix};
use agv_core::measurement::Time;
use agv_core::record::Record;
use agv_core::state::PoseOutput;
use agv_settings::Settings;
use agv_wire::can::frame::Frame;
use agv_wire::nav350::{Revolution, Step};

use super::bus::{Bus, BusOutput, ControllerIdentity, Troubles};
use super::carried_map::carried_map;
use super::encoders::BusEvent;
use super::laser::Laser;
use super::localization::Localization;
use super::setting_objects::ChangeableSettings;

/// Room for the longest telegram of a revolution with 1440 beams, in either dialect: distances and strengths of echoes, 50 reflectors with
/// their details, and the pose, each number as long as it can be.
pub const TELEGRAM: usize = 20 * 1024;

/// What the controller is called on the bus.
const HARDWARE: &str = "desktop";

/// Slices of the search that there is time for in a millisecond.
const SLICES: usize = 8;

/// What the controller wants of its laser; `B` are bytes, borrowed or kept for later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LaserOrder<B> {
    /// A connection.
    Connect,
    /// No connection any more.
    Disconnect,
    /// These bytes sent.
    Send(B),
}

impl<B> LaserOrder<B> {
    /// The same with other bytes.
    pub fn map<T>(self, bytes: impl FnOnce(B) -> T) -> LaserOrder<T> {
        match self {
            Self::Connect => LaserOrder::Connect,
            Self::Disconnect => LaserOrder::Disconnect,
            Self::Send(sent) => LaserOrder::Send(bytes(sent)),
        }
    }
}

/// A controller that does one thing after the other: that of a desktop, in simulated time. A board runs its parts at three
/// priorities.
///
/// `log` is given all that a log of the drive holds, in its order.
#[derive(Debug)]
pub struct Controller<L: Localize = Localizer> {
    laser: Laser<TELEGRAM>,
    revolution: Revolution,
    bus: Bus,
    localization: Localization<L>,
    settings: Settings,
}

impl<L: Localize> Controller<L> {
    /// A controller that is switched on at `now`, with a localiser that has its maps.
    #[must_use]
    pub fn new(settings: &Settings, localizer: L, now: Time) -> Self {
        let landmarks = localizer.reflectors().landmarks().iter().chain(localizer.features().landmarks());
        let identity =
            ControllerIdentity { hardware: HARDWARE, map: carried_map(landmarks), ..ControllerIdentity::default() };
        Self {
            laser: Laser::new(settings.laser.configuration()),
            revolution: Revolution::new(),
            bus: Bus::new(settings, identity, Troubles::default(), now),
            localization: Localization::new(localizer, settings),
            settings: settings.clone(),
        }
    }

    /// The connection to the laser is open.
    pub fn connected(&mut self, now: Time) {
        self.laser.connected(now);
    }

    /// The connection to the laser cannot be opened, or is broken.
    pub fn unreachable(&mut self) {
        self.laser.unreachable();
    }

    /// Takes bytes of the laser.
    pub fn hear_laser(
        &mut self,
        bytes: &[u8],
        now: Time,
        mut order: impl FnMut(LaserOrder<&[u8]>),
        mut log: impl FnMut(&Record),
    ) {
        let mut rest = bytes;
        while !rest.is_empty() {
            // A telegram is shorter than the session's room, so it always takes some.
            let taken = self.laser.receive(rest, now);
            rest = rest.get(taken..).unwrap_or_default();
            self.poll_laser(now, &mut order, &mut log);
        }
    }

    /// Does what there is to do with the laser.
    pub fn poll_laser(&mut self, now: Time, mut order: impl FnMut(LaserOrder<&[u8]>), mut log: impl FnMut(&Record)) {
        if let Some(speed) = self.bus.laser_speed() {
            self.laser.set_speed(speed);
        }
        loop {
            match self.laser.poll(now, &mut self.revolution) {
                Step::Wait(_) => return,
                Step::Connect => return order(LaserOrder::Connect),
                Step::Disconnect(_) => order(LaserOrder::Disconnect),
                Step::Send(bytes) => order(LaserOrder::Send(bytes)),
                Step::Report(_) => {}
                Step::Revolution => {
                    self.localization.revolution(&self.revolution, &mut log);
                    self.bus.update(&self.localization.estimate());
                }
            }
        }
    }

    /// Takes a frame of the bus.
    pub fn hear_bus(&mut self, frame: &Frame, now: Time, mut send: impl FnMut(&Frame), mut log: impl FnMut(&Record)) {
        let Self { bus, localization, settings, .. } = self;
        let mut is_save_asked = false;
        bus.hear(frame, now, &mut ChangeableSettings::new(settings), |output| {
            is_save_asked |= matches!(output, BusOutput::Save(_));
            take(localization, output, &mut send, &mut log);
        });
        // It has no flash.
        if is_save_asked && let Some(answer) = bus.saved(false) {
            send(&answer);
        }
        bus.update(&localization.estimate());
    }

    /// Does what there is to do on the bus.
    pub fn poll_bus(&mut self, now: Time, mut send: impl FnMut(&Frame), mut log: impl FnMut(&Record)) {
        let Self { bus, localization, laser, .. } = self;
        bus.poll(now, laser.health(now), |output| take(localization, output, &mut send, &mut log));
        bus.update(&localization.estimate());
    }

    /// Somebody tells where the vehicle is.
    pub fn tell(&mut self, fix: PoseFix, log: impl FnMut(&Record)) {
        self.localization.hear(&BusEvent::SetPose(fix).into(), log);
        self.bus.update(&self.localization.estimate());
    }

    /// Searches a pose if there is none, as long as a millisecond allows.
    pub fn search(&mut self, mut log: impl FnMut(&Record)) {
        for _ in 0..SLICES {
            if !self.localization.search(&mut log) {
                break;
            }
        }
        self.bus.update(&self.localization.estimate());
    }

    /// The pose for now. None before the localiser has said anything.
    #[must_use]
    pub fn output(&self) -> Option<PoseOutput> {
        self.bus.output()
    }

    /// Its localiser.
    #[must_use]
    pub fn localizer(&self) -> &L {
        self.localization.localizer()
    }
}

/// Does what the bus wants done.
fn take<L: Localize>(
    localization: &mut Localization<L>,
    output: BusOutput,
    send: &mut impl FnMut(&Frame),
    log: &mut impl FnMut(&Record),
) {
    match output {
        BusOutput::Send(frame) => send(&frame),
        BusOutput::Event(told) => localization.hear(&told, log),
        BusOutput::Published(published) => localization.published(&published, log),
        // Whoever hears the bus looks after it.
        BusOutput::Save(_) => {}
    }
}
