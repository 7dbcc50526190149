//! What is said of the sensor's health.

use agv_core::measurement::Time;
use agv_core::state::LaserHealth;
use agv_wire::nav350::{ClockError, ErrorCode, LostReason, MethodName, Report, RevolutionError, SensorWatch, State};

fn at(seconds: f64) -> Time {
    Time::from_seconds(seconds)
}

#[test]
fn a_sensor_that_measures_is_sound_until_it_is_silent() {
    let mut watch = SensorWatch::new();
    assert_eq!(watch.health(at(1.0)), LaserHealth::Unknown);
    watch.measured(at(1.0));
    assert_eq!((watch.health(at(1.19)), watch.health(at(1.3))), (LaserHealth::Sound, LaserHealth::Silent));
    watch.unreachable();
    assert_eq!(watch.health(at(1.1)), LaserHealth::Silent);
    watch.measured(at(2.0));
    assert_eq!(watch.health(at(2.1)), LaserHealth::Sound);
}

#[test]
fn a_sensor_that_answers_with_errors_is_faulty_and_one_that_does_not_answer_is_silent() {
    let error = ErrorCode::WRONG_MODE;
    let faulty = [
        LostReason::AccessDenied,
        LostReason::Failed(MethodName::ChangeState, error),
        LostReason::Overflow,
        LostReason::Babble,
    ];
    let silent = [LostReason::NotConnected, LostReason::Closed, LostReason::NoAnswer(State::Running)];
    let expected = faulty.map(|reason| (reason, LaserHealth::Faulty));
    for (reason, health) in expected.into_iter().chain(silent.map(|reason| (reason, LaserHealth::Silent))) {
        let mut watch = SensorWatch::new();
        watch.measured(at(1.0));
        watch.lost(reason);
        assert_eq!(watch.health(at(1.1)), health, "{reason}");
    }
    for report in [Report::MethodFailed(MethodName::GetData, error), Report::Revolution(RevolutionError::Beams)] {
        let mut watch = SensorWatch::new();
        watch.measured(at(1.0));
        watch.reported(report);
        // Until it measures again, or cannot be reached any more.
        assert_eq!((watch.health(at(1.1)), watch.health(at(9.0))), (LaserHealth::Faulty, LaserHealth::Faulty));
        watch.measured(at(9.0));
        assert_eq!(watch.health(at(9.1)), LaserHealth::Sound);
    }
    // What says nothing of the sensor's measuring.
    let speed = Report::MethodFailed(MethodName::SetSpeed, error);
    for report in [Report::State(State::Running), Report::Clock(ClockError::RoundTrip), Report::Rubbish(3), speed] {
        let mut watch = SensorWatch::new();
        watch.measured(at(1.0));
        watch.reported(report);
        assert_eq!(watch.health(at(1.1)), LaserHealth::Sound);
    }
}
