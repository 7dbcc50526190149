//! Maps and association, against brute force and a literal reading of Algorithm 1.

use agv_core::geometry::Point;
use agv_core::maps::{
    DynamicMap, DynamicMapParameters, FixedMap, Landmark, LandmarkKind, MapError, NearestNeighbour, Verdict,
};
use proptest::prelude::*;

fn landmark(id: usize, x: f64, y: f64) -> Landmark {
    Landmark { id: id as u16, kind: LandmarkKind::Reflector, x, y, deviation: 0.0 }
}

proptest! {
    #[test]
    fn the_index_finds_what_brute_force_finds(
        points in proptest::collection::vec((-40.0f64..40.0, -40.0f64..40.0), 0..300),
        x in -45.0f64..45.0, y in -45.0f64..45.0, radius in 0.0f64..6.0,
    ) {
        let landmarks: Vec<_> = points.iter().enumerate().map(|(id, &(x, y))| landmark(id, x, y)).collect();
        let mut map = FixedMap::<1000>::new();
        map.extend(&landmarks).unwrap();
        let mut found: Vec<_> = map.near(Point::new(x, y), radius).map(|landmark| landmark.id).collect();
        found.sort_unstable();
        let expected: Vec<_> = landmarks
            .iter()
            .filter(|landmark| (landmark.x - x).hypot(landmark.y - y) <= radius)
            .map(|landmark| landmark.id)
            .collect();
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn the_dynamic_map_lives_as_algorithm_1_says(
        scans in proptest::collection::vec(proptest::collection::vec((0usize..12, -1.0f64..1.0), 0..10), 1..40),
    ) {
        // Places are numbered and far apart, so that which landmark is meant is never in doubt.
        let parameters = DynamicMapParameters { update_rate: 0.25, ..DynamicMapParameters::default() };
        let mut map = DynamicMap::<64>::new(parameters);
        let mut model: Vec<(usize, f64, i32)> = Vec::new();
        for scan in scans {
            let mut updated = Vec::new();
            for (place, offset) in scan {
                if updated.contains(&place) {
                    continue;
                }
                let at = Point::new(place as f64 * 10.0 + offset, 0.0);
                let known = map
                    .near(Point::new(place as f64 * 10.0, 0.0), 3.0)
                    .next()
                    .map(|landmark| landmark.id);
                match known {
                    Some(id) => map.update(id, at),
                    None => map.insert(LandmarkKind::Corner, at),
                }
                match model.iter_mut().find(|entry| entry.0 == place) {
                    Some(entry) => {
                        entry.1 = 0.75 * entry.1 + 0.25 * at.x;
                        entry.2 += 1;
                    }
                    None => model.push((place, at.x, 1)),
                }
                updated.push(place);
            }
            map.finish();
            model.retain(|entry| entry.2 > 0);
            for entry in &mut model {
                if !updated.contains(&entry.0) {
                    entry.2 -= 1;
                }
            }
            prop_assert_eq!(map.landmarks().len(), model.len());
            for entry in &model {
                let found = map.landmarks().iter().any(|landmark| {
                    (landmark.position.x - entry.1).abs() < 1e-9 && i32::from(landmark.hits) == entry.2
                });
                prop_assert!(found, "{entry:?} is missing");
            }
        }
    }

    #[test]
    fn the_dynamic_map_is_never_over_capacity(
        places in proptest::collection::vec(-1000i32..1000, 1..200), scan_length in 1usize..20,
    ) {
        let mut map = DynamicMap::<16>::new(DynamicMapParameters::default());
        for scan in places.chunks(scan_length) {
            for place in scan {
                map.insert(LandmarkKind::EndPoint, Point::new(f64::from(*place), 0.0));
                prop_assert!(map.landmarks().len() <= 16);
            }
            map.finish();
            let mut ids: Vec<_> = map.landmarks().iter().map(|landmark| landmark.id).collect();
            ids.sort_unstable();
            ids.dedup();
            prop_assert_eq!(ids.len(), map.landmarks().len());
        }
    }

    #[test]
    fn the_nearest_neighbour_is_the_smallest(distances in proptest::collection::vec(0.0f64..30.0, 0..8)) {
        let mut nearest = NearestNeighbour::default();
        for (index, &distance) in distances.iter().enumerate() {
            nearest.consider(index, distance);
        }
        let (best, verdict) = nearest.decide(12.0, 3.0);
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let expected = match sorted.as_slice() {
            [] => Verdict::Unknown,
            [first, ..] if *first > 12.0 => Verdict::Gated,
            [first, second, ..] if second - first < 3.0 => Verdict::Ambiguous,
            _ => Verdict::Accepted,
        };
        prop_assert_eq!(verdict, expected);
        prop_assert_eq!(best.map(|best| best.normalised_square), sorted.first().copied());
    }
}

#[test]
fn a_full_map_keeps_what_has_been_confirmed() {
    let mut map = DynamicMap::<2>::new(DynamicMapParameters::default());
    map.insert(LandmarkKind::Corner, Point::new(0.0, 0.0));
    map.insert(LandmarkKind::Corner, Point::new(5.0, 0.0));
    let confirmed = map.landmarks()[0].id;
    map.finish();
    map.update(confirmed, Point::new(0.0, 0.0));
    map.insert(LandmarkKind::Corner, Point::new(9.0, 0.0));
    let places: Vec<_> = map.landmarks().iter().map(|landmark| landmark.position.x).collect();
    assert_eq!(places, [0.0, 9.0]);
}

#[test]
fn a_map_refuses_what_does_not_fit() {
    let mut map = FixedMap::<2>::new();
    assert_eq!(map.extend(&[landmark(1, f64::NAN, 0.0)]), Err(MapError::NotFinite));
    assert_eq!(map.extend(&[landmark(1, 0.0, 0.0), landmark(2, 1.0, 0.0), landmark(3, 2.0, 0.0)]), Err(MapError::Full));
    assert_eq!(map.landmarks().len(), 2);
    assert_eq!(map.near(Point::new(1.0, 0.0), 0.1).count(), 1);
}

/// A map that holds four reflectors and six features.
#[test]
fn a_map_is_replaced_as_a_whole_or_not_at_all() {
    use agv_core::localizer::{CapacitiesOf, Localizer, Parameters};
    use agv_core::maps::MapError;
    use agv_core::odometry::Vehicle;
    let of = |reflectors: u16, features: u16| {
        let mut all: Vec<Landmark> = (0..reflectors + features)
            .map(|id| Landmark::reflector(id, Point::new(f64::from(id), 1.0), 0.002))
            .collect();
        all.iter_mut().take(usize::from(features)).for_each(|landmark| landmark.kind = LandmarkKind::Corner);
        all
    };
    let parameters = Parameters::new(Vehicle::Increments, agv_core::geometry::Pose::default());
    let mut localizer = Box::new(Localizer::<CapacitiesOf<360, 4, 6, 8>>::new(parameters));
    for (reflectors, features, fits) in
        [(4, 6, true), (5, 0, false), (0, 7, false), (4, 5, true), (1, 6, true), (5, 6, false)]
    {
        let before = localizer.reflectors().landmarks().len();
        let expected = if fits { Ok(()) } else { Err(MapError::Full) };
        assert_eq!(localizer.replace_landmarks(&of(reflectors, features)), expected, "{reflectors} and {features}");
        let now = if fits { usize::from(reflectors) } else { before };
        assert_eq!(localizer.reflectors().landmarks().len(), now);
    }
}

#[test]
fn a_map_that_is_lent_is_in_use_or_refused() {
    use agv_core::localizer::{LentCapacities, Localizer, Parameters};
    use agv_core::maps::LendError;
    use agv_core::odometry::Vehicle;
    let parameters = Parameters::new(Vehicle::Increments, agv_core::geometry::Pose::default());
    let good =
        [Landmark::reflector(1, Point::new(1.0, 2.0), 0.002), Landmark::reflector(2, Point::new(3.0, 2.0), 0.002)];
    let corner = Landmark { kind: LandmarkKind::Corner, ..good[0] };
    let turned = [corner, good[1]];
    let mut localizer = Box::new(Localizer::<LentCapacities>::new(parameters));
    assert_eq!(localizer.lend_landmarks(&good), Ok(()));
    assert_eq!(localizer.reflectors().landmarks(), &good[..]);
    assert_eq!(localizer.lend_landmarks(&turned), Err(LendError::Order));
    assert_eq!(localizer.reflectors().landmarks(), &good[..]);
}
