//! What the localiser makes of the vehicle's motion: at every rate, with gaps, with poses that are told late, and what is
//! published meanwhile.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, reason = "a panic is how a test fails")]

mod drive;

use agv_core::localizer::Mode;
use drive::{Drive, KINDS, Path};

/// Time after which the pose is as good as it gets, s.
const SETTLED: f64 = 3.0;

#[test]
fn no_motion_is_lost_while_the_laser_is_silent() {
    let path = Path::straight(16.0);
    let cases = KINDS.into_iter().flat_map(|kind| [2.0, 5.0].map(|silence| (kind, silence)));
    for (kind, silence) in cases {
        for slam in [false, true] {
            let mut drive = Drive::start(&path, kind, slam, 100);
            drive.go(SETTLED, |_| {});
            drive.is_laser_silent = true;
            drive.go(silence, |_| {});
            drive.is_laser_silent = false;
            drive.go(1.0, |drive| {
                let error = path.error(&drive.said());
                assert!(error < 0.03, "{error} m after {silence} s, {kind:?} slam {slam}");
            });
            assert_eq!(drive.said().mode, Mode::Reflectors);
        }
    }
}
