//! Time of the detector on a real office log and on a synthetic storage.

#[path = "../../core/tests/falko/scene.rs"]
#[allow(dead_code, reason = "the scene also serves tests")]
mod scene;

use std::f64::consts::{PI, TAU};
use std::hint::black_box;

use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::sensing::falko::Detector;
use agv_core::sensing::{Keypoint, PointScan};
use agv_host_sim::data;
use agv_lab::evaluate::falko::{KEYPOINTS, RANGES, Set, profiles};
use criterion::{Criterion, criterion_group, criterion_main};

fn fr079(criterion: &mut Criterion) {
    if data::folder().is_none() {
        eprintln!("fr079: skipped, no folder of recordings (AGV_DATA)");
        return;
    }
    let scans = Set::Fr079.scans().expect("fr079 can be read");
    let points: Vec<_> = scans
        .iter()
        .map(|scan| {
            let mut points = Box::new(PointScan::<360>::new());
            points.set(&scan.scan.view(), RANGES.0, RANGES.1);
            points
        })
        .collect();
    for (name, parameters) in profiles() {
        let mut detector = Detector::<360>::new(parameters);
        let mut keypoints = heapless::Vec::<Keypoint, KEYPOINTS>::new();
        let mut turn = points.iter().cycle();
        criterion.bench_function(&format!("falko/fr079/{name}"), |bencher| {
            bencher.iter(|| turn.next().map(|points| detector.detect(black_box(points), &mut keypoints)));
        });
    }
}

fn storage(criterion: &mut Criterion) {
    const BEAMS: usize = 1440;
    let mut random = scene::Random::new(1);
    let storage = scene::Scene::block_storage(&mut random);
    let ranges = storage.scan([4.0, 0.1, 0.05], BEAMS, -PI, 0.01, &mut random);
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: -PI,
        bearing_step: TAU / BEAMS as f64,
        ranges: &ranges,
        intensities: &[],
    };
    let mut points = Box::new(PointScan::<BEAMS>::new());
    points.set(&scan, RANGES.0, RANGES.1);
    for (name, parameters) in profiles() {
        let mut detector = Box::new(Detector::<BEAMS>::new(parameters));
        let mut keypoints = heapless::Vec::<Keypoint, KEYPOINTS>::new();
        criterion.bench_function(&format!("falko/storage 1440/{name}"), |bencher| {
            bencher.iter(|| detector.detect(black_box(&points), &mut keypoints));
        });
    }
}

criterion_group! { name = benches; config = agv_benches::briefly(); targets = fr079, storage }
criterion_main!(benches);
