//! What survives a restart. The first run panics; the second one finds what was said, writes it to `panic.txt` in the
//! emulating machine's folder, and stops to feed the watchdog; the third one, which the watchdog has started, writes
//! `watchdog.txt` and ends.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::watchdog::ApbWatchdog;
use agv_firmware::board::{self, retained};
use cortex_m_semihosting::debug;
use defmt_semihosting as _;

#[panic_handler]
fn on_panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    retained::keep(info);
    board::restart()
}

defmt::timestamp!("{=u64:us}", 0);

#[cortex_m_rt::entry]
fn main() -> ! {
    if HostFile::open(c"panic.txt").is_ok() {
        let written = HostFile::create(c"watchdog.txt").and_then(|mut file| file.write(b"bitten"));
        debug::exit(if written.is_ok() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    }
    let said = retained::read();
    assert!(!said.is_empty(), "nothing was said before {}", 42);
    retained::forget();
    let written = HostFile::create(c"panic.txt").and_then(|mut file| file.write(said.as_bytes()));
    if written.is_err() {
        debug::exit(debug::EXIT_FAILURE);
    }
    ApbWatchdog::new().unleash();
    loop {
        cortex_m::asm::nop();
    }
}
