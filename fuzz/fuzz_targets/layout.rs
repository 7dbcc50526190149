#![no_main]

use agv_fuzz::in_file;
use agv_host_sim::layout_file;
use agv_host_sim::mapping::map_file;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    in_file("map", text.as_bytes(), |path| {
        let _ = map_file::read(path);
    });
    for name in ["layout.csv", "layout.imk"] {
        in_file(name, text.as_bytes(), |path| {
            let _ = layout_file::load(path);
        });
    }
});
