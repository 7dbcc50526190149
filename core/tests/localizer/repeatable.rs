//! The same in every run and beside the predictor, in the memory that there is.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Localizer, Mode, OutputPredictor, Reason, SlamCapacities, VehicleWithContours};
use agv_core::measurement::{EncoderFault, EncoderFaults, EncoderSample, Time};

use super::drive::{Drive, TICK, parameters};

#[test]
fn the_predictor_says_at_once_what_the_localiser_will_say() {
    let mut drive = Drive::start();
    let mut predictor: OutputPredictor = OutputPredictor::new(&parameters());
    let sample = |step: u64| EncoderSample {
        time: Time::from_micros(1_000_000 + step * 10_000),
        drive: (step as f64 * 0.01 / TICK).round() as u32,
        steering: (step % 7) as u32,
    };
    assert_eq!(predictor.output(), None);
    drive.localizer.handle(&Event::Encoders(sample(0)));
    predictor.encoders(&sample(0));
    drive.set_pose(Pose::new(0.1, -0.2, 0.3));
    predictor.update(&drive.localizer.outputs().pose, &drive.localizer.prediction_state());
    let mut pending = Vec::new();
    for step in 1..200 {
        predictor.encoders(&sample(step));
        pending.push(sample(step));
        let said = predictor.output().unwrap();
        // A localiser that is never busy.
        let mut quick = drive.localizer.clone();
        for sample in &pending {
            quick.handle(&Event::Encoders(*sample));
        }
        let expected = quick.outputs().pose;
        assert_eq!(said.pose, expected.pose, "{step}");
        assert_eq!((said.time, said.covariance), (expected.time, expected.covariance));
        assert!((said.dead_reckoning_distance - expected.dead_reckoning_distance).abs() < 1e-9);
        // The true one is behind by up to 13 samples.
        if step % 13 == 0 {
            for sample in pending.drain(..) {
                drive.localizer.handle(&Event::Encoders(sample));
            }
            predictor.update(&drive.localizer.outputs().pose, &drive.localizer.prediction_state());
        }
    }
    let faults = EncoderFaults { time: sample(200).time, drive: None, steering: Some(EncoderFault::Late) };
    predictor.doubt_encoders(&faults);
    let said = predictor.output().unwrap();
    assert_eq!((said.mode, said.reason), (Mode::WithoutOdometry, Reason::SteeringEncoder));
}

#[test]
fn the_same_events_give_the_same_bits() {
    let outputs = || {
        let mut drive = Drive::start();
        drive.set_pose(Pose::new(0.04, -0.03, 0.008));
        (0..10).map(|_| drive.revolutions(1, |id| id % 3 != 0)).collect::<Vec<_>>()
    };
    let (first, second) = (outputs(), outputs());
    for (a, b) in first.iter().zip(&second) {
        assert_eq!(a.pose.x.to_bits(), b.pose.x.to_bits());
        assert_eq!(a.covariance.map(f64::to_bits), b.covariance.map(f64::to_bits));
    }
}

#[test]
fn all_of_its_memory_fits_a_controller() {
    // What the STM32H743's largest RAM, 512 KiB, has for it.
    for size in [size_of::<Localizer<SlamCapacities>>(), size_of::<Localizer<VehicleWithContours>>()] {
        println!("{size} bytes");
        assert!(size <= 352 * 1024, "{size} bytes");
    }
}
