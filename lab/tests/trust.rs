//! The judge, the halls that are drawn, and the kinds of faults.

use std::path::Path;

use agv_core::geometry::{Point, Pose};
use agv_core::integrity::{Alarm, AlertLimit, AlertLimits, ProtectionLevel};
use agv_core::localizer::{Parameters, Reason};
use agv_core::measurement::Time;
use agv_core::state::Mode;
use agv_host_sim::recording::RecordedEvent;
use agv_host_sim::simulate::scenario::WorldOptions;
use agv_host_sim::simulate::simulate;
use agv_lab::campaign::Shard;
use agv_lab::equipment::Equipment;
use agv_lab::evaluate::levels;
use agv_lab::trust::exact_bound;
use agv_lab::trust::figures::figures;
use agv_lab::trust::hall::{Generator, SKETCHES, Sketch, sketch};
use agv_lab::trust::judge::{Judge, MOST_OVER, Moment, STEP};
use agv_lab::trust::kinds::{self, Drawn, NOTHING};
use agv_lab::trust::nominal::NominalWorld;
use agv_lab::trust::outcome::Outcome;
use agv_lab::trust::row::{self, Row, RowsError};
use agv_lab::trust::trial::{Tested, Trial};
use agv_lab::trust::{hall, pair, sweep};
use agv_wire::can::controller::{Health, PublishedPose};

/// The world in which the scenes below were found.
fn easy() -> Tested<'static> {
    Tested { world: NominalWorld::Easy, ..Tested::default() }
}

/// A pose in the origin with a protection level of 10 cm and 1 deg.
fn pose() -> PublishedPose {
    let level = ProtectionLevel { position: 0.1, heading: 1_f64.to_radians() };
    PublishedPose {
        counter: 0,
        pose: Pose::default(),
        time: 0,
        dead_reckoning_distance: 0.0,
        deviations: [0.0; 3],
        correlations: [0.0; 3],
        mode: Mode::Reflectors,
        reason: Reason::None,
        health: Health::default(),
        is_good: false,
        has_jumped: false,
        resets: 0,
        last_reset: 0.0,
        overflows: 0,
        level,
        limit: AlertLimit { position: 0.15, heading: 0.035 },
        alarm: Alarm::None,
    }
}

/// Judges spans of time: so many outputs of a pose, wrong by so much in x, that were driven at 1 m/s.
fn judge(spans: &[(usize, PublishedPose, f64)]) -> Outcome {
    let mut judge = Judge::new(AlertLimits::default());
    let mut now = Time::from_seconds(10.0);
    for (count, pose, error) in spans {
        for _ in 0..*count {
            now = now.offset(STEP);
            judge.hear(&Moment {
                now,
                heard: Some((pose, now)),
                truth: Some(Pose::new(*error, 0.0, 0.0)),
                driven: STEP,
                docks: true,
                is_nominal: true,
                is_bare: false,
                has_begun: false,
                is_hidden: false,
            });
        }
    }
    judge.outcome()
}

#[test]
fn an_error_above_the_protection_level_misleads_and_above_the_alert_limit_is_hazardous() {
    let sound = judge(&[(1000, pose(), 0.09)]);
    assert_eq!((sound.misleading, sound.hazards, sound.available), (0, 0, 1000));
    assert!((sound.most_over_level - 0.9).abs() < 1e-9 && sound.ends_right);
    let misleading = judge(&[(1000, pose(), 0.12)]);
    assert_eq!((misleading.misleading, misleading.hazards, misleading.failures), (1000, 0, 0));
    assert!(!misleading.ends_right);
    let hazardous = judge(&[(1000, pose(), 0.16)]);
    assert_eq!((hazardous.hazards, hazardous.failures), (1, 1));
    assert!((hazardous.worst_hazard_s - 10.0).abs() < 1e-9 && (hazardous.worst_hazard_m - 10.0).abs() < 1e-9);
    // A protection level above the alert limit says that the pose is of no use.
    let wide = PublishedPose { level: ProtectionLevel { position: 0.2, heading: 0.01 }, ..pose() };
    let warned = judge(&[(1000, wide, 0.3)]);
    assert_eq!((warned.misleading, warned.hazards, warned.available), (1000, 0, 0));
}

