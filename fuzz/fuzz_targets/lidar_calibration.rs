#![no_main]

use agv_lidar3d::calibration::Calibration;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let Ok(calibration) = Calibration::read(text) else { return };
    // What was read is written so that it can be read.
    for text in [calibration.to_db_xml(), calibration.to_ros_yaml()] {
        let again = Calibration::read(&text).map(|calibration| calibration.lasers.len());
        assert_eq!(again.ok(), Some(calibration.lasers.len()), "{text}");
    }
});
