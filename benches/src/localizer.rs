//! Time of the filter's steps and of a whole scan cycle.

use std::hint::black_box;

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localizer, Parameters, PoseFix};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{EncoderSample, ReflectorObservation, Reflectors, Time};
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_host_sim::recording::RecordedEvent;
use agv_lab::equipment::Equipment;
use agv_lab::evaluate::warehouse::{Method, PATHS, prepare};
use agv_lab::evaluate::warehouse_disturbance::Disturbance;
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};

fn parameters() -> Parameters {
    let vehicle = Vehicle::Tricycle(Tricycle {
        wheelbase: 1.5,
        drive_scale: 2.5e-4,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-4,
        steering_range: CounterRange::BITS_16,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    });
    Parameters::new(vehicle, Pose::new(0.9, 0.0, 0.0))
}

fn sample(step: u64) -> EncoderSample {
    EncoderSample { time: Time::from_micros(step * 10_000), drive: step as u32 * 32, steering: 100 }
}

/// A localiser among 1000 reflectors that has driven for half a second.
fn localizer() -> Box<Localizer> {
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(parameters()));
    let landmarks: Vec<_> = (0..1000_u16)
        .map(|id| Landmark {
            id,
            kind: LandmarkKind::Reflector,
            x: f64::from(id % 40) * 2.3,
            y: f64::from(id / 40) * 2.9 + f64::from(id % 3) * 0.4,
            deviation: 0.002,
        })
        .collect();
    localizer.add_landmarks(&landmarks).expect("a thousand reflectors fit");
    let fix =
        PoseFix { time: Time::default(), pose: Pose::default(), position_deviation: 0.02, heading_deviation: 0.01 };
    localizer.handle(&Event::SetPose(fix));
    for step in 0..50 {
        localizer.handle(&Event::Encoders(sample(step)));
    }
    localizer
}

fn steps(criterion: &mut Criterion) {
    let mut moving = localizer();
    let mut step = 50;
    criterion.bench_function("localizer/prediction", |bencher| {
        bencher.iter(|| {
            step += 1;
            moving.handle(&Event::Encoders(black_box(sample(step)))).pose.pose.x
        });
    });
    let ready = localizer();
    // Seen 2 cm from where the reflector at (2.3 m, 0.4 m) is expected.
    let pose = ready.outputs().pose.pose.compose(parameters().lasers.first());
    let seen = pose.inverse_transform(&nalgebra::Vector2::new(2.32, 0.4));
    let observation = ReflectorObservation {
        time: Time::from_micros(490_000),
        range: seen.norm() as f32,
        bearing: seen.y.atan2(seen.x) as f32,
    };
    criterion.bench_function("localizer/one reflector among 1000", |bencher| {
        bencher.iter_batched_ref(
            || ready.clone(),
            |localizer| {
                let one = [black_box(observation)];
                let event = Event::Reflectors(Reflectors::of_first(&one));
                localizer.handle(&event).uses.len()
            },
            BatchSize::LargeInput,
        );
    });
}

fn scan_cycle(criterion: &mut Criterion) {
    let method = Method::ALL.iter().find(|method| method.name == "static").expect("there is a static map");
    let recording = prepare(PATHS[0].1, method, Disturbance::None, Equipment::default(), 1)
        .expect("the standard drive can be simulated")
        .recording;
    let mut localizer: Box<Localizer> = Box::new(Localizer::new(recording.parameters));
    localizer.add_landmarks(&recording.landmarks).expect("the map fits");
    // The middle of the drive: the vehicle moves, and the lane is on both sides.
    let middle = recording.events.len() / 2;
    let scan = (middle..).find(|&index| matches!(recording.events[index], RecordedEvent::Scan(_))).unwrap_or(middle);
    for event in &recording.events[..scan] {
        localizer.handle(&event.view());
    }
    let event = recording.events[scan].view();
    criterion.bench_function("localizer/scan cycle 1440", |bencher| {
        bencher.iter_batched_ref(
            || localizer.clone(),
            |localizer| localizer.handle(black_box(&event)).uses.len(),
            BatchSize::LargeInput,
        );
    });
}

criterion_group! { name = benches; config = agv_benches::briefly(); targets = steps, scan_cycle }
criterion_main!(benches);
