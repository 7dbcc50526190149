#![no_main]

use agv_host_sim::import::{carmen, graph_log};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let folder = std::env::temp_dir();
    let path = folder.join(format!("agv-fuzz-scan-log-{}", std::process::id()));
    if std::fs::write(&path, text).is_ok() {
        let _ = carmen::read(&path);
        let _ = graph_log::read(&path);
    }
});
