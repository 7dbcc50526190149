//! Counts instructions by a timer of the emulated board.
//!
//! With `-icount shift=6,sleep=off` an instruction takes 64 ns of virtual time, and the CMSDK timer counts at 25 MHz
//! (ARM DDI 0479, 4.3): 1.6 ticks an instruction, so the count is exact.
#![allow(unsafe_code, reason = "registers are at fixed addresses")]

/// CMSDK timer 1, which nothing else uses.
const BASE: usize = 0x4000_1000;
const CONTROL: *mut u32 = BASE as *mut u32;
const VALUE: *mut u32 = (BASE + 4) as *mut u32;
const RELOAD: *mut u32 = (BASE + 8) as *mut u32;
const ENABLE: u32 = 1;

/// Ticks of the timer in five instructions.
const TICKS_OF_FIVE: u64 = 8;

/// Counts instructions.
pub struct Stopwatch {
    overhead: u64,
}

impl Stopwatch {
    /// Starts the timer.
    #[must_use]
    pub fn new() -> Self {
        // SAFETY: the addresses are those of a timer that only this stopwatch uses.
        unsafe {
            CONTROL.write_volatile(0);
            RELOAD.write_volatile(u32::MAX);
            VALUE.write_volatile(u32::MAX);
            CONTROL.write_volatile(ENABLE);
        }
        let mut stopwatch = Self { overhead: 0 };
        stopwatch.overhead = stopwatch.count(|| {});
        stopwatch
    }

    fn ticks() -> u32 {
        // SAFETY: as in `new`; the timer counts down.
        u32::MAX - unsafe { VALUE.read_volatile() }
    }

    /// How many instructions `work` takes, without those of the counting itself.
    pub fn count(&self, work: impl FnOnce()) -> u64 {
        let start = Self::ticks();
        work();
        let ticks = u64::from(Self::ticks().wrapping_sub(start));
        ((5 * ticks + TICKS_OF_FIVE / 2) / TICKS_OF_FIVE).saturating_sub(self.overhead)
    }
}

impl Default for Stopwatch {
    fn default() -> Self {
        Self::new()
    }
}
