//! The largest of many bounds after a motion, held against all of them.

use agv_core::integrity::ProtectionLevel;
use agv_core::integrity::separation::{Bound, Envelope, Growth, SolutionBound};
use proptest::prelude::*;

fn bounds() -> impl Strategy<Value = Bound> {
    let variance = prop_oneof![Just(0.0), 1e-10..1e-2_f64];
    let factor = prop_oneof![Just(0.0), Just(4.56), Just(5.1), 0.0..9.0_f64];
    (0.0..0.2_f64, variance, factor).prop_map(|(apart, variance, factor)| Bound { apart, variance, factor })
}

fn of(bound: &Bound, added: f64) -> f64 {
    bound.apart + bound.factor * (bound.variance + added).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Never less than the largest of all, and with few of them it is that one.
    #[test]
    fn an_envelope_is_the_largest_of_its_bounds_after_any_motion(
        all in prop::collection::vec((bounds(), bounds()), 0..40),
        position in 0.0..1e-2_f64,
        heading in 0.0..1e-2_f64,
    ) {
        let mut envelope = Envelope::new();
        for (position, heading) in &all {
            envelope.add(&SolutionBound { position: *position, heading: *heading });
        }
        for growth in [Growth::NONE, Growth { position, heading }, Growth { position: 1e-6, heading: 1e2 }] {
            let level = envelope.after(&growth);
            let largest = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
            let expected = [
                largest(all.iter().map(|(bound, _)| of(bound, growth.position)).collect()),
                largest(all.iter().map(|(_, bound)| of(bound, growth.heading)).collect()),
            ];
            for (found, expected) in [level.position, level.heading].into_iter().zip(expected) {
                prop_assert!(found >= expected - 1e-12, "{} {}", found, expected);
                if all.len() <= 8 {
                    prop_assert!(found <= expected + 1e-12, "{} {}", found, expected);
                }
            }
        }
    }
}

#[test]
fn one_that_knows_the_pose_well_is_the_largest_after_a_motion() {
    let mut envelope = Envelope::new();
    let wide = Bound { apart: 0.01, variance: 1e-4, factor: 4.0 };
    let sure = Bound { apart: 0.0, variance: 1e-6, factor: 7.0 };
    for bound in [wide, sure] {
        envelope.add(&SolutionBound { position: bound, heading: bound });
    }
    let at = |added: f64| envelope.after(&Growth { position: added, heading: 0.0 });
    assert!((at(0.0).position - 0.05).abs() < 1e-12);
    assert!((at(1e-2).position - 7.0 * 0.010_001_f64.sqrt()).abs() < 1e-12);
    assert!((at(1e-2).heading - 0.05).abs() < 1e-12);
}

#[test]
fn what_is_fixed_does_not_grow() {
    let level = ProtectionLevel { position: 0.3, heading: 0.1 };
    assert_eq!(SolutionBound::fixed(&level).after(&Growth { position: 1.0, heading: 1.0 }), level);
    assert_eq!(SolutionBound::UNBOUNDED.level(), ProtectionLevel::UNBOUNDED);
}
