#![no_main]

use agv_fuzz::in_file;
use agv_host_sim::layout_file;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| in_file("drawing.dxf", bytes, |path| {
    let _ = layout_file::load(path);
}));
