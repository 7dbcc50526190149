#![no_main]

use agv_host_sim::layout_file;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let folder = std::env::temp_dir();
    for ending in ["csv", "imk"] {
        let path = folder.join(format!("agv-fuzz-layout-{}.{ending}", std::process::id()));
        if std::fs::write(&path, text).is_ok() {
            let _ = layout_file::load(&path);
        }
    }
});
