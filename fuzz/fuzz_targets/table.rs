#![no_main]

use agv_fuzz::in_file;
use agv_host_sim::import::poses;
use agv_host_sim::import::wheel_table::{self, Column, TableColumns, WheelColumns};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let column = |name: &str, unit: &str| Column { column: name.to_owned(), unit: unit.to_owned(), ticks: None, is_change: false };
    let wheel = WheelColumns { turn: Some(column("2", "rad")), ..WheelColumns::default() };
    let columns = TableColumns { time: column("1", "s"), wheel: vec![wheel], reference: None, has_heading: false };
    in_file("table", text.as_bytes(), |path| {
        let _ = wheel_table::read_all(path, &columns);
        let _ = poses::read_all(path);
    });
});