#[test]
fn what_is_hidden_fails_only_where_all_counts() {
    let limits = AlertLimits::default();
    // Half a second in all, of which two fifths are hidden: without them it is no failure.
    let spans = [(20, false), (20, true), (10, false)];
    let mut judge = Judge::new(limits);
    let (heard, mut now) = (pose(), Time::from_seconds(10.0));
    for (count, is_hidden) in spans {
        for _ in 0..count {
            now = now.offset(STEP);
            judge.hear(&Moment {
                now,
                heard: Some((&heard, now)),
                truth: Some(Pose::new(0.16, 0.0, 0.0)),
                driven: 0.0,
                docks: false,
                is_nominal: false,
                is_bare: false,
                has_begun: true,
                is_hidden,
            });
        }
    }
    let outcome = judge.outcome();
    assert_eq!((outcome.failures, outcome.failures_of_all, outcome.hidden_hazardous), (0, 1, 20));
    assert_eq!(self::judge(&[(1000, pose(), 0.16)]).failures_of_all, 1);
}

#[test]
fn docking_has_limits_of_its_own_and_the_heading_counts_as_the_position_does() {
    let narrow = ProtectionLevel { position: 0.04, heading: 0.005 };
    let close = PublishedPose { level: narrow, ..pose() };
    let hazardous = judge(&[(1000, close, 0.06)]);
    assert_eq!((hazardous.hazards, hazardous.failures, hazardous.docking_available), (1, 1, 1000));
    let turned = PublishedPose { pose: Pose::new(0.0, 0.0, 0.04), ..pose() };
    assert_eq!(judge(&[(1000, turned, 0.0)]).failures, 1);
    let nowhere = PublishedPose { pose: Pose { x: f64::NAN, y: 0.0, theta: 0.0 }, ..pose() };
    let lost = judge(&[(1000, nowhere, 0.0)]);
    assert!(lost.failures == 1 && lost.most_over_level == MOST_OVER);
}

#[test]
fn hazards_less_than_a_second_apart_are_one_event_and_add_up() {
    let short = |gap| {
        judge(&[(500, pose(), 0.0), (20, pose(), 0.16), (gap, pose(), 0.0), (20, pose(), 0.16), (500, pose(), 0.0)])
    };
    let one = short(98);
    assert_eq!((one.hazards, one.failures), (1, 1));
    let two = short(101);
    assert_eq!((two.hazards, two.failures), (2, 0));
    assert!((two.worst_hazard_s - 0.2).abs() < 1e-9);
    assert_eq!(judge(&[(500, pose(), 0.0), (30, pose(), 0.16)]).failures, 0);
    assert_eq!(judge(&[(500, pose(), 0.0), (31, pose(), 0.16)]).failures, 1);
}

#[test]
fn who_says_nothing_claims_nothing() {
    for mode in [Mode::NotLocalised, Mode::Lost] {
        let outcome = judge(&[(1000, PublishedPose { mode, ..pose() }, 5.0)]);
        assert_eq!((outcome.claims, outcome.judged, outcome.first_claim), (0, 0, None), "{mode:?}");
    }
    for mode in [Mode::DeadReckoning, Mode::Degraded, Mode::WithoutOdometry] {
        assert_eq!(judge(&[(1000, PublishedPose { mode, ..pose() }, 5.0)]).failures, 1, "{mode:?}");
    }
    // Silence after a claim is no availability.
    let silent = judge(&[(1000, pose(), 0.0), (1000, PublishedPose { mode: Mode::Lost, ..pose() }, 0.0)]);
    assert_eq!((silent.judged, silent.available, silent.losses), (2000, 1000, 1));
    let lost = PublishedPose { mode: Mode::Lost, ..pose() };
    let again = |gap| judge(&[(100, pose(), 0.0), (10, lost, 0.0), (gap, pose(), 0.0), (10, lost, 0.0)]).losses;
    assert_eq!((again(500), again(1100)), (1, 2));
    let mut judge = Judge::new(AlertLimits::default());
    let old = pose();
    for step in 0..1000 {
        let now = Time::from_seconds(10.0 + f64::from(step) * STEP);
        let stated = now.offset(-0.11);
        let truth = Some(Pose::new(9.0, 0.0, 0.0));
        judge.hear(&Moment {
            now,
            heard: Some((&old, stated)),
            truth,
            driven: 0.0,
            docks: false,
            is_nominal: false,
            is_bare: false,
            has_begun: false,
            is_hidden: false,
        });
    }
    assert_eq!(judge.outcome().claims, 0);
}

