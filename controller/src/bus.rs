//! All that the controller hears and says on the CAN bus.

use agv_core::localizer::OutputPredictor;
use agv_core::measurement::{EncoderFaults, Time};
use agv_core::state::{LaserHealth, PoseOutput, Relocalization};
use agv_settings::Settings;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::controller::{Health, PosePublisher};
use agv_wire::can::controller_node::ControllerNode;
use agv_wire::can::emcy::Emergency;
use agv_wire::can::frame::Frame;

use super::encoders::{BusEvent, EncoderNodes, EncoderOutput, Encoders};
use super::localization::Estimate;
use super::progress::{Progress, SentPose, Told};
use super::standstill::Standstill;

/// Motions that the localiser may be behind: more than a scan takes. All of them are redone when it has spoken, which with
/// 16 of them is 0.1 ms at 480 MHz; the bus's queue holds three frames, 0.3 ms.
pub const MOTIONS: usize = 16;

/// What was wrong when the controller started, told once on the bus in the codes of CiA 301, table 26.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Troubles {
    /// A part of the board does not work (5000h).
    pub is_board_damaged: bool,
    /// The program ended by itself the last time (6100h).
    pub has_panicked: bool,
    /// Not everything that was set was found (6300h).
    pub are_settings_lost: bool,
}

impl Troubles {
    fn codes(self) -> impl Iterator<Item = u16> {
        let hardware = self.is_board_damaged.then_some(0x5000);
        let internal_software = self.has_panicked.then_some(0x6100);
        let data_set = self.are_settings_lost.then_some(0x6300);
        hardware.into_iter().chain(internal_software).chain(data_set)
    }
}

/// What comes of a look at the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BusOutput {
    /// A frame is to be sent.
    Send(Frame),
    /// The localiser is told something.
    Event(Told),
    /// A pose went out, in the frames before.
    Published(SentPose),
}

/// The encoders, the controller's own node, and the pose for now.
#[derive(Clone, Debug)]
pub struct Bus {
    nodes: EncoderNodes,
    encoders: Encoders,
    node: ControllerNode,
    publisher: PosePublisher,
    predictor: OutputPredictor<MOTIONS>,
    progress: Progress,
    standstill: Standstill,
    faults: EncoderFaults,
    relocalization: Relocalization,
    troubles: Troubles,
    has_told_troubles: bool,
}

impl Bus {
    /// A bus on which nobody was heard before `start`.
    #[must_use]
    pub fn new(settings: &Settings, troubles: Troubles, start: Time) -> Self {
        let nodes = EncoderNodes::of(settings);
        Self {
            nodes,
            encoders: Encoders::new(&nodes, &settings.parameters, start),
            node: ControllerNode::new(nodes.controller, start),
            publisher: PosePublisher::new(nodes.controller, settings.parameters.alert_limits, start),
            predictor: OutputPredictor::new(&settings.parameters),
            progress: Progress::default(),
            standstill: Standstill::new(),
            faults: EncoderFaults::default(),
            relocalization: Relocalization::Idle,
            troubles,
            has_told_troubles: false,
        }
    }

    /// The localiser has said something.
    pub fn update(&mut self, estimate: &Estimate) {
        // Only the search may have got further. Before the first answer a vehicle without a pose is published.
        let is_first = !self.predictor.has_output();
        if core::mem::replace(&mut self.progress.answered, estimate.answered) != estimate.answered || is_first {
            self.predictor.update(&estimate.pose, &estimate.bias);
        }
        self.relocalization = estimate.relocalization;
    }

    /// Takes a frame that came at `heard`: at most two events and an answer.
    pub fn hear(&mut self, frame: &Frame, heard: Time, mut take: impl FnMut(BusOutput)) {
        let Self { encoders, predictor, progress, standstill, .. } = self;
        encoders.hear(frame, heard, |event| {
            if let BusEvent::Encoders(sample) = &event {
                predictor.encoders(sample);
                standstill.sample(sample);
            }
            take(BusOutput::Event(progress.tell(event)));
        });
        if let Some(answer) = self.node.handle(frame) {
            take(BusOutput::Send(answer));
        }
    }

    /// Does what is due at `now`. To be called at least every 5 ms; a pose that is late is left out, the next one is for its
    /// own time.
    pub fn poll(&mut self, now: Time, laser: LaserHealth, mut take: impl FnMut(BusOutput)) {
        let Self { encoders, predictor, progress, faults, .. } = self;
        encoders.poll(now, |output| match output {
            EncoderOutput::Send(frame) => take(BusOutput::Send(frame)),
            EncoderOutput::Event(event) => {
                if let BusEvent::EncoderFaults(found) = &event {
                    *faults = *found;
                    predictor.doubt_encoders(found);
                }
                take(BusOutput::Event(progress.tell(event)));
            }
        });
        while let Some(frame) = self.node.poll(now) {
            take(BusOutput::Send(frame));
        }
        if !self.node.is_operational() {
            return;
        }
        if !core::mem::replace(&mut self.has_told_troubles, true) {
            for code in self.troubles.codes() {
                take(BusOutput::Send(self.emergency(code)));
            }
        }
        if now < self.publisher.next() {
            return;
        }
        let Some(output) = self.predictor.output() else { return };
        let EncoderFaults { drive, steering, .. } = self.faults;
        let health = Health { drive, steering, laser, start_search: self.relocalization };
        let mut has_published = false;
        for frame in self.publisher.poll(now, &output, &health).iter().flatten() {
            has_published = true;
            take(BusOutput::Send(*frame));
        }
        if has_published {
            take(BusOutput::Published(SentPose { pose: output, progress: self.progress }));
        }
    }

    /// The nodes whose frames mean something here: the controller and its encoders.
    #[must_use]
    pub fn nodes(&self) -> [NodeId; 3] {
        [self.nodes.controller, self.nodes.drive, self.nodes.steering]
    }

    /// An error or its end, in the codes of CiA 301, table 26, as the controller's frame.
    #[must_use]
    pub fn emergency(&self, code: u16) -> Frame {
        let emergency = Emergency { code, register: 1, details: [0; 5] };
        Message::Emergency { node: self.nodes.controller, emergency }.encode()
    }

    /// The pose for now. None before the localiser has said anything.
    #[must_use]
    pub fn output(&self) -> Option<PoseOutput> {
        self.predictor.output()
    }

    /// Whether the vehicle stands: see [`Standstill::stands`].
    #[must_use]
    pub fn is_standing(&self, now: Time) -> bool {
        self.standstill.stands(now)
    }
}
