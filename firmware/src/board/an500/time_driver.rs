//! Time for embassy: CMSDK timer 1 runs free, timer 0 is the alarm (ARM DDI 0479, 4.3).
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

use core::cell::{Cell, RefCell};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
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

/// What the clock showed last, and how often it has wrapped.
#[derive(Clone, Copy)]
struct Clock {
    last: u32,
    wraps: u64,
    is_running: bool,
}

struct CmsdkTimers {
    clock: Mutex<Cell<Clock>>,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static DRIVER: CmsdkTimers = CmsdkTimers {
    clock: Mutex::new(Cell::new(Clock { last: 0, wraps: 0, is_running: false })),
    queue: Mutex::new(RefCell::new(Queue::new())),
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
        let clock = DRIVER.clock.borrow(section);
        clock.set(Clock { is_running: true, ..clock.get() });
    });
}

/// The alarm has gone off.
pub fn on_alarm() {
    critical_section::with(|section| {
        // SAFETY: this is a register of a timer that only this driver uses.
        unsafe { write(ALARM, CLEAR, 1) };
        // Nobody else has it while no interrupt comes.
        if let Ok(mut queue) = DRIVER.queue.borrow(section).try_borrow_mut() {
            DRIVER.arm(section, &mut queue);
        }
    });
}

impl CmsdkTimers {
    /// Microseconds since the start. Called at least every 171 s, as the network has timers of its own.
    fn time(&self, section: CriticalSection) -> u64 {
        let cell = self.clock.borrow(section);
        let mut clock = cell.get();
        if !clock.is_running {
            return 0;
        }
        // SAFETY: this is a register of a timer that only this driver uses; it counts down.
        let shown = u32::MAX - unsafe { read(CLOCK, VALUE) };
        if shown < clock.last {
            clock.wraps += 1;
        }
        clock.last = shown;
        cell.set(clock);
        ((clock.wraps << 32) + u64::from(shown)) / TICKS_A_MICROSECOND
    }

    /// Sets the alarm to the next task that waits.
    fn arm(&self, section: CriticalSection, queue: &mut Queue) {
        loop {
            let next = queue.next_expiration(self.time(section));
            if next == u64::MAX {
                return;
            }
            let now = self.time(section);
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
        critical_section::with(|section| self.time(section))
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|section| {
            let mut queue = self.queue.borrow(section).borrow_mut();
            if queue.schedule_wake(at, waker) {
                self.arm(section, &mut queue);
            }
        });
    }
}
