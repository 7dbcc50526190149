//! FDCAN1, with queues behind those of the controller, which hold three frames.
//!
//! What is known of the released driver and kept away from here: its compensation of the transceiver's delay (needed only
//! with bit rate switching, which is off), and its receive time, which it computes from the controller's counter in the mode
//! for classic frames alone, and can then lie before the start. In the mode that takes other frames, too, it states the time
//! of the interrupt. It leaves bus-off at once, and it goes on to send what has waited for as long as nobody has listened.

use core::num::{NonZeroU8, NonZeroU16};

use agv_core::measurement::Time;
use agv_wire::can::bit_timing::BitTiming;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::frame::{Frame, Id};
use embassy_stm32::Peri;
use embassy_stm32::can::config::{
    FrameTransmissionConfig, GlobalFilter, NominalBitTiming, NonMatchingFilter, TxBufferMode,
};
use embassy_stm32::can::filter::{
    Action, ExtendedFilter, ExtendedFilterSlot, FilterType, StandardFilter, StandardFilterSlot,
};
use embassy_stm32::can::{BufferedCan, BufferedCanSender, CanConfigurator, OperatingMode, RxBuf, TxBuf};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::FDCAN1 as REGISTERS;
use embassy_stm32::peripherals::{FDCAN1, PD0, PD1};
use portable_atomic::{AtomicU32, Ordering};
use static_cell::ConstStaticCell;

use super::Interrupts;
use crate::app::can_port::{BusChange, CanPort};

/// Frames that wait to be sent.
const SENT: usize = 32;
/// Frames that wait for the bus task: 10 ms of a bus that is full of what is meant for the controller.
const RECEIVED: usize = 40;
/// Buffers of the controller.
const BUFFERS: u32 = 0b111;

/// Clock of the controller, Hz.
const CLOCK: u32 = 80_000_000;
/// 500 kbit/s, for a bit rate that this clock does not give.
const USUAL: BitTiming = BitTiming { prescaler: 10, before: 13, behind: 2, jump: 2 };

/// Places for what is listened to: everybody, the controller, its encoders, and nodes whose heartbeats are watched.
const SLOTS: [StandardFilterSlot; 10] = [
    StandardFilterSlot::_0,
    StandardFilterSlot::_1,
    StandardFilterSlot::_2,
    StandardFilterSlot::_3,
    StandardFilterSlot::_4,
    StandardFilterSlot::_5,
    StandardFilterSlot::_6,
    StandardFilterSlot::_7,
    StandardFilterSlot::_8,
    StandardFilterSlot::_9,
];
/// Places for frames of no such node: those of the vehicle's own controller and of a gyro.
const OTHERS: [(StandardFilterSlot, ExtendedFilterSlot); 3] = [
    (StandardFilterSlot::_10, ExtendedFilterSlot::_0),
    (StandardFilterSlot::_11, ExtendedFilterSlot::_1),
    (StandardFilterSlot::_12, ExtendedFilterSlot::_2),
];

/// What has become of the last frame, LEC of the controller's PSR (RM0433, "FDCAN protocol status register"): it was sent or heard;
/// or nobody has acknowledged it. Anything else is a disturbance, or nothing since this was read last.
const NO_ERROR: u8 = 0;
const UNACKNOWLEDGED: u8 = 3;

/// While nobody acknowledges, a frame waits for so long at most, us.
const STALE: u64 = 20_000;
/// How long the controller stays away from a bus whose errors have driven it off: this at first, us, twice as long each
/// time, and that at most.
const BACK_OFF: (u64, u64) = (100_000, 3_200_000);
/// The time away is the first one again when there were no errors for so long, us.
const FORGOTTEN: u64 = 10_000_000;

static SENT_FRAMES: ConstStaticCell<TxBuf<SENT>> = ConstStaticCell::new(TxBuf::new());
static RECEIVED_FRAMES: ConstStaticCell<RxBuf<RECEIVED>> = ConstStaticCell::new(RxBuf::new());
static LOST: AtomicU32 = AtomicU32::new(0);

/// The same frame of another library.
fn same<From: embedded_can::Frame, To: embedded_can::Frame>(frame: &From) -> Option<To> {
    if frame.is_remote_frame() { To::new_remote(frame.id(), frame.dlc()) } else { To::new(frame.id(), frame.data()) }
}

/// Whether the controller takes part.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Presence {
    There,
    /// It stays away until then, us.
    Away(u64),
    /// It waits for the bus to be quiet for 128 times eleven bits.
    Returning,
}

