//! Calibrates a vehicle from a small drive, and writes the bits of the result, and what that cost, to
//! `calibration.txt` of the emulating machine's folder. The emulator must run with `-icount shift=6,sleep=off`.
#![no_std]
#![no_main]

#[path = "../../../core/tests/support/reference_drive.rs"]
mod reference_drive;

use core::fmt::Write;
use core::mem::size_of;
use core::panic::PanicInfo;

use agv_core::calibration::{CALIBRATION_SEGMENTS, Calibrator};
use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::panic;
use agv_firmware::board::an500::stopwatch::Stopwatch;
use agv_firmware::board::stack;
use cortex_m_semihosting::debug;
use heapless::String;

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    panic::report(info)
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut bits = None;
    stack::paint();
    let before = stack::deepest();
    let instructions = Stopwatch::new().count(|| bits = reference_drive::reference_drive_bits().ok());
    let depth = stack::deepest() - before;
    let mut text: String<2048> = String::new();
    let bytes = size_of::<Calibrator<CALIBRATION_SEGMENTS>>();
    writeln!(text, "{bytes} bytes, {depth} bytes of stack, {instructions} instructions").expect("the text fits");
    for number in bits.expect("the drive is a good one") {
        writeln!(text, "{number:016x}").expect("the text fits");
    }
    let mut output = HostFile::create(c"calibration.txt").expect("the folder can be written");
    output.write(text.as_bytes()).expect("the folder can be written");
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
