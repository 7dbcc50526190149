//! Which counters a vehicle reports.

use agv_core::measurement::{MOST_WHEELS, Time, WheelReading, WheelSample};
use agv_core::odometry::{
    Ackermann, AckermannWheels, AngleEncoder, BiSteerable, Counted, CounterRange, Differential, DrivenWheel,
    MOST_COUNTERS, Mecanum, Omnidirectional, SteeredWheel, Tricycle, TricycleSpeed, Vehicle, WheelVehicle,
};

const TURN: AngleEncoder = AngleEncoder { scale: 2e-3, range: CounterRange::BITS_24 };
const STEERING: AngleEncoder = AngleEncoder { scale: 1e-4, range: CounterRange::BITS_16 };
const DRIVEN: DrivenWheel = DrivenWheel { radius: 0.1, turn: TURN };
const AXLE: Differential = Differential { track: 0.5, left: DRIVEN, right: DRIVEN };
const STEERED: SteeredWheel = SteeredWheel { x: 0.5, y: 0.0, drive: DRIVEN, steering: STEERING, steering_offset: 0.0 };

fn list(vehicle: &Vehicle) -> Vec<(usize, Counted)> {
    vehicle.counters().iter().map(|counter| (counter.wheel, counter.counted)).collect()
}

#[test]
fn each_vehicle_has_its_counters_in_the_order_of_its_wheels() {
    use Counted::{Steering, Turn};
    let omni3 = Omnidirectional { arm: 0.3, first: 0.0, driven: [DRIVEN; 3] };
    let omni4 = Omnidirectional { arm: 0.3, first: 0.0, driven: [DRIVEN; 4] };
    let all = [(0, Turn), (1, Turn), (2, Turn), (3, Turn)];
    let cases: [(WheelVehicle, &[(usize, Counted)]); 6] = [
        (WheelVehicle::Differential(AXLE), &all[..2]),
        (
            WheelVehicle::BiSteerable(BiSteerable { front: STEERED, rear: STEERED }),
            &[(0, Turn), (0, Steering), (1, Turn), (1, Steering)],
        ),
        (
            WheelVehicle::Ackermann(AckermannWheels {
                rear: AXLE,
                wheelbase: 1.0,
                steering: STEERING,
                steering_offset: 0.0,
            }),
            &[(0, Turn), (1, Turn), (2, Steering)],
        ),
        (WheelVehicle::ThreeOmnidirectional(omni3), &all[..3]),
        (WheelVehicle::FourOmnidirectional(omni4), &all),
        (WheelVehicle::Mecanum(Mecanum { wheelbase: 0.5, track: 0.5, driven: [DRIVEN; 4] }), &all),
    ];
    for (vehicle, expected) in cases {
        let vehicle = Vehicle::Wheels(vehicle);
        assert_eq!(list(&vehicle), expected, "{vehicle:?}");
        for counter in vehicle.counters() {
            let (scale, range) = match counter.counted {
                Turn => (2e-4, TURN.range),
                Steering => (1e-4, STEERING.range),
            };
            assert!((counter.scale - scale).abs() < 1e-15 && counter.range == range, "{counter:?}");
        }
    }
    let tricycle = Tricycle {
        wheelbase: 1.5,
        drive_scale: -1e-4,
        drive_range: CounterRange::BITS_16,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_24,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    };
    let counters = Vehicle::Tricycle(tricycle).counters();
    let told: Vec<_> = counters.iter().map(|counter| (counter.counted, counter.scale, counter.range)).collect();
    assert_eq!(told, [(Turn, -1e-4, CounterRange::BITS_16), (Steering, 1e-3, CounterRange::BITS_24)]);
    let without = [
        Vehicle::Increments,
        Vehicle::Ackermann(Ackermann { wheelbase: 1.0, encoder_offset: 0.0 }),
        Vehicle::TricycleSpeed(TricycleSpeed { wheelbase: 1.0, steering_offset: 0.0 }),
    ];
    assert!(without.iter().all(|vehicle| vehicle.counters().is_empty()));
}

#[test]
fn a_sample_holds_each_counter_at_a_place_of_its_own() {
    let vehicle = Vehicle::Wheels(WheelVehicle::BiSteerable(BiSteerable { front: STEERED, rear: STEERED }));
    let mut sample = WheelSample { time: Time::from_micros(0), wheels: [WheelReading::default(); MOST_WHEELS] };
    let counts = [11, 22, 33, 44];
    let counters = vehicle.counters();
    assert_eq!(counters.len(), MOST_COUNTERS);
    counters.iter().zip(counts).for_each(|(counter, count)| sample.set_count(counter, count));
    let [front, rear, ..] = sample.wheels;
    assert_eq!((front.count, front.steering, rear.count, rear.steering), (11, 22, 33, 44));
    assert!(counters.iter().zip(counts).all(|(counter, count)| sample.count(counter) == count));
}
