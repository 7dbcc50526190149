//! A flood of frames takes a bounded share of the processor's time.

use core::task::Context;

use embassy_net_driver::{Capabilities, Driver, HardwareAddress, LinkState};
use embassy_time::Instant;

/// Frames that are taken in each millisecond: more than ten megabytes in a second.
const FRAMES: u32 = 8;
/// Length of a slot, us.
const SLOT: u64 = 1000;

/// An Ethernet controller whose frames are taken no faster than that; the rest is left to its own queue, which drops.
pub struct Throttle<D> {
    driver: D,
    slot: u64,
    taken: u32,
}

impl<D> Throttle<D> {
    /// Takes frames of `driver`.
    #[must_use]
    pub const fn new(driver: D) -> Self {
        Self { driver, slot: 0, taken: 0 }
    }
}

impl<D: Driver> Driver for Throttle<D> {
    type RxToken<'a>
        = D::RxToken<'a>
    where
        Self: 'a;
    type TxToken<'a>
        = D::TxToken<'a>
    where
        Self: 'a;

    fn receive(&mut self, context: &mut Context) -> Option<(Self::RxToken<'_>, Self::TxToken<'_>)> {
        let slot = Instant::now().as_micros() / SLOT;
        if slot != self.slot {
            self.slot = slot;
            self.taken = 0;
        }
        if self.taken >= FRAMES {
            embassy_time_driver::schedule_wake((slot + 1) * SLOT, context.waker());
            return None;
        }
        let received = self.driver.receive(context);
        if received.is_some() {
            self.taken += 1;
        }
        received
    }

    fn transmit(&mut self, context: &mut Context) -> Option<Self::TxToken<'_>> {
        self.driver.transmit(context)
    }

    fn link_state(&mut self, context: &mut Context) -> LinkState {
        self.driver.link_state(context)
    }

    fn capabilities(&self) -> Capabilities {
        self.driver.capabilities()
    }

    fn hardware_address(&self) -> HardwareAddress {
        self.driver.hardware_address()
    }
}
