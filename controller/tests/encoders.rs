//! What the encoders are expected to be.

use agv_controller::{EncoderNodes, channels};
use agv_core::localizer::Parameters;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_settings::Settings;
use agv_settings::leaf::{Leaf, LeafError, Value};

#[test]
fn rates_at_which_the_filter_forgets_too_early_are_refused() {
    let leaf = Leaf::named("can.encoder_period").unwrap();
    let mut settings = Settings::default();
    // 1000 and 20 times a second.
    for period in [1, 50] {
        assert_eq!(leaf.set(&mut settings, Value::Whole(period)), Ok(()));
    }
    for period in [0, 51, 100] {
        assert_eq!(leaf.set(&mut settings, Value::Whole(period)), Err(LeafError::Bounds));
    }
    assert_eq!(settings.encoder_period, 50);
}

#[test]
fn the_encoders_are_held_to_the_ranges_that_the_odometry_wraps_by() {
    let default = Settings::default().parameters;
    let Vehicle::Tricycle(tricycle) = default.vehicle else { panic!("the default is a tricycle") };
    let (drive_range, steering_range) = (CounterRange::BITS_24, CounterRange::new(1 << 13).unwrap());
    let of = |vehicle| Settings::of(Parameters { vehicle, ..default });
    let settings = of(Vehicle::Tricycle(Tricycle { drive_range, steering_range, ..tricycle }));
    let ranges = |settings: &Settings| -> Vec<Option<CounterRange>> {
        let channels = channels(&EncoderNodes::of(settings), &settings.parameters);
        channels.iter().map(|channel| channel.encoder.range).collect()
    };
    assert_eq!(ranges(&settings), [Some(drive_range), Some(steering_range)]);
    // Another vehicle has no counters of its own.
    assert_eq!(ranges(&of(Vehicle::Increments)), [None, None]);
}
