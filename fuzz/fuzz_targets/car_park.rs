#![no_main]

use agv_fuzz::in_folder;
use agv_host_sim::import::carpark;
use libfuzzer_sys::fuzz_target;

/// In the order of the seeds.
const TABLES: [&str; 7] = [
    "odometry.csv",
    "laser_ranges_m.csv",
    "laser_intensity.csv",
    "beacons.csv",
    "gps.csv",
    "events.csv",
    "reference_smoothed.csv",
];

fuzz_target!(|text: &str| in_folder(&TABLES, text, |folder| {
    let _ = carpark::read(folder, &carpark::WINDOW);
    let _ = carpark::read_batch_solution(folder);
}));
