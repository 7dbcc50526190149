//! What happens to what finds no room: it is counted, and what is kept is spread over all directions.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use crate::support::hall::corners;
use crate::support::standing_scan;
use agv_core::geometry::Pose;
use agv_core::localizer::{CapacitiesOf, Event, Localizer, OBSERVATIONS, Parameters, PoseFix};
use agv_core::measurement::{LaserId, ReflectorObservation, Reflectors, Scan, Time};
use agv_core::odometry::Vehicle;
use agv_core::sensing::falko::{Detector, Parameters as Falko};
use agv_core::sensing::{Keypoint, PointScan, ReflectorDetection, detect_reflectors};

/// How many of these directions, rad, lie in each quarter of a turn.
fn quarters(bearings: impl Iterator<Item = f64>) -> [usize; 4] {
    let mut counts = [0; 4];
    for bearing in bearings {
        counts[(bearing.rem_euclid(TAU) / (0.25 * TAU)) as usize % 4] += 1;
    }
    counts
}

fn observations(count: usize) -> Vec<ReflectorObservation> {
    let of = |index: usize| ReflectorObservation {
        time: Time::from_micros(1_000_000 + index as u64),
        range: 5.0,
        bearing: (TAU * index as f64 / count as f64 - PI) as f32,
    };
    (0..count).map(of).collect()
}

fn localizer() -> Box<Localizer<CapacitiesOf<360, 8, 8, 8>>> {
    let mut localizer = Box::new(Localizer::new(Parameters::new(Vehicle::Increments, Pose::default())));
    let fix = PoseFix {
        time: Time::from_micros(1_000_000),
        pose: Pose::default(),
        position_deviation: 0.1,
        heading_deviation: 0.1,
    };
    localizer.handle(&Event::SetPose(fix));
    localizer
}

#[test]
fn of_too_many_reflectors_those_of_all_directions_are_kept() {
    for count in [1, OBSERVATIONS, OBSERVATIONS + 1, 200, 1000] {
        let mut localizer = localizer();
        let seen = observations(count);
        let outputs = localizer.handle(&Event::Reflectors(Reflectors::of_first(&seen)));
        assert_eq!(outputs.pose.overflows, u8::from(count > OBSERVATIONS), "{count}");
        assert_eq!(outputs.uses.len(), count.min(OBSERVATIONS));
        if count > OBSERVATIONS {
            let bearings = outputs.uses.iter().map(|used| f64::from(used.position[1].atan2(used.position[0])));
            let counts = quarters(bearings);
            assert!(counts.iter().all(|quarter| quarter.abs_diff(OBSERVATIONS / 4) <= 1), "{count}: {counts:?}");
        }
        let times: Vec<_> = outputs.uses.iter().map(|used| used.time).collect();
        assert!(times.is_sorted());
    }
}

#[test]
fn of_too_many_bright_spots_those_of_all_directions_are_kept() {
    for count in [128_usize, 129, 200, 350] {
        let beams = 4 * count;
        let ranges = vec![5.0; beams];
        let intensities: Vec<u16> = (0..beams).map(|beam| u16::from(beam % 4 == 1)).collect();
        let scan = Scan {
            laser: LaserId::FIRST,
            start: Time::default(),
            beam_interval: 1e-5,
            first_bearing: -PI,
            bearing_step: TAU / beams as f64,
            ranges: &ranges,
            intensities: &intensities,
        };
        let mut found = heapless::Vec::<ReflectorObservation, 128>::new();
        assert_eq!(detect_reflectors(&scan, &ReflectorDetection::default(), &mut found), count - 128);
        assert_eq!(found.len(), 128);
        let counts = quarters(found.iter().map(|seen| f64::from(seen.bearing)));
        assert!(counts.iter().all(|quarter| quarter.abs_diff(32) <= 1), "{count}: {counts:?}");
    }
}

#[test]
fn of_too_many_features_the_best_known_are_kept() {
    const BEAMS: usize = 1440;
    let ranges = standing_scan::ranges(&Pose::new(0.4, 0.3, 0.2), BEAMS, |_, range| range);
    let scan = standing_scan::scan(Time::default(), &ranges);
    let mut points = Box::new(PointScan::<BEAMS>::new());
    points.set(&scan, 0.1, 50.0);
    let mut detector = Box::new(Detector::<BEAMS>::new(Falko::mended()));
    let mut all = heapless::Vec::<Keypoint, 256>::new();
    assert_eq!(detector.detect(&points, &mut all), 0);
    let variance = |keypoint: &Keypoint| keypoint.covariance[0] + keypoint.covariance[2];
    let mut sorted: Vec<f32> = all.iter().map(variance).collect();
    sorted.sort_by(f32::total_cmp);
    let mut few = heapless::Vec::<Keypoint, 6>::new();
    assert!(all.len() > 8 && all.len() < corners().count() + 20, "{}", all.len());
    assert_eq!(detector.detect(&points, &mut few), all.len() - 6);
    let mut kept: Vec<f32> = few.iter().map(variance).collect();
    kept.sort_by(f32::total_cmp);
    assert_eq!(kept, sorted[..6]);
}

#[test]
fn bright_spots_that_find_no_room_are_counted() {
    for (count, overflows) in [(80_u32, 0), (128, 0), (129, 1), (300, 1)] {
        let beams = 4 * count as usize;
        let ranges = vec![5.0; beams];
        let intensities: Vec<u16> = (0..beams).map(|beam| u16::from(beam % 4 == 1)).collect();
        let mut parameters = Parameters::new(Vehicle::Increments, Pose::default());
        parameters.reflectors.detection = Some(ReflectorDetection::default());
        let mut localizer = Box::new(Localizer::<CapacitiesOf<1440, 8, 8, 8>>::new(parameters));
        let time = Time::from_micros(1_000_000);
        let fix = PoseFix { time, pose: Pose::default(), position_deviation: 0.1, heading_deviation: 0.1 };
        localizer.handle(&Event::SetPose(fix));
        let scan = Scan {
            laser: LaserId::FIRST,
            start: time,
            beam_interval: 0.0,
            first_bearing: -PI,
            bearing_step: TAU / beams as f64,
            ranges: &ranges,
            intensities: &intensities,
        };
        assert_eq!(localizer.handle(&Event::Scan(scan)).pose.overflows, overflows, "{count}");
    }
}
