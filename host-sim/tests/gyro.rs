//! The emulated gyro tells what a vehicle that stands would hear of it, before the drive and behind it.

use std::path::Path;

use agv_core::localizer::Event;
use agv_core::measurement::Time;
use agv_host_sim::emulate::gyro::EmulatedGyro;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_wire::can::gyro::{Gyro, GyroFrame};

/// When the vehicle drives off, and when it has stood for some seconds behind its drive, ms.
const BEGIN: u64 = 5_000;

#[test]
fn a_gyro_tells_bias_and_noise_of_a_vehicle_that_stands() {
    let mut scenario = Scenario::read(Path::new("block_storage_p2")).unwrap();
    scenario.laser.scans = false;
    scenario.gyro.fitted = true;
    // A scale that is right, and no walk: what is told at rest is bias and noise alone.
    (scenario.gyro.scale_error, scenario.gyro.drift_deg_h) = (0.0, 0.0);
    let recording = simulate(&scenario).unwrap().recording;
    let recorded: Vec<(Time, f64)> = recording
        .events
        .iter()
        .filter_map(|event| match event.view() {
            Event::Gyro(sample) => Some((sample.time, sample.rate)),
            _ => None,
        })
        .collect();
    let (first, last) = (recorded.first().unwrap().0, recorded.last().unwrap().0);
    // Over the whole drive: what was told less what was turned.
    let (from, until) = (recording.truth.first().unwrap().pose.theta, recording.truth.last().unwrap().pose.theta);
    let told: f64 = recorded.iter().map(|(_, rate)| rate * 0.01).sum();
    let turns = ((told - until + from) / std::f64::consts::TAU).round() * std::f64::consts::TAU;
    let bias = (told - (until - from) - turns) / (0.01 * recorded.len() as f64);
    let noise = scenario.gyro.noise_deg.to_radians();

    let frame = GyroFrame::USUAL;
    let mut emulated = EmulatedGyro::of(&recording, &frame).unwrap();
    let gyro = Gyro::new(&frame);
    let end = BEGIN + (last.since(first) * 1e3) as u64 + 1_000;
    let (mut before, mut behind, mut driving) = (Vec::new(), Vec::new(), Vec::new());
    for millisecond in 1..end + 4_000 {
        let now = Time::from_micros(millisecond * 1_000);
        if millisecond == BEGIN {
            emulated.begin(now);
        }
        for told in emulated.poll(now) {
            let rate = gyro.handle(&told, now).unwrap().rate;
            let part = if millisecond < BEGIN {
                &mut before
            } else if millisecond > end {
                &mut behind
            } else {
                &mut driving
            };
            part.push(rate);
        }
    }
    for (part, seconds) in [(&before, 5.0), (&behind, 4.0)] {
        let count = part.len() as f64;
        assert!((count - 100.0 * seconds).abs() <= 2.0, "{count} readings in {seconds} s");
        let mean = part.iter().sum::<f64>() / count;
        let spread = (part.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>() / count).sqrt();
        assert!((mean - bias).abs() < 4.0 * noise / count.sqrt(), "{mean} rad/s told of a bias of {bias}");
        assert!((0.8 * noise..1.2 * noise).contains(&spread), "a spread of {spread} rad/s, {noise} stated");
    }
    assert!(driving.len().abs_diff(recorded.len()) <= 100, "{} of {} readings", driving.len(), recorded.len());
}
