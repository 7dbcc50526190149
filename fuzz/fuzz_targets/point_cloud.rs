#![no_main]

use agv_fuzz::in_file;
use agv_lidar3d::cloud_file;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for name in ["cloud.pcd", "cloud.ply", "cloud.las", "cloud.bin"] {
        in_file(name, bytes, |path| {
            let Ok(cloud) = cloud_file::read_cloud(path) else { return };
            // A point takes at least 12 bytes, of which a compressed PCD (LZF) makes up to 88 of one.
            assert!(cloud.points.len() <= 8 * bytes.len(), "{} points of {} bytes", cloud.points.len(), bytes.len());
        });
    }
});
