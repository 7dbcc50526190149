//! What kind of thing an event is, and of when.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, PoseFix};
use agv_core::measurement::{
    EncoderFaults, EncoderSample, GyroSample, LaserId, PoseIncrement, ReflectorObservation, Reflectors, Scan,
    SpeedSample, Time, WheelSample,
};

const TIME: Time = Time::from_micros(2_000_000);

/// What an event is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Odometry,
    Turn,
    Fault,
    Laser,
    Told,
}

#[test]
fn an_event_tells_either_how_the_vehicle_moves_or_what_a_laser_sees_or_where_it_is() {
    let pose = Pose::default();
    let at = |seconds: f64| ReflectorObservation { time: TIME.offset(seconds), range: 3.0, bearing: 0.5 };
    let observations = [at(0.0), at(0.04), at(0.1)];
    let scan = Scan {
        laser: LaserId::FIRST,
        start: TIME,
        beam_interval: 0.025,
        first_bearing: 0.0,
        bearing_step: 0.5,
        ranges: &[1.0; 5],
        intensities: &[],
    };
    let events = [
        (Event::Encoders(EncoderSample { time: TIME, drive: 1, steering: 2 }), Kind::Odometry),
        (Event::Speed(SpeedSample { time: TIME, speed: 1.0, steering: 0.1 }), Kind::Odometry),
        (Event::Increment(PoseIncrement { time: TIME, displacement: pose }), Kind::Odometry),
        (Event::Gyro(GyroSample { time: TIME, rate: 0.0 }), Kind::Turn),
        (Event::Wheels(WheelSample { time: TIME, wheels: Default::default() }), Kind::Odometry),
        (Event::EncoderFaults(EncoderFaults { time: TIME, ..EncoderFaults::default() }), Kind::Fault),
        (Event::Reflectors(Reflectors::of_first(&observations)), Kind::Laser),
        (Event::Scan(scan), Kind::Laser),
        (Event::SetPose(PoseFix { time: TIME, pose, position_deviation: 0.1, heading_deviation: 0.1 }), Kind::Told),
    ];
    for (event, kind) in events {
        assert_eq!(event.is_odometry(), kind == Kind::Odometry, "{event:?}");
        assert_eq!(event.is_told(), kind == Kind::Told, "{event:?}");
        assert_eq!(event.laser(), (kind == Kind::Laser).then_some(LaserId::FIRST), "{event:?}");
        assert_eq!(event.time(), Some(TIME), "{event:?}");
        // A revolution lasts from its first beam or reflector to its last one.
        let end = if kind == Kind::Laser { TIME.offset(0.1) } else { TIME };
        assert_eq!(event.span(), Some((TIME, end)), "{event:?}");
    }
    assert_eq!(Event::Reflectors(Reflectors::of_first(&[])).time(), None);
}
