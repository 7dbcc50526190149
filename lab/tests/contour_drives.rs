//! Drives by a kept map of contours alone, in worlds of four kinds that have changed since they were mapped.

use agv_lab::evaluate::contour_worlds::{SiteKind, drive_in_worlds};

#[test]
fn where_what_did_not_move_determines_the_pose_it_is_good() {
    for kind in SiteKind::ALL {
        let found = drive_in_worlds(kind, 0.3, 12.0, (7, 2), || {}).unwrap();
        let determined = &found.determined;
        // Twelve seconds but the first, a hundred poses each.
        assert_eq!(determined.poses + found.others.poses, 2 * 1101, "{found:?}");
        assert!(found.determined_share >= 0.9, "{found:?}");
        assert!(determined.good_share >= 0.95, "{found:?}");
        assert!(determined.mi_share == 0.0, "{found:?}");
    }
}