fn scenarios(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/scenarios").join(name)
}

#[test]
fn there_are_sixty_kinds_and_more_each_at_nine_sizes_or_more() {
    let kinds = kinds::read(&scenarios("trust.toml")).unwrap().kinds;
    assert!(kinds.len() >= 61, "{}", kinds.len());
    for kind in &kinds {
        assert!(kind.sizes.is_empty() || kind.sizes.len() >= kinds::FEWEST_SIZES, "{}", kind.name);
        for &size in kind.every_size() {
            let drawn = kind.at(size, 7.0).unwrap();
            assert_eq!(drawn == Drawn::Nothing, kind.name == NOTHING, "{}", kind.name);
        }
    }
    let text = |what: &str| format!("[[kind]]\nname = \"a\"\nunit = \"m\"\n{what}\n");
    for (wrong, complaint) in [
        ("sizes = [0, 1]\nwhat = { kind = \"wall_moved\", metres = \"size\" }", "fewer than 9 sizes"),
        ("sizes = [0, 1, 2, 3, 4, 5, 6, 7, 8]\nwhat = { kind = \"laser_silent\" }", "nothing that they are of"),
        ("what = { kind = \"laser_silent\" }\nknock = { x = 1.0 }", "one of `what`, `knock`, `carry` and `age`"),
        ("what = { kind = \"wall_moves\" }", "unknown variant"),
        ("what = 3", "invalid type"),
    ] {
        let found = kinds::parse(&text(wrong)).unwrap_err().to_string();
        assert!(found.contains(complaint), "{found}");
    }
}

#[test]
fn pairs_are_drawn_by_the_seed_and_few_hide_each_other() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let kinds: Vec<_> = catalogue.kinds.iter().filter(|kind| kind.name != NOTHING).cloned().collect();
    let mut hidden = 0;
    for seed in 1..=2000 {
        let [one, other] = pair::draw(&kinds, seed).unwrap();
        assert_eq!(pair::draw(&kinds, seed).unwrap(), [one, other]);
        assert_ne!(one.0.name, other.0.name);
        assert!(one.0.every_size().contains(&one.1) && other.0.every_size().contains(&other.1));
        let names = [(one.0.name.as_str(), one.1), (other.0.name.as_str(), other.1)];
        let by = catalogue.hidden_by(names[0], names[1]);
        assert_eq!(by, catalogue.hidden_by(names[1], names[0]));
        hidden += usize::from(by.is_some());
    }
    assert!((1..=200).contains(&hidden), "{hidden} of 2000");
    assert_eq!(catalogue.hidden_by(("laser silent", 5.0), ("wheel spins", 1.0)), Some("laser"));
    assert_eq!(catalogue.hidden_by(("laser silent", 1.0), ("wheel spins", 1.0)), None);
    assert_eq!(catalogue.hidden_by(("laser silent", 5.0), ("laser turned", 1.0)), None);
    assert!(pair::draw(&kinds[..1], 1).is_none());
    let unknown = "[[kind]]\nname = \"a\"\nunit = \"\"\nwhat = { kind = \"laser_silent\" }\n\
                   [[blinding]]\nsource = \"laser\"\ntaken_by = [[\"b\", 1.0]]\nshows = [\"a\"]\n";
    assert!(kinds::parse(unknown).unwrap_err().to_string().contains("is no kind"));
}

#[test]
fn pairs_count_in_the_totals_but_where_one_hides_the_other() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let row = |kind: &str, size, with: Option<(&str, f64)>, failures| Row {
        kind: kind.to_owned(),
        size,
        with: with.map(|(kind, size)| (kind.to_owned(), size)),
        seed: 1,
        scene: 1,
        is_accepted: true,
        can_recover: false,
        outcome: Some(Outcome { failures, hazards: failures, outputs: 100, ..Outcome::default() }),
    };
    let rows = [
        row("laser silent", 5.0, Some(("wheel spins", 1.0)), 1),
        row("laser silent", 5.0, Some(("laser turned", 1.0)), 2),
        row("laser silent", 5.0, None, 0),
    ];
    let found = figures(&rows, &[], &catalogue);
    assert_eq!((found.runs, found.integrity_failures), (2, 2));
    assert_eq!((found.pairs.runs, found.pairs.failures, found.pairs_apart.failures), (1, 1, 1));
    assert_eq!(found.pairs_apart.failed[0].hidden_by.as_deref(), Some("laser"));
    assert_eq!((found.per_fault.len(), found.per_fault[0].failures), (1, 0));
}

