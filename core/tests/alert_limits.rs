//! What a pose may be used for, by its protection level.

use agv_core::integrity::{Alarm, AlertLimit, AlertLimits, ProtectionLevel};
use agv_core::state::Mode;

const LIMIT: AlertLimit = AlertLimit { position: 0.1, heading: 0.02 };

#[test]
fn a_limit_holds_while_neither_bound_is_above_it() {
    for (position, heading, holds) in [
        (0.0, 0.0, true),
        (0.1, 0.02, true),
        (0.1001, 0.0, false),
        (0.0, 0.0201, false),
        (0.1001, 0.0201, false),
        (f64::NAN, 0.0, false),
        (0.0, f64::NAN, false),
    ] {
        assert_eq!(LIMIT.holds(&ProtectionLevel { position, heading }), holds, "{position} m, {heading} rad");
    }
}

#[test]
fn the_alarm_is_that_of_the_first_use_that_a_pose_is_too_bad_for() {
    let limits = AlertLimits { travel: LIMIT, docking: AlertLimit { position: 0.03, heading: 0.005 } };
    for (position, heading, alarm) in [
        (0.03, 0.005, Alarm::None),
        (0.031, 0.0, Alarm::Docking),
        (0.0, 0.006, Alarm::Docking),
        (0.1, 0.02, Alarm::Docking),
        (0.101, 0.0, Alarm::Travel),
        (0.0, 0.021, Alarm::Travel),
    ] {
        let level = ProtectionLevel { position, heading };
        assert_eq!(limits.alarm(Mode::Reflectors, &level), alarm, "{position} m, {heading} rad");
        for mode in [Mode::NotLocalised, Mode::Lost] {
            assert_eq!(limits.alarm(mode, &level), Alarm::NoPose);
        }
    }
}
