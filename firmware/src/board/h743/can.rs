//! FDCAN1 at 500 kbit/s, with queues behind those of the controller, which hold three frames.
//!
//! What is known of the released driver and kept away from here: its compensation of the transceiver's delay (needed only
//! with bit rate switching, which is off), its range filters (none is set: everything is heard), and its receive time,
//! which it computes from the controller's counter in the mode for classic frames alone, and can then lie before the start.
//! In the mode that takes other frames, too, it states the time of the interrupt.

use agv_core::measurement::Time;
use agv_wire::can::frame::Frame;
use embassy_stm32::Peri;
use embassy_stm32::can::config::FrameTransmissionConfig;
use embassy_stm32::can::{BufferedCan, BufferedCanSender, CanConfigurator, RxBuf, RxPin, TxBuf, TxPin};
use embassy_stm32::peripherals::FDCAN1;
use portable_atomic::{AtomicU32, Ordering};
use static_cell::ConstStaticCell;

use super::Interrupts;
use crate::app::can_port::CanPort;

/// Frames that wait to be sent.
const SENT: usize = 32;
/// Frames that wait for the bus task: 10 ms of a full bus.
const RECEIVED: usize = 48;

const BIT_RATE: u32 = 500_000;

static SENT_FRAMES: ConstStaticCell<TxBuf<SENT>> = ConstStaticCell::new(TxBuf::new());
static RECEIVED_FRAMES: ConstStaticCell<RxBuf<RECEIVED>> = ConstStaticCell::new(RxBuf::new());
static LOST: AtomicU32 = AtomicU32::new(0);

/// The same frame of another library.
fn same<From: embedded_can::Frame, To: embedded_can::Frame>(frame: &From) -> Option<To> {
    if frame.is_remote_frame() { To::new_remote(frame.id(), frame.dlc()) } else { To::new(frame.id(), frame.data()) }
}

/// The bus.
pub struct FdCanPort {
    bus: BufferedCan<'static, SENT, RECEIVED>,
    sender: BufferedCanSender,
}

impl FdCanPort {
    /// Takes part in the bus. Call once.
    #[must_use]
    pub fn start(
        instance: Peri<'static, FDCAN1>,
        receive: Peri<'static, impl RxPin<FDCAN1>>,
        transmit: Peri<'static, impl TxPin<FDCAN1>>,
        interrupts: Interrupts,
    ) -> Self {
        let mut configurator = CanConfigurator::new(instance, receive, transmit, interrupts);
        configurator.set_bitrate(BIT_RATE);
        let config = configurator.config().set_frame_transmit(FrameTransmissionConfig::AllowFdCan);
        configurator.set_config(config);
        let bus = configurator.into_normal_mode().buffered(SENT_FRAMES.take(), RECEIVED_FRAMES.take());
        let sender = bus.writer();
        Self { bus, sender }
    }
}

impl CanPort for FdCanPort {
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
        let is_sent = same(frame).is_some_and(|frame| self.sender.try_write(frame).is_ok());
        if !is_sent {
            LOST.fetch_add(1, Ordering::Relaxed);
        }
        is_sent
    }

    fn lost(&self) -> u32 {
        LOST.load(Ordering::Relaxed)
    }
}
