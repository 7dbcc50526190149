//! What faults do to a drive, by the geometry that they state.

use std::collections::BTreeMap;

use agv_core::geometry::{Point, difference};
use agv_core::measurement::ReflectorObservation;
use agv_host_sim::recording::{RecordedEvent, RecordedScan, Recording, truth_at};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{Carry, Scenario};
use agv_host_sim::simulate::{START, Simulation, simulate};
use agv_lab::campaign::fault::{
    BearingError, CountError, Encoder, Fault, FaultKind, RangeError, ViewError, simulate_with,
};
use agv_lab::trust::hall::{self, Generator};

fn quiet(seed: u64) -> Scenario {
    let mut scenario = hall::draw(Generator::Racks, seed).scenario;
    scenario.laser.scans = false;
    scenario
}

fn fault(what: FaultKind) -> Fault {
    Fault { name: "a".to_owned(), from: 0.0, until: None, what, can_recover: true }
}

/// The drive before and after the fault.
fn spoilt(what: FaultKind) -> (Simulation, Recording) {
    let simulation = simulate(&quiet(3)).unwrap();
    let mut recording = simulation.recording.clone();
    fault(what).spoil(&mut recording, &simulation.true_tricycle, &mut Random::new(3, Stream::Faults));
    (simulation, recording)
}

fn revolutions(recording: &Recording) -> impl Iterator<Item = &Vec<ReflectorObservation>> {
    recording.events.iter().filter_map(|event| match event {
        RecordedEvent::Reflectors(seen) => Some(&seen.observations),
        _ => None,
    })
}

fn pairs<'a>(
    before: &'a Simulation,
    after: &'a Recording,
) -> impl Iterator<Item = (&'a ReflectorObservation, &'a ReflectorObservation)> {
    revolutions(&before.recording).zip(revolutions(after)).flat_map(|(before, after)| {
        assert_eq!(before.len(), after.len());
        before.iter().zip(after)
    })
}

/// How often each reflector of the map was seen.
fn counts(recording: &Recording) -> BTreeMap<u16, usize> {
    let mut counts = BTreeMap::new();
    for seen in revolutions(recording).flatten() {
        let sensor = truth_at(&recording.truth, seen.time).unwrap().compose(recording.parameters.lasers.first());
        let (sine, cosine) = libm::sincos(f64::from(seen.bearing));
        let place = sensor.transform(&(Point::new(cosine, sine) * f64::from(seen.range)));
        let nearest = recording.landmarks.iter().map(|one| (one.id, (one.position() - place).norm()));
        let (id, distance) = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        if distance < 0.3 {
            *counts.entry(id).or_default() += 1;
        }
    }
    counts
}

#[test]
fn reflectors_that_have_gone_are_never_seen_and_the_others_as_often_as_before() {
    let (before, after) = spoilt(FaultKind::ReflectorsGone { share: 0.5 });
    let (known, left) = (counts(&before.recording), counts(&after));
    assert!(left.iter().all(|(id, count)| known[id] == *count), "{left:?}");
    let gone = known.len() - left.len();
    assert!(known.len() > 20 && (known.len() / 4..3 * known.len() / 4).contains(&gone), "{gone} of {}", known.len());
    assert_eq!(after.landmarks, before.recording.landmarks);
}

#[test]
fn a_tilted_laser_measures_along_its_slope() {
    let (deg, height) = (4.0_f64, 2.0);
    let (sine, cosine) = deg.to_radians().sin_cos();
    for (height, shift) in [(0.0, 0.0), (height, height * sine)] {
        let (before, after) = spoilt(FaultKind::LaserTilted { deg, towards_deg: 0.0, height });
        let mut compared = 0;
        for (level, tilted) in pairs(&before, &after) {
            let place = |seen: &ReflectorObservation| {
                let (range, bearing) = (f64::from(seen.range), f64::from(seen.bearing));
                (range * bearing.cos(), range * bearing.sin())
            };
            let ((x, y), (along, across)) = (place(level), place(tilted));
            // Where the plane is when the laser looks down by 4 deg.
            assert!((along * cosine - (x - shift)).abs() < 1e-4 && (across - y).abs() < 1e-4, "{level:?} {tilted:?}");
            compared += 1;
        }
        assert!(compared > 500, "{compared}");
    }
}