/// The bus.
pub struct FdCanPort {
    bus: BufferedCan<'static, SENT, RECEIVED>,
    sender: BufferedCanSender,
    listens_only: bool,
    /// Whether the last frame was acknowledged by nobody, and none was heard since.
    is_unheard: bool,
    /// Since when something waits that nobody acknowledges, us.
    unheard_since: Option<u64>,
    /// Whether what is said until the next look at the controller is sent.
    may_send: bool,
    presence: Presence,
    back_off: u64,
    last_off: u64,
}

/// What the bus is made of.
pub struct CanParts {
    /// The controller.
    pub controller: Peri<'static, FDCAN1>,
    /// The transceiver's pins, receiving and transmitting.
    pub pins: (Peri<'static, PD0>, Peri<'static, PD1>),
    /// By how much the clock may be off, millionths.
    pub clock_tolerance: u32,
}

impl CanParts {
    /// Takes part in the bus of that many kbit/s, or only listens if the clock is so far off that it would disturb it. Call
    /// once.
    #[must_use]
    pub fn start(self, bit_rate: u16) -> FdCanPort {
        let Self { controller, pins: (receive, transmit), clock_tolerance } = self;
        let mut configurator = CanConfigurator::new(controller, receive, transmit, Interrupts);
        let found = BitTiming::new(CLOCK, bit_rate).unwrap_or(USUAL);
        let timing = NominalBitTiming {
            prescaler: NonZeroU16::new(found.prescaler).unwrap_or(NonZeroU16::MIN),
            seg1: NonZeroU8::new(found.before).unwrap_or(NonZeroU8::MIN),
            seg2: NonZeroU8::new(found.behind).unwrap_or(NonZeroU8::MIN),
            sync_jump_width: NonZeroU8::new(found.jump).unwrap_or(NonZeroU8::MIN),
        };
        // Frames that no filter takes are those of nobody that this controller listens to.
        let filter = GlobalFilter::default()
            .set_handle_standard_frames(NonMatchingFilter::Reject)
            .set_handle_extended_frames(NonMatchingFilter::Reject);
        let config = configurator
            .config()
            .set_frame_transmit(FrameTransmissionConfig::AllowFdCan)
            .set_nominal_bit_timing(timing)
            .set_global_filter(filter)
            // In the order in which they were said: by priority, a later frame of the same identifier may go first.
            .set_tx_buffer_mode(TxBufferMode::Fifo)
            .set_automatic_bus_off_recovery(false);
        configurator.set_config(config);
        let listens_only = clock_tolerance > found.tolerance();
        let mode = if listens_only { OperatingMode::BusMonitoringMode } else { OperatingMode::NormalOperationMode };
        let bus = configurator.start(mode).buffered(SENT_FRAMES.take(), RECEIVED_FRAMES.take());
        let sender = bus.writer();
        FdCanPort {
            bus,
            sender,
            listens_only,
            is_unheard: false,
            unheard_since: None,
            may_send: false,
            presence: Presence::There,
            back_off: BACK_OFF.0,
            last_off: 0,
        }
    }
}

impl FdCanPort {
    /// Throws away what waits to be sent: it is too old for whoever comes back.
    fn forget_waiting(&self) {
        // The driver moves one frame on from its queue each time that its interrupt comes.
        for _ in 0..=SENT {
            let waiting = REGISTERS.txbrp().read().0 & BUFFERS;
            REGISTERS.txbcr().write(|cancelled| cancelled.0 = waiting);
            LOST.fetch_add(waiting.count_ones(), Ordering::Relaxed);
            interrupt::FDCAN1_IT0.pend();
            cortex_m::asm::isb();
        }
        let waiting = REGISTERS.txbrp().read().0 & BUFFERS;
        REGISTERS.txbcr().write(|cancelled| cancelled.0 = waiting);
    }

    /// Goes away from a bus whose errors have driven the controller off, and comes back.
    fn follow_bus_off(&mut self, is_bus_off: bool, now: u64) -> Option<BusChange> {
        let is_off = REGISTERS.cccr().read().init();
        match self.presence {
            Presence::There if is_off => {
                let is_forgotten = now.saturating_sub(self.last_off) > FORGOTTEN;
                self.back_off = if is_forgotten { BACK_OFF.0 } else { (2 * self.back_off).min(BACK_OFF.1) };
                self.last_off = now;
                self.presence = Presence::Away(now + self.back_off);
                self.forget_waiting();
                Some(BusChange::Off)
            }
            Presence::Away(until) if now >= until => {
                REGISTERS.cccr().modify(|control| control.set_init(false));
                self.presence = Presence::Returning;
                None
            }
            Presence::Returning if !is_bus_off => {
                self.is_unheard = false;
                self.presence = Presence::There;
                Some(BusChange::BackFromOff)
            }
            _ => None,
        }
    }

