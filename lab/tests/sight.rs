//! What a drive shows of what was wrong, since when it was wrong.

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::{ReflectorObservation, Time};
use agv_core::odometry::Vehicle;
use agv_host_sim::recording::{RecordedEvent, Recording, Truth};
use agv_lab::trust::kinds::Revealed;
use agv_lab::trust::sight::Sight;

const START: f64 = 3.0;

/// A drive that turns by 90 degrees from 10 s to 20 s after its start and goes straight on at 1 m/s otherwise, with so many reflectors in
/// sight at a time after the start.
fn sight(in_sight: impl Fn(f64) -> usize) -> Sight {
    let mut pose = Pose::default();
    let (mut truth, mut events) = (Vec::new(), Vec::new());
    for index in 0..400 {
        let after = 0.1 * f64::from(index);
        let time = Time::from_seconds(START + after);
        truth.push(Truth { time, pose });
        let observations = vec![ReflectorObservation { time, range: 5.0, bearing: 0.0 }; in_sight(after)];
        if !observations.is_empty() {
            events.push(RecordedEvent::Reflectors(observations.into()));
        }
        let turns = (100..200).contains(&index);
        let by = if turns {
            Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2 / 100.0 * 1.01)
        } else {
            Pose::new(0.1, 0.0, 0.0)
        };
        pose = pose.compose(&by);
    }
    let parameters = Parameters::new(Vehicle::Increments, Pose::default());
    let recording = Recording { parameters, landmarks: Vec::new(), events, truth, references: Vec::new(), state: None };
    Sight::of(&recording, [0.0, 0.0])
}

/// The first time after the start, in tenths of a second, at which it is revealed.
fn first(sight: &Sight, by: Revealed, since: f64) -> Option<u32> {
    (0..400).find(|index| sight.reveals(by, since, 0.1 * f64::from(*index)))
}

#[test]
fn what_is_wrong_before_the_drive_is_revealed_by_five_metres_or_by_a_turn() {
    let sight = sight(|_| 3);
    for since in [f64::NEG_INFINITY, -1.0, 0.0] {
        assert!(first(&sight, Revealed::Drive, since).is_some_and(|at| (50..=52).contains(&at)), "{since}");
        assert!(first(&sight, Revealed::Turn, since).is_some_and(|at| (199..=201).contains(&at)), "{since}");
    }
}

#[test]
fn what_is_wrong_later_is_revealed_by_what_comes_after_it_alone() {
    let sight = sight(|_| 3);
    assert!(first(&sight, Revealed::Drive, 3.0).is_some_and(|at| (80..=82).contains(&at)));
    // Half of the turn was over.
    assert_eq!(first(&sight, Revealed::Turn, 15.0), None);
    assert!(first(&sight, Revealed::Turn, 9.5).is_some_and(|at| (199..=201).contains(&at)));
}

#[test]
fn what_is_driven_with_two_reflectors_in_sight_reveals_nothing() {
    let hidden = sight(|after| if after < 2.0 { 2 } else { 3 });
    assert!(first(&hidden, Revealed::Drive, 0.0).is_some_and(|at| (70..=72).contains(&at)));
    assert_eq!(first(&sight(|_| 2), Revealed::Drive, 0.0), None);
    assert_eq!(first(&sight(|_| 0), Revealed::Turn, 0.0), None);
}
