//! What memory is for: not cached where others read and write, no code in the settings, nothing below the stack, nothing
//! where no memory is (PM0253, 4.6 "Memory protection unit").
#![allow(unsafe_code, reason = "memory attributes have no safe interface")]

use core::ops::Range;

use cortex_m::peripheral::MPU;

use super::flash;
use crate::board::stack;

/// CCR of the processor: data bus faults are ignored while FAULTMASK is set, and in the handler of faults (ARMv7-M ARM,
/// B3.2.8).
const CCR: *mut u32 = 0xE000_ED14 as *mut u32;
const BFHFNMIGN: u32 = 1 << 8;

const ENABLE: u32 = 1;
const ENABLE_WITH_DEFAULT_MAP: u32 = 0b101;
const NEVER_RUN: u32 = 1 << 28;
const FULL_ACCESS: u32 = 0b011 << 24;
const NO_ACCESS: u32 = 0;
/// Normal memory, not cached and not shareable (TEX 001, C 0, B 0, S 0). The processor leaves exclusive accesses to shareable
/// memory, of which atomic operations are made, to the bus (DDI0489, 5.6.2), where nobody answers for them: a bus fault.
const NOT_CACHED: u32 = 0b001 << 19;
/// Device memory, shareable (TEX 000, C 0, B 1): every access is made, once, in its order.
const DEVICE: u32 = 1 << 16;

/// Where external memory would be, 6000_0000h to DFFF_FFFFh: four of the eight parts of all addresses. The processor reads ahead
/// wherever nothing forbids it, also where nobody answers, and a preload does so where only the default map does (Arm's
/// erratum 1013783 of the Cortex-M7). The first region, as any other one counts above it: nothing is to be had there.
const NOWHERE: u32 = NEVER_RUN | NO_ACCESS | 0b1000_0111 << 8 | 31 << 1 | ENABLE;

/// A part of memory.
pub struct Region {
    /// Its first address.
    pub base: u32,
    /// Bytes: a power of two, of which the base is a multiple.
    pub size: u32,
}

/// Sets all of it up, and that words of flash with a double error can be read. Before the caches are on.
///
/// The settings' flash is device memory: after it was written, the cache would go on to give what was there before. So it would for the map of
/// contours, which is read where it is and at any address, as no device memory can be. A region without bytes is none.
pub fn enable(mpu: &mut MPU, not_cached: &[Region]) {
    let region = |at: Range<usize>| Region { base: at.start as u32, size: at.len() as u32 };
    let (settings, contours) = (region(flash::settings()), region(flash::contours()));
    let guard = Region { base: stack::bottom() as u32, size: stack::guard() as u32 };
    let apart = [(&settings, FULL_ACCESS | DEVICE), (&contours, FULL_ACCESS | NOT_CACHED), (&guard, NO_ACCESS)];
    let apart = apart.into_iter().filter(|(region, _)| region.size > 0);
    let regions = not_cached.iter().map(|region| (region, FULL_ACCESS | NOT_CACHED)).chain(apart);
    // SAFETY: nothing refers to these parts of memory yet: neither the Ethernet nor the settings have started, and the
    // stack has not come to its end.
    unsafe {
        CCR.write_volatile(CCR.read_volatile() | BFHFNMIGN);
        mpu.ctrl.write(0);
        mpu.rnr.write(0);
        mpu.rbar.write(0);
        mpu.rasr.write(NOWHERE);
        for ((region, attributes), number) in regions.zip(1..) {
            mpu.rnr.write(number);
            mpu.rbar.write(region.base);
            mpu.rasr.write(NEVER_RUN | attributes | (region.size.trailing_zeros() - 1) << 1 | ENABLE);
        }
        mpu.ctrl.write(ENABLE_WITH_DEFAULT_MAP);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