#[test]
fn an_error_that_wanders_is_one_for_a_revolution_and_stays_for_its_time() {
    let (before, after) = spoilt(FaultKind::RangesWander { metres: 0.1, seconds: 2.0 });
    let mut errors = Vec::new();
    for (level, wrong) in revolutions(&before.recording).zip(revolutions(&after)) {
        let of = |place: usize| level.get(place).zip(wrong.get(place)).map(|(a, b)| f64::from(b.range - a.range));
        let (Some(first), Some(last)) = (of(0), of(level.len().saturating_sub(1))) else { continue };
        assert!((first - last).abs() < 1e-4, "{first} {last}");
        errors.push(first);
    }
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
        sum / f64::max(count, 1.0)
    };
    let variance = mean(&mut errors.iter().map(|error| error * error));
    // Sixteen revolutions are two seconds.
    let later = mean(&mut errors.iter().zip(errors.iter().skip(16)).map(|(a, b)| a * b));
    assert!(errors.len() > 300 && (0.06..0.14).contains(&variance.sqrt()), "{} {variance}", errors.len());
    assert!((0.1..0.65).contains(&(later / variance)), "{}", later / variance);
}

#[test]
fn slip_in_bends_turns_the_wheel_further_than_the_vehicle_and_nothing_else() {
    let (before, after) = spoilt(FaultKind::SlipInBends { share: 0.2 });
    let tricycle = &before.true_tricycle;
    let angle = |ticks: u32| {
        let half = (tricycle.steering_range.values() / 2) as i64;
        let signed = (i64::from(ticks) + half).rem_euclid(2 * half) - half;
        signed as f64 * tricycle.steering_scale + tricycle.steering_offset_forward
    };
    let mut bent = 0;
    for (one, other) in before.recording.events.iter().zip(&after.events) {
        let (RecordedEvent::Encoders(one), RecordedEvent::Encoders(other)) = (one, other) else { continue };
        let (true_angle, told) = (angle(one.steering), angle(other.steering));
        assert_eq!(one.drive, other.drive);
        assert!((told.tan() - 1.2 * true_angle.tan()).abs() < 4.0 * tricycle.steering_scale, "{true_angle} {told}");
        bent += usize::from(true_angle.abs() > 0.2);
    }
    assert!(bent > 100, "{bent}");
}

#[test]
fn a_carried_vehicle_is_elsewhere_at_once_and_its_wheel_has_not_turned() {
    let sound = simulate(&quiet(3)).unwrap().recording;
    let stands = sound
        .truth
        .windows(300)
        .find(|truth| truth[0].time.since(START) > 10.0 && truth.iter().all(|sample| sample.pose == truth[0].pose));
    let time = stands.unwrap()[100].time.since(START);
    let mut scenario = quiet(3);
    scenario.drive.carries.push(Carry { from: time, x: 0.2, y: -0.3, heading_deg: 5.0 });
    let carried = simulate(&scenario).unwrap().recording;
    let at = |recording: &Recording, after: f64| truth_at(&recording.truth, START.offset(time + after)).unwrap();
    assert_eq!(at(&carried, -0.02), at(&sound, -0.02));
    let moved = at(&carried, -0.02).between(&at(&carried, 0.02));
    assert!((moved.x - 0.2).abs() < 1e-9 && (moved.y + 0.3).abs() < 1e-9, "{moved:?}");
    assert!(difference(moved.theta, 5_f64.to_radians()).abs() < 1e-9, "{moved:?}");
    let drive = |recording: &Recording, after: f64| {
        let at = START.offset(time + after);
        let mut encoders = recording.events.iter().filter_map(|event| match event {
            RecordedEvent::Encoders(sample) if sample.time <= at => Some(sample.drive),
            _ => None,
        });
        encoders.next_back()
    };
    assert_eq!(drive(&carried, -0.02), drive(&carried, 0.02));
    // It is steered back to its way, on which it is as much further as it was carried.
    let end = sound.truth.last().unwrap().pose.between(&carried.truth.last().unwrap().pose);
    assert!(end.y.abs() < 0.01 && end.x.abs() < 0.4 && end.theta.abs() < 0.01, "{end:?}");
}

#[test]
fn reflectors_that_stand_there_are_seen_and_not_in_the_map() {
    let scenario = quiet(3);
    let sound = simulate(&scenario).unwrap().recording;
    let stand = fault(FaultKind::ReflectorsStand { count: 12 });
    let random = || Random::new(3, Stream::Faults);
    let found = simulate_with(&scenario, &[&stand], &mut random()).unwrap();
    assert_eq!(found.recording.landmarks, sound.landmarks);
    assert_eq!(found.world.reflectors.len(), sound.landmarks.len() + 12);
    let all = |recording: &Recording| revolutions(recording).map(Vec::len).sum::<usize>();
    assert!(all(&found.recording) > all(&sound) + 500, "{} {}", all(&found.recording), all(&sound));
    assert!(simulate_with(&Scenario::default(), &[&stand], &mut random()).is_err());
}