#[test]
fn a_fault_is_found_when_the_bus_says_so() {
    let outcome = |reason: Reason, begun: usize| {
        let mut judge = Judge::new(AlertLimits::default());
        for step in 0..400_usize {
            let now = Time::from_seconds(1.0 + 0.01 * step as f64);
            let heard = PublishedPose { reason: if step >= 300 { reason } else { Reason::None }, ..pose() };
            judge.hear(&Moment {
                now,
                heard: Some((&heard, now)),
                truth: Some(Pose::new(0.012, 0.0, 0.0)),
                driven: 0.01,
                docks: false,
                is_nominal: false,
                is_bare: false,
                has_begun: step >= begun,
                is_hidden: false,
            });
        }
        judge.outcome()
    };
    let found = outcome(Reason::MotionDisagrees, 250).found.unwrap();
    assert_eq!((found.after_ms, found.after_mm, found.by.as_str()), (500, 500, "motion"));
    assert_eq!(outcome(Reason::MotionDisagrees, 250).alarms, [("motion".to_owned(), 1)].into());
    assert!(outcome(Reason::NoLandmarks, 250).alarms.is_empty());
    assert_eq!(outcome(Reason::None, 250).found, None);
    assert_eq!(outcome(Reason::MotionDisagrees, 1000).found, None);
    // A protection level of 100 mm and an error of 12 mm.
    assert_eq!(outcome(Reason::None, 0).stanford, [(81 * 20 + 2, 400)].into());
}

/// Every sketch is drawn, drivable, and what its name says.
#[test]
fn sketches_are_what_they_are_called() {
    for seed in 0..70 {
        let hall = hall::draw(Generator::Sketches, seed);
        hall.scenario.check().unwrap();
        let mut quiet = hall.scenario.clone();
        (quiet.laser.scans, quiet.reflectors.missing_share, quiet.reflectors.false_share) = (false, 0.0, 0.0);
        let drive = simulate(&quiet).unwrap();
        let seen: Vec<usize> = drive
            .recording
            .events
            .iter()
            .filter_map(|event| match event {
                RecordedEvent::Reflectors(seen) => Some(seen.observations.len()),
                _ => None,
            })
            .collect();
        assert!(drive.path.length() > 60.0 && seen.len() > 400, "{seed}: {} m", drive.path.length());
        let reflectors = drive.world.reflectors.iter().map(|reflector| reflector.body.centre);
        let places: Vec<_> = reflectors.collect();
        let share =
            |is: &dyn Fn(usize) -> bool| seen.iter().filter(|count| is(**count)).count() as f64 / seen.len() as f64;
        match sketch(seed) {
            Sketch::Grid | Sketch::Periodic => assert!(share(&|count| count >= 3) > 0.9, "{seed}"),
            Sketch::ThreeInSight => {
                assert!(hall.is_accepted, "{seed}");
                let shares: Vec<f64> = (0..12).map(|wanted| share(&|count| count == wanted)).collect();
                assert!(shares[3..=5].iter().sum::<f64>() > 0.7, "{seed}: {shares:.2?}");
            }
            Sketch::OneLine => assert!(places.iter().all(|place| (place.y - places[0].y).abs() < 1e-9), "{seed}"),
            Sketch::Far => {
                let truth = drive.recording.truth.iter().step_by(50);
                let nearest = truth
                    .flat_map(|sample| places.iter().map(|place| (place - sample.pose.position()).norm()))
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest > 20.0, "{seed}: {nearest}");
            }
            Sketch::Fast => assert!((hall.scenario.drive.speed - 2.5).abs() < 1e-9, "{seed}"),
            Sketch::Symmetric => {
                let WorldOptions::Shapes(shapes) = &hall.scenario.world else { panic!() };
                let far = |axis: usize| shapes.walls.iter().map(|wall| wall[axis]).fold(0.0, f64::max);
                let corner = Point::new(far(0), far(1));
                let has_twin = |place: &&Point| places.iter().any(|other| (corner - **place - other).norm() < 1e-9);
                let odd = places.iter().filter(|place| !has_twin(place)).count();
                assert!((1..=3).contains(&odd) && places.len() > 8, "{seed}: {odd} of {}", places.len());
            }
        }
    }
    assert_eq!(SKETCHES.map(|one| SKETCHES.iter().filter(|other| **other == one).count()), [1; 7]);
}

