#![no_main]

use agv_fuzz::in_file;
use agv_host_sim::import::{carmen, graph_log};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| in_file("scan", text.as_bytes(), |path| {
    let _ = carmen::read(path);
    let _ = graph_log::read(path);
}));
