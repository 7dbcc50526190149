//! Time for embassy: CMSDK timer 1 runs free, timer 0 is the alarm (ARM DDI 0479, 4.3).
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

use core::cell::RefCell;
use core::task::Waker;

use critical_section::Mutex;
use embassy_time_driver::Driver;
use embassy_time_queue_utils::Queue;

use super::registers::{read, write};

const ALARM: usize = 0x4000_0000;
const CLOCK: usize = 0x4000_1000;
const CONTROL: usize = 0;
const VALUE: usize = 4;
const RELOAD: usize = 8;
const CLEAR: usize = 12;
const ENABLE: u32 = 1;
const ENABLE_WITH_INTERRUPT: u32 = 0b1001;

/// Both timers count at 25 MHz.
const TICKS_A_MICROSECOND: u64 = 25;

struct State {
    queue: Queue,
    /// What the clock showed last, and how often it has wrapped.
    last: u32,
    wraps: u64,
    is_running: bool,
}

struct CmsdkTimers {
    state: Mutex<RefCell<State>>,
}

embassy_time_driver::time_driver_impl!(static DRIVER: CmsdkTimers = CmsdkTimers {
    state: Mutex::new(RefCell::new(State { queue: Queue::new(), last: 0, wraps: 0, is_running: false })),
});

/// Starts the clock.
pub fn start() {
    critical_section::with(|section| {
        // SAFETY: these are the registers of a timer that only this driver uses.
        unsafe {
            write(CLOCK, CONTROL, 0);
            write(CLOCK, RELOAD, u32::MAX);
            write(CLOCK, VALUE, u32::MAX);
            write(CLOCK, CONTROL, ENABLE);
        }
        DRIVER.state.borrow(section).borrow_mut().is_running = true;
    });
}

/// The alarm has gone off.
pub fn on_alarm() {
    critical_section::with(|section| {
        let mut state = DRIVER.state.borrow(section).borrow_mut();
        // SAFETY: this is a register of a timer that only this driver uses.
        unsafe { write(ALARM, CLEAR, 1) };
        state.arm();
    });
}

impl State {
    /// Microseconds since the start. Called at least every 171 s, as the network has timers of its own.
    fn now(&mut self) -> u64 {
        if !self.is_running {
            return 0;
        }
        // SAFETY: this is a register of a timer that only this driver uses; it counts down.
        let shown = u32::MAX - unsafe { read(CLOCK, VALUE) };
        if shown < self.last {
            self.wraps += 1;
        }
        self.last = shown;
        ((self.wraps << 32) + u64::from(shown)) / TICKS_A_MICROSECOND
    }

    /// Sets the alarm to the next task that waits.
    fn arm(&mut self) {
        loop {
            let now = self.now();
            let next = self.queue.next_expiration(now);
            if next == u64::MAX {
                return;
            }
            let now = self.now();
            if next <= now {
                continue;
            }
            let ticks = ((next - now) * TICKS_A_MICROSECOND).min(u64::from(u32::MAX)) as u32;
            // SAFETY: these are registers of a timer that only this driver uses. One shot: without a reload.
            unsafe {
                write(ALARM, CONTROL, 0);
                write(ALARM, CLEAR, 1);
                write(ALARM, RELOAD, 0);
                write(ALARM, VALUE, ticks);
                write(ALARM, CONTROL, ENABLE_WITH_INTERRUPT);
            }
            return;
        }
    }
}

impl Driver for CmsdkTimers {
    fn now(&self) -> u64 {
        critical_section::with(|section| self.state.borrow(section).borrow_mut().now())
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|section| {
            let mut state = self.state.borrow(section).borrow_mut();
            if state.queue.schedule_wake(at, waker) {
                state.arm();
            }
        });
    }
}