/// What a hard world changes, and by how much at most; an easy one is as the hall was drawn.
#[test]
fn a_hard_world_has_what_is_stated() {
    let (mut biases, mut last) = (Vec::new(), None);
    for seed in 1..=200 {
        let drawn = hall::draw(Generator::Racks, seed).scenario;
        let mut easy = drawn.clone();
        NominalWorld::Easy.apply(&mut easy);
        assert_eq!(easy, drawn);
        let mut hard = drawn.clone();
        NominalWorld::Hard.apply(&mut hard);
        hard.check().unwrap();
        let stated = Parameters::new(Equipment::default().believed(), Pose::default()).odometry_noise;
        assert_eq!((hard.odometry.slip, hard.odometry.side_slip), (stated.slip, stated.side_slip));
        assert!((hard.odometry.yaw_walk_deg.to_radians() - stated.yaw).abs() < 1e-12);
        let errors = hard.laser.systematic;
        assert!(
            errors.range_bias.abs() <= 0.01 && errors.range_scale.abs() <= 5e-4 && errors.first_harmonic_deg <= 0.05
        );
        assert_ne!(last.replace(errors), Some(errors));
        biases.push(errors.range_bias);
        assert!(hard.floor.deviation > 0.0 && hard.reflectors.correlated_survey > 0.0);
    }
    // Uniform within 10 mm: a deviation of 10 mm over the root of three, to a tenth.
    let variance = biases.iter().map(|bias| bias * bias).sum::<f64>() / biases.len() as f64;
    assert!((variance.sqrt() - 0.01 / 3.0_f64.sqrt()).abs() < 6e-4, "{variance}");
}

#[test]
fn halls_differ_and_a_sound_vehicle_finds_itself_in_them() {
    let kinds = kinds::read(&scenarios("trust.toml")).unwrap().kinds;
    let sound: Vec<_> = kinds.into_iter().filter(|kind| kind.name == NOTHING).collect();
    let counts: Vec<usize> =
        (1..=20).map(|seed| hall::draw(Generator::Racks, seed).scenario.build_world().reflectors.len()).collect();
    assert!(counts.iter().min() < counts.iter().max(), "{counts:?}");
    let rows = sweep::run(&sweep::sweep(&sound, 2, 1), Shard::ALL, &Tested::default(), || ()).unwrap();
    let found = figures(&rows, &[], &kinds::read(&scenarios("trust.toml")).unwrap());
    assert_eq!((found.runs, found.panics, found.seeds), (2, 0, [1, 2]));
    assert!(found.first_claim_s[1] < 30.0 && found.nominal_mi == 0 && found.nominal_hmi == 0, "{found:?}");
    // The same run is the same row.
    let parts = [0, 1].map(|number| {
        sweep::run(&sweep::sweep(&sound, 2, 1), Shard { number, of: 2 }, &Tested::default(), || ()).unwrap()
    });
    assert_eq!(parts.concat(), rows);
}

#[test]
fn a_loss_where_no_reflectors_are_is_no_loss_of_continuity() {
    let losses = |is_bare: bool| {
        let mut judge = Judge::new(AlertLimits::default());
        for step in 0..200_u32 {
            let now = Time::from_seconds(1.0 + 0.01 * f64::from(step));
            let level = ProtectionLevel { position: if step < 100 { 0.1 } else { 0.2 }, heading: 0.01 };
            let heard = PublishedPose { level, ..pose() };
            let truth = Some(heard.pose);
            let moment = Moment {
                now,
                heard: Some((&heard, now)),
                truth,
                driven: 0.01,
                docks: false,
                is_nominal: false,
                is_bare,
                has_begun: false,
                is_hidden: false,
            };
            judge.hear(&moment);
        }
        let outcome = judge.outcome();
        (outcome.losses, outcome.available, outcome.judged)
    };
    // It is not available, though.
    assert_eq!((losses(false), losses(true)), ((1, 100, 200), (0, 100, 200)));
}