/// A layout of two sessions, or a bent one: what is laid onto the true one is laid as well as it fits, and what is not has its first half,
/// or its ends, where they were.
#[test]
fn a_layout_of_two_sessions_is_distorted_as_it_is_stated() {
    let before = simulate(&quiet(4)).unwrap().recording.landmarks;
    let mislead = |what| {
        let mut recording = simulate(&quiet(4)).unwrap().recording;
        fault(what).mislead(&mut recording, &mut Random::new(4, Stream::Faults));
        recording.landmarks
    };
    let middle = before.iter().map(|landmark| landmark.x).sum::<f64>() / before.len() as f64;
    let kinds: [fn(bool) -> FaultKind; 3] = [
        |is_laid| FaultKind::SessionTurned { deg: 0.5, is_laid },
        |is_laid| FaultKind::SessionShifted { metres: 0.2, is_laid },
        |is_laid| FaultKind::LayoutBent { metres: 0.3, is_laid },
    ];
    for (number, kind) in kinds.iter().enumerate() {
        let after = mislead(kind(false));
        let moved: Vec<Point> =
            before.iter().zip(&after).map(|(one, other)| other.position() - one.position()).collect();
        let most = moved.iter().map(Point::norm).fold(0.0, f64::max);
        if number < 2 {
            assert!(before.iter().zip(&moved).all(|(one, moved)| (one.x > middle) == (moved.norm() > 1e-9)));
        }
        match number {
            // Distances within a session stay, and its farthest place turns the most.
            0 => {
                let lever = before.iter().map(|one| one.x - middle).fold(0.0, f64::max);
                assert!(most > 0.99 * lever * 0.5_f64.to_radians(), "{most}");
            }
            1 => assert!((most - 0.2).abs() < 1e-9),
            _ => assert!(moved.iter().all(|moved| moved.x == 0.0 && (0.0..=0.3).contains(&moved.y)) && most > 0.25),
        }
        // Nothing that turns or shifts all of it brings it nearer: no mean, no moment.
        let laid = mislead(kind(true));
        let mean = |landmarks: &[agv_core::maps::Landmark]| {
            landmarks.iter().map(|one| one.position()).sum::<Point>() / landmarks.len() as f64
        };
        let (from, to) = (mean(&before), mean(&laid));
        assert!((from - to).norm() < 1e-9, "{number}");
        let moment: f64 = before
            .iter()
            .zip(&laid)
            .map(|(one, other)| {
                let (one, other) = (one.position() - from, other.position() - to);
                one.x * other.y - one.y * other.x
            })
            .sum();
        assert!(moment.abs() < 1e-6, "{number}: {moment}");
        // And it is as distorted as the other one: distances of places are the same.
        let far = |landmarks: &[agv_core::maps::Landmark]| {
            (landmarks[0].position() - landmarks[landmarks.len() - 1].position()).norm()
        };
        assert!((far(&laid) - far(&after)).abs() < 1e-9, "{number}");
    }
}

/// A fault by a rule that changes reflectors or counters, of a size of which it does so.
fn by_rule() -> Vec<(FaultKind, FaultKind)> {
    let ranges = [
        (RangeError::Stretched, 0.1),
        (RangeError::Warms, 0.1),
        (RangeError::OneSide, 0.1),
        (RangeError::NearShort, 0.1),
        (RangeError::OtherShape, 0.1),
    ];
    let bearings = [BearingError::AlongRevolution, BearingError::NowAndThen, BearingError::InTurn];
    let views = [
        (ViewError::Echoes, 1.0),
        (ViewError::LoadShines, 3.0),
        (ViewError::NearOnly, 0.8),
        (ViewError::Fog, 0.5),
        (ViewError::Gap, 90.0),
        (ViewError::Repeats, 0.5),
        (ViewError::HalfHidden, 0.1),
    ];
    let drive = [
        (CountError::Wears, 0.1),
        (CountError::Forward, 0.1),
        (CountError::Backward, 0.1),
        (CountError::BackwardsForward, 0.5),
        (CountError::AtRest, 0.1),
        (CountError::Holds, 0.5),
        (CountError::Zero, 0.1),
    ];
    let steering = [
        (CountError::Creeps, 2.0),
        (CountError::Play, 2.0),
        (CountError::Eccentric, 2.0),
        (CountError::Slips, 0.1),
        (CountError::Holds, 0.5),
        (CountError::Zero, 0.1),
    ];
    let range = |(how, size)| [0.0, size].map(|size| FaultKind::RangesOff { how, size });
    let bearing = |how| [0.0, 1.0].map(|deg| FaultKind::BearingsOff { how, deg });
    let view = |(how, size)| [0.0, size].map(|size| FaultKind::ViewOff { how, size });
    let count = |of, (how, size)| [0.0, size].map(|size| FaultKind::CountsOff { of, how, size });
    let all = ranges.into_iter().map(range).chain(bearings.into_iter().map(bearing)).chain(views.into_iter().map(view));
    let counts = drive.into_iter().map(|one| count(Encoder::Drive, one));
    let counts = counts.chain(steering.into_iter().map(|one| count(Encoder::Steering, one)));
    all.chain(counts).map(|[nothing, something]| (nothing, something)).collect()
}

