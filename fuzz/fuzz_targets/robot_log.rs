#![no_main]

use agv_fuzz::in_file;
use agv_host_sim::import::sapienza;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| in_file("robot", text.as_bytes(), |path| {
    let _ = sapienza::read(path);
}));