#[test]
fn what_nobody_can_tell_yet_counts_apart() {
    let outcome = |is_hidden: bool| {
        let mut judge = Judge::new(AlertLimits::default());
        for step in 0..100_u32 {
            let now = Time::from_seconds(1.0 + 0.01 * f64::from(step));
            let level = ProtectionLevel { position: 0.04, heading: 0.005 };
            let heard = PublishedPose { level, ..pose() };
            let truth = Some(Pose::new(heard.pose.x + 0.3, heard.pose.y, heard.pose.theta));
            let (driven, docks, is_nominal, is_bare) = (0.01, false, false, false);
            judge.hear(&Moment {
                now,
                heard: Some((&heard, now)),
                truth,
                driven,
                docks,
                is_nominal,
                is_bare,
                has_begun: true,
                is_hidden,
            });
        }
        let outcome = judge.outcome();
        (outcome.failures, outcome.hidden_hazardous, outcome.misleading)
    };
    // One event for each alert limit; what is misleading is so in either case.
    assert_eq!((outcome(false), outcome(true)), ((2, 0, 100), (0, 100, 100)));
}

/// Where no size misleads, the largest share of error over protection level is often that without the fault.
#[test]
fn the_worst_size_of_a_fault_is_one_at_which_it_is_there() {
    let row = |size: f64, most_over_level: f64, misleading: u64| Row {
        kind: "telegrams dropped".to_owned(),
        size,
        with: None,
        seed: 1,
        scene: 1,
        is_accepted: true,
        can_recover: false,
        outcome: Some(Outcome { most_over_level, misleading, ..Outcome::default() }),
    };
    let worst = |rows: &[Row]| row::worst_size(&row::by_size(rows, "telegrams dropped"));
    assert_eq!(worst(&[row(0.0, 0.4, 0), row(0.1, 0.2, 0), row(0.2, 0.3, 0), row(0.5, 0.1, 0)]), Some(0.2));
    assert_eq!(worst(&[row(0.0, 0.4, 0), row(0.1, 1.2, 3), row(0.2, 1.1, 4)]), Some(0.2));
    assert_eq!(worst(&[row(0.0, 0.4, 0)]), Some(0.0));
    assert_eq!(worst(&[]), None);
}

#[test]
fn rows_of_parts_are_those_of_the_whole() {
    let kinds = kinds::read(&scenarios("trust.toml")).unwrap().kinds;
    let folder = tempfile::tempdir().unwrap();
    let row = |kind: &str, size: f64, seed| Row {
        kind: kind.to_owned(),
        size,
        with: None,
        seed,
        scene: seed,
        is_accepted: true,
        can_recover: false,
        outcome: Some(Outcome { most_over_level: 0.1 * size, claims: seed, ..Outcome::default() }),
    };
    // In the order of the kinds and their sizes; what has no fault comes last.
    let whole = [
        row("telegrams dropped", 0.05, 1),
        row("telegrams dropped", 0.05, 2),
        row("telegrams dropped", 0.2, 1),
        row("power cut", 1.0, 7),
        row(NOTHING, 1.0, 3),
    ];
    let (one, two) = (folder.path().join("0"), folder.path().join("1"));
    row::write(&one, &[whole[4].clone(), whole[2].clone(), whole[0].clone()]).unwrap();
    row::write(&two, &[whole[3].clone(), whole[1].clone()]).unwrap();
    assert_eq!(row::read(&[two.clone(), one.clone()], &kinds).unwrap(), whole);
    assert!(matches!(row::read(&[one.clone(), one.clone()], &kinds), Err(RowsError::Twice { .. })));
    std::fs::write(&two, "{}").unwrap();
    assert!(matches!(row::read(&[two], &kinds), Err(RowsError::Line { line: 1, .. })));
    assert!(matches!(row::read(&[folder.path().join("2")], &kinds), Err(RowsError::File { .. })));
}

