//! A vehicle that drives by the clouds of a multi-beam lidar, in small.

use agv_lab::evaluate::cloud_drive::{SensorKind, Site, cloud_drives};

#[test]
fn a_lane_is_driven_by_clouds() {
    let found = cloud_drives(Site::BlockStorage, SensorKind::Vlp16, Some(9.0), 5..6, || ()).expect("a drive");
    println!("{found:?}");
    assert_eq!((found.drives, found.recognised, found.wrong_starts), (1, 1, 0));
    assert!(found.poses > 700 && found.good_share >= 0.95, "{found:?}");
}
