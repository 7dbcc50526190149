#![no_main]

use agv_lab::campaign::event_fuzz;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Err(what) = event_fuzz::run_bytes(bytes) {
        panic!("{what}");
    }
});
