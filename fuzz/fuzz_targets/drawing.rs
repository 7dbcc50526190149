#![no_main]

use agv_fuzz::in_file;
use agv_host_sim::{foreign_code, layout_file};
use libfuzzer_sys::fuzz_target;

fuzz_target!(
    init: std::panic::set_hook(Box::new(|panic| {
        if !foreign_code::is_at_work() {
            eprintln!("{panic}");
            std::process::abort();
        }
    })),
    |bytes: &[u8]| in_file("drawing.dxf", bytes, |path| {
        let _ = layout_file::load(path);
    })
);
