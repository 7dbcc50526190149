//! The simulated gyro against the truth that it has not seen.

use agv_core::geometry::difference;
use agv_core::measurement::GyroSample;
use agv_host_sim::recording::{RecordedEvent, Recording, truth_at};
use agv_host_sim::simulate::START;
use agv_host_sim::simulate::block_storage::BlockStoragePath;
use agv_host_sim::simulate::scenario::{GyroFault, GyroOptions, Scenario};
use agv_host_sim::simulate::simulate;

fn drive(gyro: GyroOptions, seed: u64) -> Recording {
    let mut scenario = Scenario::block_storage(BlockStoragePath::P2, seed);
    scenario.laser.scans = false;
    scenario.gyro = gyro;
    simulate(&scenario).unwrap().recording
}

fn samples(recording: &Recording) -> Vec<GyroSample> {
    let of = |event: &RecordedEvent| match event {
        RecordedEvent::Gyro(sample) => Some(*sample),
        _ => None,
    };
    recording.events.iter().filter_map(of).collect()
}

const FITTED: GyroOptions = GyroOptions {
    fitted: true,
    rate: 100.0,
    noise_deg: 0.0,
    bias_deg: 0.0,
    drift_deg_h: 0.0,
    scale_error: 0.0,
    latency: 0.004,
    range_deg: 250.0,
    step_deg: 0.0,
    faults: Vec::new(),
};

#[test]
fn a_perfect_gyro_integrates_to_the_true_heading() {
    let recording = drive(FITTED, 3);
    let (mut heading, mut compared) = (recording.truth.first().unwrap().pose.theta, 0);
    for sample in samples(&recording) {
        heading += 0.01 * sample.rate;
        let Some(truth) = truth_at(&recording.truth, sample.time.offset(-0.004)) else { continue };
        assert!(difference(heading, truth.theta).abs() < 1e-9, "{heading} {truth:?}");
        compared += 1;
    }
    assert!(compared > 1000);
    // Heard at the end of each reading, the rate is that of its middle.
    let believed = recording.parameters.gyro;
    assert!(believed.is_fitted && (believed.latency - 0.009).abs() < 1e-12);
    assert!(drive(GyroOptions::default(), 3).events.iter().all(|event| !matches!(event, RecordedEvent::Gyro(_))));
}

#[test]
fn noise_and_bias_have_the_stated_size() {
    let (mut squares, mut differences, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..200 {
        let recording = drive(GyroOptions { noise_deg: 0.05, bias_deg: 0.2, ..FITTED }, seed);
        // The vehicle stands in the first second.
        let still: Vec<f64> = samples(&recording)
            .iter()
            .take_while(|sample| sample.time.since(START) < 0.95)
            .map(|sample| sample.rate.to_degrees())
            .collect();
        let mean = still.iter().sum::<f64>() / still.len() as f64;
        squares += mean * mean;
        differences += still.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>();
        count += (still.len() - 1) as f64;
    }
    let bias = (squares / 200.0).sqrt();
    let noise = (differences / count / 2.0).sqrt();
    assert!((bias / 0.2 - 1.0).abs() < 0.2, "{bias}");
    assert!((noise / 0.05 - 1.0).abs() < 0.02, "{noise}");
}

#[test]
fn faults_are_those_that_were_asked_for() {
    let fault = |from: f64| GyroFault { from, lasts: 0.5, ..GyroFault::default() };
    let faults = vec![
        GyroFault { frozen: true, ..fault(2.0) },
        GyroFault { silent: true, ..fault(3.0) },
        GyroFault { jump_deg: 3.0, ..fault(4.0) },
    ];
    let (sound, spoilt) = (drive(FITTED, 5), drive(GyroOptions { faults, ..FITTED }, 5));
    let (sound, spoilt) = (samples(&sound), samples(&spoilt));
    assert_eq!(spoilt.len() + 50, sound.len());
    let mut told: Vec<f64> = Vec::new();
    for sample in &spoilt {
        // To the millisecond: a fault begins with a reading.
        let time = 1e-3 * ((sample.time.since(START) - 0.004) * 1e3).round();
        let right = sound.iter().find(|sound| sound.time == sample.time).unwrap().rate;
        assert!(!(3.0..3.5).contains(&time));
        if (2.0..2.5).contains(&time) {
            told.push(sample.rate);
        } else {
            let jump = if (4.0..4.5).contains(&time) { 3.0_f64.to_radians() } else { 0.0 };
            assert!((sample.rate - right - jump).abs() < 1e-12, "{time}");
        }
    }
    assert!(told.len() > 40 && told.windows(2).all(|pair| pair[0].total_cmp(&pair[1]).is_eq()));
    let clipped = drive(GyroOptions { range_deg: 1.0, ..FITTED }, 5);
    assert!(samples(&clipped).iter().all(|sample| sample.rate.to_degrees().abs() <= 1.0 + 1e-12));
}
