use agv_core::geometry::{Point, difference};
use agv_host_sim::simulate::block_storage::{BlockStoragePath, ReflectorPlacement};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_host_sim::simulate::world::World;

use super::support::{assert_unit_mean_square, crossing, revolutions, true_pose};

fn is_free(world: &World, from: &Point, to: &Point) -> bool {
    let offset = to - from;
    let angle = offset.y.atan2(offset.x);
    !world.segments.iter().filter_map(|segment| crossing(from, angle, segment)).any(|way| way < offset.norm())
}

#[test]
fn reflectors_are_seen_when_and_only_when_nothing_is_between() {
    let mut scenario =
        Scenario::block_storage_with_reflectors(BlockStoragePath::P1, ReflectorPlacement::AisleAndLaneEnd, 3);
    scenario.reflectors.false_share = 0.0;
    scenario.laser.scans = false;
    let simulation = simulate(&scenario).unwrap();
    let world = &simulation.world;
    let (mut range_errors, mut bearing_errors) = (Vec::new(), Vec::new());
    let (mut miscounted, mut total) = (0, 0);
    for observations in revolutions(&simulation.recording) {
        for observation in observations {
            let sensor = true_pose(&simulation.recording.truth, observation.time).compose(&simulation.true_laser);
            let (range, bearing) = (f64::from(observation.range), f64::from(observation.bearing));
            let (sine, cosine) = bearing.sin_cos();
            let point = sensor.transform(&Point::new(range * cosine, range * sine));
            let distance = |centre: &Point| (centre - point).norm();
            let centres = world.reflectors.iter().map(|reflector| reflector.body.centre);
            let nearest = centres.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
            assert!(is_free(world, &sensor.position(), &nearest), "seen through a wall: {observation:?}");
            let expected = sensor.inverse_transform(&nearest);
            assert!(expected.norm() <= 30.0);
            range_errors.push((range - expected.norm()) / 0.008);
            bearing_errors.push(difference(bearing, expected.y.atan2(expected.x)) / 0.05_f64.to_radians());
        }
        let middle = observations[0].time;
        let sensor = true_pose(&simulation.recording.truth, middle).compose(&simulation.true_laser).position();
        let visible = world.reflectors.iter().filter(|reflector| {
            let distance = (reflector.body.centre - sensor).norm();
            (0.5..30.0).contains(&distance) && is_free(world, &sensor, &reflector.body.centre)
        });
        miscounted += usize::from(visible.count() != observations.len());
        total += 1;
    }
    assert!(range_errors.len() > 500);
    assert_unit_mean_square(&range_errors, "range");
    assert_unit_mean_square(&bearing_errors, "bearing");
    // In some revolutions one appears, vanishes or hides another after the first is seen.
    assert!(miscounted * 5 < total, "{miscounted} of {total}");
}

#[test]
fn a_reflector_behind_a_box_turned_away_or_far_is_not_seen() {
    let text = r#"
        [world]
        kind = "shapes"
        walls = [[-20, -20, 20, -20], [-20, 20, 20, 20]]
        rectangles = [{ x = 5, y = 0, length = 0.5, width = 1.0 }]
        reflectors = [
            { x = 8, y = 0 },
            { x = 0, y = 8 },
            { x = -8, y = 0, facing_deg = 180 },
            { x = -6, y = -6, facing_deg = 45 },
            { x = 0.1, y = -12, farthest = 5 },
        ]
        [path]
        kind = "legs"
        legs = [{ segments = [{ length = 0.1 }] }]
        [reflectors]
        false_share = 0
    "#;
    let simulation = simulate(&Scenario::parse(text).unwrap()).unwrap();
    for observations in revolutions(&simulation.recording) {
        let mut ranges: Vec<f64> = observations.iter().map(|observation| f64::from(observation.range)).collect();
        ranges.sort_by(f64::total_cmp);
        assert_eq!(ranges.len(), 2, "{observations:?}");
        assert!((ranges[0] - 0.9_f64.hypot(8.0)).abs() < 0.1);
        assert!((ranges[1] - 6.9_f64.hypot(6.0)).abs() < 0.1);
    }
}

#[test]
fn missing_and_false_reflectors_have_the_stated_shares() {
    let mut scenario = Scenario::parse("[world]\nkind = \"warehouse_hall\"\n[path]\nkind = \"hall_loop\"").unwrap();
    scenario.laser.scans = false;
    let count =
        |scenario: &Scenario| revolutions(&simulate(scenario).unwrap().recording).map(Vec::len).sum::<usize>() as f64;
    scenario.reflectors.false_share = 0.0;
    let all = count(&scenario);
    scenario.reflectors.missing_share = 0.3;
    let seen = count(&scenario);
    assert!((seen / all - 0.7).abs() < 4.0 * (0.21 / all).sqrt(), "{seen} of {all}");
    scenario.reflectors.missing_share = 0.0;
    scenario.reflectors.false_share = 0.05;
    let with_false = count(&scenario);
    // Some false ones fall where there is no surface within 30 m.
    let excess = with_false / all - 1.0;
    assert!(excess > 0.03 && excess < 0.05 + 4.0 * (0.0475 / all).sqrt(), "{excess}");
}

#[test]
fn the_aisle_has_enough_reflectors_and_the_lane_has_none() {
    for seed in 0..10 {
        let mut scenario =
            Scenario::block_storage_with_reflectors(BlockStoragePath::P1, ReflectorPlacement::Aisle, seed);
        scenario.reflectors.false_share = 0.0;
        scenario.laser.scans = false;
        let recording = simulate(&scenario).unwrap().recording;
        let counts: Vec<usize> = revolutions(&recording).map(Vec::len).collect();
        assert!(counts[..50].iter().all(|&count| count >= 4), "{counts:?}");
        assert!(counts[125..].iter().all(|&count| count == 0), "{counts:?}");
        let deviations: Vec<f64> = recording.landmarks.iter().map(|landmark| f64::from(landmark.deviation)).collect();
        assert_eq!(deviations, vec![f64::from(0.002_f32); 13]);
    }
}

#[test]
fn the_map_has_the_stated_survey_noise() {
    let mut errors = Vec::new();
    for seed in 0..8 {
        let text = format!("seed = {seed}\n[world]\nkind = \"warehouse_hall\"\n[laser]\nscans = false");
        let simulation = simulate(&Scenario::parse(&text).unwrap()).unwrap();
        for (landmark, reflector) in simulation.recording.landmarks.iter().zip(&simulation.world.reflectors) {
            errors.push((landmark.x - reflector.body.centre.x) / 0.002);
            errors.push((landmark.y - reflector.body.centre.y) / 0.002);
        }
    }
    assert!(errors.len() > 500);
    assert_unit_mean_square(&errors, "survey");
}
