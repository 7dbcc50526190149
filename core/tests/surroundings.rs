//! What is learnt over a kept map: what it does not have, and nothing that it has where there is no room to load it.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::contours::{ContourMatcher, KeptMap, KeyRing, Prediction, SurfacePoint, Surroundings};
use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_core::sensing::PointScan;

use super::support::kept_map::kept_map;
use super::support::walls::{BEAMS, Noise, Walls, ranges, room, scan};

/// The room has three times as many points.
const ROOM: usize = 320;

type Keys = KeyRing<4, 400>;

/// Where the laser is.
const PLACE: Pose = Pose { x: 1.0, y: 1.0, theta: 0.3 };

/// A crate that is not in the map.
const CRATE: [[f64; 4]; 4] = [[3.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 1.0], [4.0, 1.0, 3.0, 1.0], [3.0, 1.0, 3.0, 0.0]];

fn with_crate() -> Walls {
    [room(), CRATE.to_vec()].concat()
}

fn points(walls: &Walls, laser: &Pose) -> Vec<SurfacePoint> {
    let ranges = ranges(walls, laser, &mut Noise(7));
    let (mut points, mut matcher) = (Box::<PointScan<BEAMS>>::default(), Box::<ContourMatcher>::default());
    points.set(&scan(&ranges, Time::default()), 0.05, 60.0);
    matcher.see(points.view());
    matcher.points().to_vec()
}

/// Surroundings of the room's map that are loaded at the place, and have learnt from a scan there.
fn learnt(map: &KeptMap, walls: &Walls) -> (Box<Surroundings<ROOM>>, Box<Keys>) {
    let (mut surroundings, mut keys) = (Box::<Surroundings<ROOM>>::default(), Box::<Keys>::default());
    assert!(surroundings.around(map, &keys, &PLACE).has_cut(), "there is room for all");
    surroundings.learn((map, &mut keys), &points(walls, &PLACE), (&PLACE, [0.01, 0.001]));
    (surroundings, keys)
}

/// Where faces of the newest key scan are, in the frame of the map, which has no corners.
fn places(keys: &Keys) -> Vec<[f64; 2]> {
    let key = keys.newest().unwrap();
    let faces = key.points.iter().map(|point| point.unpacked()).filter(|point| !point.is_corner());
    let place = |face: SurfacePoint| key.pose.transform(&face.position.cast());
    faces.map(place).map(|place| [place.x, place.y]).collect()
}

#[test]
fn what_of_the_map_was_cut_for_want_of_room_is_not_learnt() {
    let map = kept_map(&room(), &Pose::default());
    let (_, keys) = learnt(&map, &room());
    assert!(keys.newest().is_none(), "{:?}", places(&keys));
}

#[test]
fn what_the_map_does_not_have_is_learnt_whether_the_map_was_cut_or_not() {
    let map = kept_map(&room(), &Pose::default());
    let (_, keys) = learnt(&map, &with_crate());
    let places = places(&keys);
    let is_of_crate = |[x, y]: &&[f64; 2]| (2.9..4.1).contains(x) && (-0.1..1.1).contains(y);
    // At the end of what is seen of a wall the normal may be anything.
    let of_crate = places.iter().filter(is_of_crate).count();
    assert!(of_crate >= 10 && of_crate + 1 >= places.len(), "{places:?}");
}

/// As much of a match as lies on what was learnt, and no more, has the error of the pose from which it was learnt.
#[test]
fn the_share_of_the_overlay_is_that_of_what_nobody_has_mapped() {
    let map = kept_map(&room(), &Pose::default());
    let (mut surroundings, keys) = learnt(&map, &with_crate());
    let seen = points(&with_crate(), &PLACE);
    let of_crate = keys.newest().unwrap().points.len() as f32 / seen.len() as f32;
    let found = surroundings.align((&map, &*keys), &seen, &Prediction::by_odometry(&PLACE, &Pose::default())).unwrap();
    let [position, heading] = found.of_overlay.map(f64::from);
    for (said, deviation) in [(position, 0.01), (heading, 0.001)] {
        let share = said / deviation;
        assert!((share - f64::from(of_crate)).abs() < 0.1, "{share} of {of_crate}");
    }
    assert!((found.pose.x - PLACE.x).hypot(found.pose.y - PLACE.y) < 0.01, "{:?}", found.pose);
}
