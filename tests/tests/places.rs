//! Recognition of places, mapping, and finding oneself, held to what they must show.

use agv_core::maps::Landmark;
use agv_core::relocalization::RelocalizationParameters;
use agv_host_sim::mapping::slam::SlamParameters;
use agv_host_sim::mapping::{Clustering, map_features_at, slam_poses};
use agv_host_sim::places::{FindParameters, Observer, PlaceAnswer, PlaceMap, Spacing, choose};
use agv_host_sim::simulate::block_storage::BlockStoragePath;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_lab::evaluate::falko::Set;
use agv_lab::evaluate::features::{DetectorKind, run as measure_features};
use agv_lab::evaluate::kidnapping::{Case, feature_map, run as kidnap};
use agv_lab::evaluate::places::{Combination, Experiment, Method, Mode, Outcome, Protocol};
use agv_lab::evaluate::repeatability::overlapping_pairs;
use agv_lab::evaluate::slam::{OfficeDrive, run as map_office};
use agv_tests::recordings;

fn recognise(set: Set, asked: &[(Protocol, Mode)]) -> Vec<Outcome> {
    let experiment = Experiment::new(Method::Improved, &set.scans().unwrap());
    let outcomes = asked.iter().map(|&(protocol, mode)| {
        let outcome = experiment.run(&Combination { protocol, mode, candidates: 10, n_min: 5 }, || ());
        println!(
            "{protocol:?} {mode:?} precision {} recall {} r95 {} r99 {}",
            outcome.precision, outcome.recall, outcome.r95, outcome.r99
        );
        outcome
    });
    outcomes.collect()
}

#[test]
fn places_of_fr079_are_recognised() {
    if recordings("places_of_fr079_are_recognised", "scans2d").is_none() {
        return;
    }
    let asked = [(Protocol::Thesis, Mode::Offline), (Protocol::Thesis, Mode::Online), (Protocol::Honest, Mode::Online)];
    let outcomes = recognise(Set::Fr079, &asked);
    assert!(outcomes[0].precision >= 0.98 && outcomes[0].recall >= 0.87);
    assert!(outcomes[1].precision >= 0.97 && outcomes[1].recall >= 0.73);
    assert!(outcomes[2].r99 >= 0.88);
}

#[test]
fn places_of_intel_are_recognised() {
    if recordings("places_of_intel_are_recognised", "scans2d").is_none() {
        return;
    }
    let outcomes = recognise(Set::Intel, &[(Protocol::Honest, Mode::Online)]);
    assert!(outcomes[0].r95 >= 0.55);
}

#[test]
fn keypoints_are_repeatable_and_told_apart() {
    if recordings("keypoints_are_repeatable_and_told_apart", "scans2d").is_none() {
        return;
    }
    for (set, repeatability) in [(Set::Fr079, 0.60), (Set::Intel, 0.56)] {
        let scans = set.scans().unwrap();
        let outcome = measure_features(DetectorKind::Falko, &scans, &overlapping_pairs(&scans), || ());
        println!("{set:?}: {} of {}", outcome.repeatability_counting_empty, outcome.keypoints_per_scan);
        assert!(outcome.repeatability_counting_empty >= repeatability && outcome.keypoints_per_scan <= 12.0);
        assert!(outcome.nearest_descriptor_correct >= 0.55, "{}", outcome.nearest_descriptor_correct);
    }
}

#[test]
fn an_office_is_mapped_from_raw_odometry() {
    let Some(folder) = recordings("an_office_is_mapped_from_raw_odometry", "scans2d") else { return };
    let carmen = folder.join("freiburg-079-corrected.log.gz");
    let drive = OfficeDrive::of_graph(&folder.join("fr079.log"), &carmen).unwrap();
    for (name, parameters, largest) in
        [("honest", SlamParameters::honest(), 0.12), ("all", SlamParameters::all(), 0.08)]
    {
        let (outcome, _) = map_office(&drive, Some(&folder.join("fr079.relations")), name, &parameters, || ()).unwrap();
        println!("{outcome:?}");
        assert!(outcome.odometry_error_m > 5.0, "the odometry is no longer raw");
        assert!(outcome.mean_position_error_m < largest);
        assert_eq!(outcome.false_loops, 0);
        let relations = outcome.relations.unwrap();
        assert!(relations.relations > 50 && relations.mean_shift_m < 0.08);
    }
}

