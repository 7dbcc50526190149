//! A map that is lent to the localiser answers as a copy of it does, to the last bit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

use agv_core::geometry::Point;
use agv_core::localizer::{ContourCapacities, LentCapacities, Localizer};
use agv_core::maps::{Landmark, LandmarkKind, LendError, put_reflectors_first};
use agv_host_sim::mapping::{Clustering, map_features};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;

const HALL: &str = include_str!("../scenarios/warehouse_hall.toml");

fn landmark(id: u16, kind: LandmarkKind) -> Landmark {
    Landmark { kind, ..Landmark::reflector(id, Point::new(f64::from(id), 0.0), 0.002) }
}

#[test]
fn a_lent_map_answers_as_a_copy() {
    let mut recording = simulate(&Scenario::parse(HALL).unwrap()).unwrap().recording;
    // Of both kinds, in no order.
    let features = map_features(&recording, &Clustering::default()).unwrap();
    let reflectors = recording.landmarks.clone();
    assert!(features.len() > 100 && reflectors.len() > 20);
    recording.landmarks = features[..50].iter().chain(&reflectors).chain(&features[50..]).copied().collect();
    let mut sorted = recording.landmarks.clone();
    put_reflectors_first(&mut sorted);
    let mut own = Box::new(Localizer::<ContourCapacities>::new(recording.parameters));
    own.add_landmarks(&recording.landmarks).unwrap();
    let mut lent = Box::new(Localizer::<LentCapacities>::new(recording.parameters));
    lent.lend_landmarks(&sorted).unwrap();
    assert_eq!(lent.reflectors().landmarks(), own.reflectors().landmarks());
    let mut accepted = 0;
    for event in recording.events.iter().take(4000) {
        let copied = own.handle(&event.view()).clone();
        let given = lent.handle(&event.view());
        assert_eq!((format!("{:?}", copied.pose), &copied.uses[..]), (format!("{:?}", given.pose), &given.uses[..]));
        accepted += given.uses.len();
    }
    assert!(accepted > 10_000, "{accepted}");
}

#[test]
fn reflectors_come_first_and_kinds_keep_their_order() {
    use LandmarkKind::{Corner, EndPoint, Reflector};
    let mut landmarks: Vec<Landmark> = [Corner, Reflector, EndPoint, Reflector, Reflector, Corner]
        .into_iter()
        .zip(0..)
        .map(|(kind, id)| landmark(id, kind))
        .collect();
    put_reflectors_first(&mut landmarks);
    let ids: Vec<u16> = landmarks.iter().map(|landmark| landmark.id).collect();
    assert_eq!(ids, [1, 3, 4, 0, 2, 5]);
    put_reflectors_first(&mut []);
}

#[test]
fn a_map_that_cannot_be_lent_changes_nothing() {
    let parameters = Scenario::parse(HALL).unwrap();
    let parameters = simulate(&parameters).unwrap().recording.parameters;
    let good = [landmark(1, LandmarkKind::Reflector), landmark(2, LandmarkKind::Corner)];
    let turned = [good[1], good[0]];
    let many: Vec<Landmark> = (0..1001).map(|id| landmark(id, LandmarkKind::Reflector)).collect();
    let nowhere = [Landmark { x: f64::NAN, ..good[0] }];
    let mut localizer = Box::new(Localizer::<LentCapacities>::new(parameters));
    assert_eq!(localizer.lend_landmarks(&good), Ok(()));
    assert_eq!(localizer.lend_landmarks(&turned), Err(LendError::Order));
    assert_eq!(localizer.lend_landmarks(&many), Err(LendError::Full));
    assert_eq!(localizer.lend_landmarks(&nowhere), Err(LendError::NotFinite));
    assert_eq!(localizer.reflectors().landmarks(), &good[..1]);
}
