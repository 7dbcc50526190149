//! The localiser under any sequence of events.

use agv_lab::campaign::event_fuzz;

#[test]
fn no_sequence_of_events_breaks_the_localiser() {
    let verdict = event_fuzz::run(1, 200_000);
    assert_eq!(verdict.events, 200_000);
    assert_eq!((verdict.violations, verdict.panics), (vec![], vec![]));
    // Most of the time it has something to get wrong.
    assert!(verdict.localised > 120_000, "{}", verdict.localised);
}

#[test]
fn a_seed_says_the_same_again() {
    assert_eq!(event_fuzz::run(7, 2_000), event_fuzz::run(7, 2_000));
    // Some vehicles know where they are from the first event to the last.
    let others: Vec<u64> = (7..12).map(|seed| event_fuzz::run(seed, 2_000).localised).collect();
    assert!(others.iter().any(|localised| *localised != others[0]), "{others:?}");
}

#[test]
fn what_is_wrong_is_found() {
    let planted = |plant: fn(&mut agv_core::localizer::Outputs)| {
        event_fuzz::run_with(1, 5_000, move |outputs, limits| {
            let mut outputs = outputs.clone();
            plant(&mut outputs);
            event_fuzz::violation(&outputs, limits)
        })
    };
    assert_eq!(planted(|_| ()).violations, vec![]);
    let plants: [fn(&mut agv_core::localizer::Outputs); 7] = [
        |outputs| outputs.pose.pose.x = f64::NAN,
        |outputs| outputs.pose.pose.theta += 7.0,
        |outputs| outputs.pose.covariance[0] = -1e-9,
        |outputs| {
            outputs.pose.covariance[1] = 1.001 * (outputs.pose.covariance[0] * outputs.pose.covariance[2]).sqrt() + 1e-3
        },
        |outputs| outputs.pose.covariance[5] = f64::INFINITY,
        |outputs| outputs.pose.reason = agv_core::state::Reason::Uncertain,
        |outputs| {
            if let Some(seen) = outputs.uses.first_mut() {
                seen.test_ratio = f64::NAN;
            }
        },
    ];
    for plant in plants {
        let verdict = planted(plant);
        assert!(!verdict.violations.is_empty() && verdict.panics.is_empty());
        assert!(verdict.violations.iter().all(|finding| finding.seed == 1 && !finding.what.is_empty()));
    }
    let verdict = event_fuzz::run_with(1, 1_000, |_, _| panic!("planted"));
    assert!(verdict.panics.iter().all(|finding| finding.what.contains("planted")) && !verdict.panics.is_empty());
}
