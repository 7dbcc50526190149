//! Caches, and the memory that is not cached (PM0253, 4.6 "Memory protection unit").
#![allow(unsafe_code, reason = "memory attributes and copies of code have no safe interface")]

use cortex_m::Peripherals;
use cortex_m::peripheral::MPU;

/// SRAM1 of domain D2, where the Ethernet's DMA reads and writes.
const ETHERNET: u32 = 0x3000_0000;
/// 128 KiB: two to the power of this field plus one.
const SIZE: u32 = 16;

const ENABLE: u32 = 1;
const ENABLE_WITH_DEFAULT_MAP: u32 = 0b101;
/// Normal memory, shareable and not cached (TEX 001, C 0, B 0, S 1), full access, no code.
const NOT_CACHED: u32 = 1 << 28 | 0b011 << 24 | 0b001 << 19 | 1 << 18;

unsafe extern "C" {
    static mut __sitcm: u64;
    static mut __eitcm: u64;
    static __siitcm: u64;
}

/// Sets up memory, and turns on both caches.
pub fn enable(core: &mut Peripherals) {
    // SAFETY: the words between these symbols are a copy of functions in flash, of which none has been called; nobody
    // else writes there. Volatile accesses keep the copy from becoming a call of one of them.
    unsafe {
        let mut from = &raw const __siitcm;
        let mut to = &raw mut __sitcm;
        while to < &raw mut __eitcm {
            to.write_volatile(from.read_volatile());
            from = from.add(1);
            to = to.add(1);
        }
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    protect(&mut core.MPU);
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

fn protect(mpu: &mut MPU) {
    // SAFETY: the region is used by the Ethernet alone, which has not started.
    unsafe {
        mpu.ctrl.write(0);
        mpu.rnr.write(0);
        mpu.rbar.write(ETHERNET);
        mpu.rasr.write(NOT_CACHED | SIZE << 1 | ENABLE);
        mpu.ctrl.write(ENABLE_WITH_DEFAULT_MAP);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
