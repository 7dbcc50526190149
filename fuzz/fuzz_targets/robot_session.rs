#![no_main]

use agv_fuzz::in_folder;
use agv_host_sim::import::optiodom;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| in_folder(&["a_metadata.csv", "a_run-01.csv"], text, |folder| {
    let _ = optiodom::read(folder);
    let _ = optiodom::read_run(&folder.join("a_run-01.csv"));
}));
