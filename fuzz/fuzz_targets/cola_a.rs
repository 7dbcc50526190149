#![no_main]

use agv_wire::cola::Dialect;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    agv_fuzz::decode(Dialect::Ascii, bytes);
    agv_fuzz::stream(bytes);
});
