//! Who feeds the localiser wrongly is told so; and maps are replaced while the vehicle drives.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{Event, Misuse, Mode, PoseFix, Reason};
use agv_core::maps::{Landmark, LandmarkKind, MapError};
use agv_core::measurement::{EncoderSample, PoseIncrement, SpeedSample, Time, WheelSample};

use super::support::stage::{Stage, features, parameters, reflectors};

#[test]
fn what_was_wrong_with_an_event_is_said() {
    let mut stage = Stage::told(parameters());
    stage.drive(0.5, 0.0);
    assert_eq!(stage.localizer.outputs().misuse, None);
    let now = stage.time();
    let fix = PoseFix { time: now, pose: stage.truth, position_deviation: 0.01, heading_deviation: 0.01 };
    let long_ago = Time::from_micros(now.micros() - 900_000);
    let cases = [
        (Event::Encoders(EncoderSample { time: now, drive: 1, steering: 1 }), Misuse::WrongVehicle),
        (Event::Speed(SpeedSample { time: now, speed: 1.0, steering: 0.0 }), Misuse::WrongVehicle),
        (Event::Wheels(WheelSample { time: now, wheels: Default::default() }), Misuse::WrongVehicle),
        (Event::Increment(PoseIncrement { time: now, displacement: Pose::default() }), Misuse::OutOfOrder),
        (Event::SetPose(PoseFix { position_deviation: f64::NAN, ..fix }), Misuse::NoPose),
        (Event::SetPose(PoseFix { pose: Pose { x: f64::INFINITY, ..fix.pose }, ..fix }), Misuse::NoPose),
    ];
    for (event, misuse) in cases {
        assert_eq!(stage.localizer.handle(&event).misuse, Some(misuse), "{event:?}");
    }
    // The filter remembers about 0.4 s.
    for _ in 0..20 {
        stage.drive(0.5, 0.0);
        stage.look();
    }
    let late = Event::SetPose(PoseFix { time: long_ago, ..fix });
    assert_eq!(stage.localizer.handle(&late).misuse, Some(Misuse::TooLate));
    stage.drive(0.5, 0.0);
    assert_eq!(stage.localizer.outputs().misuse, None);
}

/// The same place in another frame of W.
fn moved(landmarks: &[Landmark], by: &Pose) -> Vec<Landmark> {
    let of = |landmark: &Landmark| {
        let position = by.transform(&landmark.position());
        Landmark { x: position.x, y: position.y, ..*landmark }
    };
    landmarks.iter().map(of).collect()
}

#[test]
fn maps_are_replaced_while_the_vehicle_drives() {
    for slam in [false, true] {
        let mut wanted = parameters();
        wanted.maps.slam = slam;
        let mut stage = Stage::told(wanted);
        for _ in 0..10 {
            stage.drive(0.5, 0.1);
            stage.look();
        }
        assert_eq!(stage.said().reason, Reason::None);
        // Surveyed anew, everything lies a little elsewhere: the pose follows.
        let shift = Pose::new(0.03, -0.02, 0.0);
        let all = [moved(&reflectors(), &shift), moved(&features(), &shift)].concat();
        assert_eq!(stage.localizer.replace_landmarks(&all), Ok(()));
        for _ in 0..40 {
            stage.drive(0.5, 0.1);
            stage.look();
        }
        let said = stage.said();
        let there = shift.compose(&stage.truth);
        let off = (said.pose.x - there.x).hypot(said.pose.y - there.y);
        assert!(off < 0.01 && said.mode == Mode::Reflectors, "{slam} {off} {said:?}");
        // What does not fit changes nothing.
        let before = stage.localizer.reflectors().landmarks().to_vec();
        let many: Vec<Landmark> =
            (0..65).map(|id| Landmark::reflector(id, Point::new(f64::from(id), 0.0), 0.0)).collect();
        assert_eq!(stage.localizer.replace_landmarks(&many), Err(MapError::Full));
        let corners = many.iter().map(|one| Landmark { kind: LandmarkKind::Corner, ..*one }).collect::<Vec<_>>();
        assert_eq!(stage.localizer.replace_landmarks(&corners), Err(MapError::Full));
        let nowhere = Landmark::reflector(0, Point::new(f64::NAN, 0.0), 0.0);
        assert_eq!(stage.localizer.replace_landmarks(&[nowhere]), Err(MapError::NotFinite));
        assert_eq!(stage.localizer.reflectors().landmarks(), before);
    }
}