#[test]
fn a_corridor_is_mapped_without_false_loops() {
    let Some(folder) = recordings("a_corridor_is_mapped_without_false_loops", "scans2d") else { return };
    let drive = OfficeDrive::of_carmen(&folder.join("aces-corrected.log.gz")).unwrap();
    let (outcome, _) = map_office(&drive, None, "all", &SlamParameters::all(), || ()).unwrap();
    println!("{outcome:?}");
    assert_eq!(outcome.false_loops, 0);
    assert!(outcome.mean_position_error_m < 0.3 && outcome.odometry_error_m > 3.0);
}

#[test]
fn a_map_from_an_unknown_block_storage_is_that_from_true_poses() {
    for seed in [1, 2] {
        let recording = simulate(&Scenario::block_storage(BlockStoragePath::Mapping, seed)).unwrap().recording;
        let (poses, _) = slam_poses(&recording, &SlamParameters::all(), || ()).unwrap();
        let map = |poses| map_features_at(&recording, poses, &Clustering::default()).unwrap();
        let (found, expected) = (map(&poses), map(&recording.truth));
        let distance = |landmark: &Landmark| {
            let same = expected.iter().filter(|other| other.kind == landmark.kind);
            same.map(|other| (other.x - landmark.x).hypot(other.y - landmark.y)).fold(f64::INFINITY, f64::min)
        };
        let near = found.iter().filter(|landmark| distance(landmark) < 0.05).count();
        println!("{near} of {}, true poses give {}", found.len(), expected.len());
        assert!(near as f64 >= 0.9 * expected.len() as f64 && near as f64 >= 0.9 * found.len() as f64);
    }
}

#[test]
fn a_vehicle_finds_itself_among_reflectors() {
    for case in Case::ALL {
        let outcome = kidnap(&case, 3, 1000, &RelocalizationParameters::default(), || ());
        println!("{outcome:?}");
        let right = outcome.right;
        match case.name {
            "60 reflectors" => {
                let sighted = 1.0 - outcome.blind as f64 / outcome.starts as f64;
                assert!(right[0] >= 0.995 && right[1] >= sighted - 1e-9 && outcome.wrong == 0);
            }
            "half missing" => assert!(right[2] >= 0.98 && outcome.wrong == 0),
            "symmetric" => assert!(outcome.ambiguous >= 0.97 && outcome.wrong == 0),
            "1000 reflectors, 5 cm" => assert!(right[2] >= 0.99 && outcome.wrong == 0),
            // A map of another hall has an identity; its reflectors alone do not tell.
            _ => assert!((outcome.wrong as f64) < 0.1 * outcome.starts as f64),
        }
    }
}

#[test]
fn a_vehicle_finds_itself_among_features() {
    let outcome = feature_map::run(3, 100, &feature_map::parameters(), || ()).unwrap();
    println!("{outcome:?}");
    assert!(outcome.right[2] >= 0.95 && outcome.wrong == 0);
}

#[test]
fn stored_places_are_found_and_other_halls_are_not() {
    if recordings("stored_places_are_found_and_other_halls_are_not", "scans2d").is_none() {
        return;
    }
    let scans = Set::Fr079.scans().unwrap();
    // The first half is stored, scans of the second half are asked for.
    let (stored, asked) = scans.split_at(scans.len() / 2);
    let mut map = PlaceMap::new(&choose(stored, Spacing { shift: 0.3, turn: 0.35 }));
    let mut observer = Observer::default();
    let (mut right, mut wrong) = (0, 0);
    for scan in asked.iter().step_by(7) {
        if let PlaceAnswer::Found(fix) = map.find(&observer.observe(&scan.scan), &FindParameters::default()) {
            let error = scan.laser.between(&fix.pose);
            let is_right = error.position().norm() < 0.5 && error.theta.abs() < 0.17;
            (right, wrong) = if is_right { (right + 1, wrong) } else { (right, wrong + 1) };
        }
    }
    println!("right {right}, wrong {wrong}");
    assert!(right >= 20 && wrong == 0);
    let other = Set::Intel.scans().unwrap();
    let found = other.iter().step_by(20).filter(|scan| {
        let answer = map.find(&observer.observe(&scan.scan), &FindParameters::default());
        matches!(answer, PlaceAnswer::Found(_))
    });
    let found = found.count();
    println!("found of another hall: {found}");
    assert!(found <= 1);
}