/// What was wrong before the drive is hidden from its first moment on; a laser that creeps, until something shows it behind its end.
#[test]
fn a_fault_is_hidden_from_when_it_begins() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/scenarios/trust.toml")).unwrap();
    let catalogue = agv_lab::trust::kinds::parse(&text).unwrap();
    let hidden = |name: &str, from: f64| {
        let kind = catalogue.kinds.iter().find(|kind| kind.name == name).unwrap();
        kind.hidden(from, &kind.at(0.1, from).unwrap()).map(|hidden| (hidden.from, hidden.since))
    };
    assert_eq!(hidden("mounting wrong forward", 0.0), Some((f64::NEG_INFINITY, 0.0)));
    assert_eq!(hidden("laser shifts slowly", 30.0), Some((30.0, 50.0)));
    assert_eq!(hidden("laser shifted forward", 30.0), None);
}

/// The laser was knocked between two events, of which the first had ended an interval; the vehicle was lost for 13 m, and found itself by the
/// knocked laser: no solution allowed for that knock.
#[test]
fn a_knock_by_which_the_vehicle_was_lost_is_held_once_it_has_found_itself() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    for (name, size, seed) in [("laser shifted to the left", 0.3, 20), ("laser shifted forward", 0.6, 50_209)] {
        let kind = catalogue.kinds.iter().find(|kind| kind.name == name).unwrap();
        let tried = Trial::in_scene((kind, size), None, seed).run(&easy()).unwrap();
        assert_eq!(tried.outcome.failures, 0, "{name}: {} s", tried.outcome.worst_hazard_s);
        assert!(tried.outcome.found.is_some(), "{name}");
    }
}

/// The vehicle was carried to where its laser sees no reflector: what it then sees of surfaces tells.
#[test]
fn a_vehicle_that_is_carried_to_where_no_reflector_is_says_so() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let kind = catalogue.kinds.iter().find(|kind| kind.name == "carried on").unwrap();
    let tried = Trial::in_scene((kind, 9.0), None, 50_216).run(&easy()).unwrap();
    assert_eq!(tried.outcome.failures, 0, "{} s", tried.outcome.worst_hazard_s);
}

/// Drives without a fault in which a level was wide or an alarm false: of a mounting that was never found, refuted; of two false reflectors
/// that were alike in one revolution; at the entry of an aisle without reflectors.
#[test]
fn sound_drives_are_available_all_the_time() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let kind = catalogue.kinds.iter().find(|kind| kind.name == NOTHING).unwrap();
    for seed in [50_776, 50_793, 915_048, 915_081, 915_084, 915_096] {
        let Outcome { judged, available, losses, alarms, .. } =
            Trial::in_scene((kind, 0.0), None, seed).run(&easy()).unwrap().outcome;
        assert_eq!((available, losses, alarms.len()), (judged, 0, 0), "{seed}: {alarms:?}");
    }
}

/// In a layout that is mirrored, and nearly its own mirror image, what is in sight fits now and then: what has not fitted before speaks
/// against it.
#[test]
fn what_has_not_fitted_is_not_forgotten_where_the_vehicle_looks_for_itself() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let kind = catalogue.kinds.iter().find(|kind| kind.name == "layout mirrored").unwrap();
    let tried = Trial::in_scene((kind, 1.0), None, 50_508).run(&easy()).unwrap();
    assert_eq!(tried.outcome.failures, 0, "{} s", tried.outcome.worst_hazard_s);
}

/// The car park by its reflectors: a real drive whose levels hold.
#[test]
fn the_levels_of_the_car_park_hold() {
    let Some(folder) = agv_host_sim::data::for_test("the_levels_of_the_car_park_hold", "carpark") else { return };
    let rows = levels::car_park(&folder).unwrap();
    assert_eq!(rows.iter().map(|row| row.mode).collect::<Vec<_>>(), ["reflectors", "slam", "slam and contours"]);
    for row in &rows {
        assert!(row.claims > 500, "{row:?}");
        assert!(row.mi_share == 0.0 && row.hazardous == 0, "{}: {}", row.mode, row.mi_share);
        assert_eq!(row.stanford.cells.iter().map(|(_, _, count)| count).sum::<u64>(), row.claims as u64);
    }
}

