//! Whole drives: the demonstration replayed, and a minute in a hall through the controller.
//!
//! Throughput is milliseconds of the drive, so its thousands a second are how many times faster than real time it goes.

use std::hint::black_box;
use std::time::{Duration, Instant};

use agv_core::localizer::MapUse;
use agv_host_sim::mapping::{Clustering, map_features};
use agv_host_sim::recording::Recording;
use agv_host_sim::replay::replay;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_lab::campaign::rig::RigOptions;
use agv_lab::campaign::tape::Tape;
use agv_lab::evaluate::demonstration;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const HALL: &str = include_str!("../../host-sim/scenarios/warehouse_hall.toml");
/// How long the hall is driven through, s.
const SECONDS: u32 = 60;

fn demonstration_drive(criterion: &mut Criterion) {
    let drives = demonstration::run(|_| ()).expect("the demonstration can be made");
    let recording = &drives.last().expect("it has a drive with everything").recording;
    let times = || recording.events.iter().filter_map(|event| event.view().time());
    let (first, last) = (times().min().expect("events"), times().max().expect("events"));
    let mut group = criterion.benchmark_group("drives");
    group.sample_size(20).throughput(Throughput::Elements((1e3 * last.since(first)) as u64));
    group.bench_function("demonstration, replayed", |bencher| {
        bencher.iter(|| replay(black_box(recording), |_| ()).map(|replay| replay.poses.len()));
    });
    group.finish();
}

/// The drive round the hall, with a map of its features that another drive has made.
fn hall() -> Recording {
    let scenario = Scenario::parse(HALL).expect("the scenario is good");
    let simulated = |seed| simulate(&Scenario { seed, ..scenario.clone() }).expect("it can be simulated").recording;
    let (mut recording, mapping) = (simulated(scenario.seed), simulated(scenario.seed + 1));
    recording.landmarks.extend(map_features(&mapping, &Clustering::default()).expect("it can be mapped"));
    recording.parameters.maps = MapUse { reflectors: true, features: true, dynamic: false, slam: false };
    recording
}

fn controller(criterion: &mut Criterion) {
    let recording = hall();
    let options = RigOptions::told(f64::from(SECONDS), 1, None);
    let tape = Tape::record(&recording, &options).expect("the controller drives");
    let mode = tape.play(&recording).expect("the map fits").output().map(|output| output.mode);
    let rig = best(|| drop(Tape::record(&recording, &options)));
    let alone = best(|| drop(tape.play(&recording)));
    eprintln!(
        "an hour of the hall, s: {:.1} for the controller, {:.1} more for emulated sensors and lines; ended {mode:?}",
        hour(alone),
        hour(rig.saturating_sub(alone)),
    );
    let mut group = criterion.benchmark_group("drives");
    group.sample_size(10).throughput(Throughput::Elements(1000 * u64::from(SECONDS)));
    group.bench_function("a minute through the controller", |bencher| {
        bencher.iter(|| tape.play(black_box(&recording)).map(|controller| controller.output()));
    });
    group.finish();
}

/// Shortest of three times.
fn best(mut work: impl FnMut()) -> Duration {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed()
    };
    (0..3).map(time).min().unwrap_or_default()
}

/// What a drive's time comes to in an hour, s.
fn hour(time: Duration) -> f64 {
    time.as_secs_f64() * 3600.0 / f64::from(SECONDS)
}

criterion_group! { name = benches; config = agv_benches::briefly(); targets = demonstration_drive, controller }
criterion_main!(benches);
