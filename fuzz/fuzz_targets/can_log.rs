#![no_main]

use std::path::Path;

use agv_host_sim::import::can_log;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = can_log::of_text(Path::new("fuzz"), text);
});
