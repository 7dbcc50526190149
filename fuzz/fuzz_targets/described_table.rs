#![no_main]

use agv_fuzz::in_folder;
use agv_host_sim::import::wheel_recording;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| in_folder(&["columns.toml", "table.csv"], text, |folder| {
    let _ = wheel_recording::read(&folder.join("table.csv"), &folder.join("columns.toml"));
}));