/// Against the quantiles of the beta and the chi-squared distribution (scipy.stats).
#[test]
fn bounds_of_what_was_counted_are_exact() {
    let shares = [
        (0, 300, 0.009_936_081_944_457_708),
        (1, 300, 0.015_714_554_891_583_95),
        (30, 300, 0.133_188_494_246_291_84),
        (3, 25_800, 0.000_300_501_637_494_608_43),
        (7, 7, 1.0),
    ];
    for (failures, runs, bound) in shares {
        let found = exact_bound::of_share(failures, runs).unwrap();
        assert!((found / bound - 1.0).abs() < 1e-9, "{failures} of {runs}: {found}");
    }
    assert_eq!(exact_bound::of_share(0, 0), None);
    for (count, bound) in [(0, 2.995_732_273_553_99), (1, 4.743_864_518_390_577), (20, 29.062_018_840_434_014)] {
        let found = exact_bound::of_count(count);
        assert!((found / bound - 1.0).abs() < 1e-9, "{count}: {found}");
    }
}

#[test]
fn the_worst_values_say_whose_they_are() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let row = |kind: &str, seed, is_accepted, outcome: Outcome| Row {
        kind: kind.to_owned(),
        size: 5.0,
        with: None,
        seed,
        scene: seed,
        is_accepted,
        can_recover: false,
        outcome: Some(Outcome { outputs: 1000, judged: 900, claims: 900, driven_um: 50_000_000_000, ..outcome }),
    };
    let sound = |available, level, first_claim| Outcome {
        available,
        nominal_mm: [(20, 500), (level, 1)].into(),
        first_claim,
        ..Outcome::default()
    };
    let rows = [
        row(NOTHING, 1, true, Outcome { losses: 1, ..sound(890, 41, Some(100)) }),
        row(NOTHING, 2, true, sound(900, 48, Some(110))),
        // Availability and levels are asked for in halls that commissioning accepts.
        row(NOTHING, 3, false, sound(5, 300, None)),
        row("laser silent", 4, true, Outcome { worst_hazard_s: 0.2, hazards: 1, ..Outcome::default() }),
    ];
    let swept = [row("laser silent", 7, true, Outcome { most_over_level: 0.5, ..Outcome::default() })];
    let found = figures(&rows, &swept, &catalogue);
    let worst = |of: Option<agv_lab::trust::worst::Worst>| of.map(|worst| (worst.value, worst.seed));
    assert_eq!(worst(found.worst.availability_travel), Some((890.0 / 900.0, 1)));
    assert_eq!(worst(found.worst.availability_docking), None);
    assert_eq!(worst(found.worst.losses), Some((1.0, 1)));
    assert_eq!(worst(found.worst.pl_nominal_mm), Some((48.0, 2)));
    assert_eq!(worst(found.worst.first_claim_s), Some((10.0, 3)));
    assert_eq!(worst(found.worst.hmi_s), Some((0.2, 4)));
    // One loss in the 100 km of two drives, and no failure of one run.
    let bounds = &found.bounds;
    assert!((bounds.losses_per_100km.unwrap() - 4.743_864_518).abs() < 1e-6, "{bounds:?}");
    assert!((bounds.failures_of_singles.unwrap() - 0.95).abs() < 1e-9, "{bounds:?}");
    let sizes = &found.per_fault[0].sizes;
    assert_eq!((sizes.len(), sizes[0].size, sizes[0].error_over_pl_max), (1, 5.0, Some(0.5)));
}

#[test]
fn the_worst_run_is_the_one_with_the_longest_hazard() {
    let catalogue = kinds::read(&scenarios("trust.toml")).unwrap();
    let row = |seed, hazards, worst_hazard_s, misleading, most_over_level| Row {
        kind: "laser silent".to_owned(),
        size: 5.0,
        with: None,
        seed,
        scene: seed,
        is_accepted: true,
        can_recover: false,
        outcome: Some(Outcome { hazards, worst_hazard_s, misleading, most_over_level, ..Outcome::default() }),
    };
    let worst = |rows: &[Row]| figures(rows, &[], &catalogue).per_fault[0].worst_seed;
    // Two short events are less than a long one.
    assert_eq!(worst(&[row(1, 2, 0.05, 9, 2.0), row(2, 1, 0.2, 1, 1.5)]), 2);
    assert_eq!(worst(&[row(1, 0, 0.0, 3, 1.2), row(2, 0, 0.0, 2, 5.0)]), 1);
    assert_eq!(worst(&[row(1, 0, 0.0, 0, 0.4), row(2, 0, 0.0, 0, 0.3)]), 1);
}