    /// Notes what has become of the last frame.
    ///
    /// An error passive controller may well be heard: it is one that was disturbed before. Silence is that nobody acknowledges.
    const fn note(&mut self, last_error: u8) {
        match last_error {
            NO_ERROR => self.is_unheard = false,
            UNACKNOWLEDGED => self.is_unheard = true,
            _ => {}
        }
    }

    fn is_waiting() -> bool {
        REGISTERS.txbrp().read().0 & BUFFERS != 0
    }

    /// Throws away what nobody has acknowledged for too long.
    fn forget_stale(&mut self, now: u64) {
        if !self.is_unheard || !Self::is_waiting() {
            self.unheard_since = None;
            return;
        }
        let since = *self.unheard_since.get_or_insert(now);
        if now.saturating_sub(since) >= STALE {
            self.unheard_since = None;
            self.forget_waiting();
        }
    }
}

impl CanPort for FdCanPort {
    fn listen_to(&mut self, nodes: &[NodeId], others: &[Id]) {
        // Commands to all nodes and the SYNC, which have number 0, and everything from or for the others.
        let numbers = core::iter::once(0).chain(nodes.iter().map(|node| u16::from(node.number())));
        let mut numbers = numbers.map(|number| FilterType::BitMask { filter: number, mask: 0x7F });
        for slot in SLOTS {
            // Places that are not needed any more take nothing.
            let filter = match numbers.next() {
                Some(filter) => StandardFilter { filter, action: Action::StoreInFifo0 },
                None => StandardFilter::disable(),
            };
            self.bus.properties().set_standard_filter(slot, filter);
        }
        let action = Action::StoreInFifo0;
        for (id, (standard, extended)) in others.iter().zip(OTHERS) {
            match id {
                Id::Standard(id) => {
                    let filter = FilterType::BitMask { filter: id.as_raw(), mask: 0x7FF };
                    let filter = StandardFilter { filter, action };
                    self.bus.properties().set_standard_filter(standard, filter);
                }
                Id::Extended(id) => {
                    let filter = FilterType::BitMask { filter: id.as_raw(), mask: 0x1FFF_FFFF };
                    let filter = ExtendedFilter { filter, action };
                    self.bus.properties().set_extended_filter(extended, filter);
                }
            }
        }
    }

    async fn receive(&mut self) -> (Frame, Time) {
        loop {
            // Errors of the bus end by themselves; what they cost is missed by those who wait for it.
            let Ok(envelope) = self.bus.read().await else {
                LOST.fetch_add(1, Ordering::Relaxed);
                continue;
            };
            let (frame, heard) = envelope.parts();
            if let Some(frame) = same::<_, Frame>(&frame) {
                return (frame, Time::from_micros(heard.as_micros()));
            }
        }
    }

    fn send(&mut self, frame: &Frame) -> bool {
        let is_sent = self.may_send && same(frame).is_some_and(|frame| self.sender.try_write(frame).is_ok());
        if !is_sent {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
        is_sent
    }

    fn supervise(&mut self, now: Time) -> Option<BusChange> {
        let now = now.micros();
        // Reading it forgets what has become of the last frame, so nobody else does.
        let status = REGISTERS.psr().read();
        self.note(status.lec());
        self.forget_stale(now);
        let change = self.follow_bus_off(status.bo(), now);
        // While nobody listens, what is said at one time tries whether somebody does, all of it or nothing.
        let has_place = !self.is_unheard || !Self::is_waiting();
        self.may_send = !self.listens_only && self.presence == Presence::There && has_place;
        if change.is_none() && REGISTERS.ir().read().rfl(0) {
            // Frames came while the controller's queue was full; how many, it does not say.
            REGISTERS.ir().write(|flags| flags.set_rfl(0, true));
            LOST.fetch_add(1, Ordering::Relaxed);
            return Some(BusChange::Overrun);
        }
        change
    }

    fn lost(&self) -> u32 {
        LOST.load(Ordering::Relaxed)
    }
}