#[test]
fn a_fault_by_a_rule_changes_nothing_at_no_size_and_something_at_another() {
    for (nothing, something) in by_rule() {
        let (before, after) = spoilt(nothing);
        assert!(before.recording.events == after.events, "{nothing:?}");
        let (before, after) = spoilt(something);
        assert!(before.recording.events != after.events, "{something:?}");
    }
}

fn scans(recording: &Recording) -> impl Iterator<Item = &RecordedScan> {
    recording.events.iter().filter_map(|event| match event {
        RecordedEvent::Scan(scan) => Some(scan),
        _ => None,
    })
}

#[test]
fn surfaces_have_the_errors_that_the_laser_has_and_not_those_of_reflectors() {
    let mut scenario = quiet(3);
    scenario.laser.scans = true;
    let simulation = simulate(&scenario).unwrap();
    let after = |what| {
        let mut recording = simulation.recording.clone();
        fault(what).spoil(&mut recording, &simulation.true_tricycle, &mut Random::new(3, Stream::Faults));
        recording
    };
    let stretched = after(FaultKind::RangesOff { how: RangeError::Stretched, size: 0.02 });
    let turned = after(FaultKind::BearingsOff { how: BearingError::AlongRevolution, deg: 1.0 });
    let near = after(FaultKind::ViewOff { how: ViewError::NearOnly, size: 0.8 });
    let short = after(FaultKind::RangesOff { how: RangeError::NearShort, size: 0.1 });
    assert!(scans(&simulation.recording).eq(scans(&short)));
    let mut seen = 0;
    let of_faults = scans(&stretched).zip(scans(&turned)).zip(scans(&near));
    for (before, ((stretched, turned), near)) in scans(&simulation.recording).zip(of_faults) {
        let ranges = before.ranges.iter().zip(&stretched.ranges).zip(&near.ranges);
        for ((before, stretched), near) in ranges.filter(|((before, _), _)| **before > 0.0) {
            assert!((stretched - 1.02 * before).abs() < 1e-4, "{before}, {stretched}");
            assert_eq!(*near, if f64::from(*before) > 30.0 * (1.0 - 0.8) { 0.0 } else { *before });
            seen += 1;
        }
        let error = |beam: f64| {
            turned.first_bearing - before.first_bearing + beam * (turned.bearing_step - before.bearing_step)
        };
        let last = before.ranges.len() as f64;
        assert!(error(0.0).abs() < 1e-9 && (error(last) - 1_f64.to_radians()).abs() < 1e-9);
    }
    assert!(seen > 100_000, "{seen}");
}

#[test]
fn a_layout_that_is_cut_off_misses_its_end() {
    let (before, _) = spoilt(FaultKind::Nothing);
    let landmarks = &before.recording.landmarks;
    for (share, kept) in [(0.0, landmarks.len()), (0.5, landmarks.len().div_ceil(2)), (1.0, 0)] {
        let mut recording = before.recording.clone();
        let cut_off = fault(FaultKind::LayoutCutOff { share });
        cut_off.mislead(&mut recording, &mut Random::new(4, Stream::Faults));
        assert_eq!(recording.landmarks, landmarks[..kept]);
    }
}

#[test]
fn ranges_by_a_rule_are_wrong_by_what_they_state() {
    let of = |how, size| FaultKind::RangesOff { how, size };
    for (what, expected) in [
        (of(RangeError::Stretched, 0.02), (|range: f64, _: f64| 0.02 * range) as fn(f64, f64) -> f64),
        (of(RangeError::OneSide, 0.05), |_, bearing| if bearing > 0.0 { 0.05 } else { 0.0 }),
        (of(RangeError::NearShort, 0.1), |range, _| -0.1 * libm::exp(-range / 4.0)),
    ] {
        let (before, after) = spoilt(what);
        for (before, after) in pairs(&before, &after) {
            let (range, bearing) = (f64::from(before.range), f64::from(before.bearing));
            let error = f64::from(after.range) - range - expected(range, bearing);
            assert!(error.abs() < 1e-5, "{what:?}: {error} at {range} m");
        }
    }
    let (before, after) = spoilt(of(RangeError::OtherShape, 0.03));
    let wrong = |(before, after): (&ReflectorObservation, &ReflectorObservation)| f64::from(after.range - before.range);
    let errors: Vec<f64> = pairs(&before, &after).map(wrong).collect();
    assert!(errors.iter().all(|error| error.abs() < 1e-5 || (error - 0.03).abs() < 1e-5));
    let share = errors.iter().filter(|error| **error > 0.02).count() as f64 / errors.len() as f64;
    assert!((0.2..0.8).contains(&share), "{share}");
}
