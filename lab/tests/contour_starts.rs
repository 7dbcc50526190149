//! Starts from nothing in kept maps of contours: 200, in worlds of four kinds, as they were mapped and changed since.

use agv_lab::evaluate::contour_worlds::{SiteKind, run};

#[test]
fn vehicles_find_themselves_and_none_is_wrong() {
    for kind in SiteKind::ALL {
        for moved_share in [0.0, 0.3] {
            let outcome = run(kind, moved_share, 7, 25, || {});
            assert_eq!((outcome.starts, outcome.wrong), (25, 0), "{outcome:?}");
            // In the open hall much of what would tell is beyond the reach of the search.
            let least = if kind == SiteKind::OpenHall { 0.7 } else { 0.9 };
            assert!(outcome.right_share >= least, "{outcome:?}");
            assert!(outcome.seconds.max <= 5.0, "{outcome:?}");
        }
    }
}
