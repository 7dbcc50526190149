//! What a fit has found of the wheels, as a vehicle of the settings: its wheels are those that were fitted, and a file of it brings
//! them back.

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::odometry::{AngleEncoder, CounterRange, Vehicle, Wheel, WheelBased, WheelVehicle};
use agv_host_sim::calibrate::vehicle_file::VehicleFile;
use agv_host_sim::calibrate::wheeled::fitted_vehicle::{fitted_vehicle, has_setting};
use agv_host_sim::calibrate::wheeled::unknowns::{Kind, Unknown, WheeledModel};
use agv_host_sim::simulate::scenario::{MotionReport, Scenario, believed_parameters};

const KINDS: [(MotionReport, Kind); 6] = [
    (MotionReport::Differential, Kind::Differential),
    (MotionReport::BiSteerable, Kind::BiSteerable),
    (MotionReport::Ackermann, Kind::Ackermann),
    (MotionReport::ThreeOmnidirectional, Kind::Omnidirectional),
    (MotionReport::Omnidirectional, Kind::Omnidirectional),
    (MotionReport::Mecanum, Kind::Omnidirectional),
];

fn wheels_of(vehicle: &Vehicle) -> Vec<Wheel> {
    let Vehicle::Wheels(wheels) = vehicle else { panic!("{vehicle:?} has no wheels") };
    <WheelVehicle as WheelBased>::wheels(wheels).as_ref().to_vec()
}

/// What a wheel measures: way and angle of a tick, place, direction.
fn measures(wheel: &Wheel) -> [f64; 5] {
    let way = wheel.turn.map_or(0.0, |turn| wheel.radius * turn.scale);
    [way, wheel.steering.map_or(0.0, |steering| steering.scale), wheel.x, wheel.y, wheel.heading]
}

#[test]
fn a_fitted_vehicle_has_the_wheels_that_were_fitted() {
    for (reports, kind) in KINDS {
        let mut scenario = Scenario::default();
        scenario.vehicle.reports = reports;
        let parameters: Parameters = believed_parameters(&scenario);
        let believed = wheels_of(&parameters.vehicle);
        let ratio = |wheel: &Wheel| {
            let steering = wheel.steering.map(|_| AngleEncoder { scale: 1.0, range: CounterRange::BITS_32 });
            Wheel { steering, ..*wheel }
        };
        let nominal = WheeledModel { wheels: believed.iter().map(ratio).collect(), sensor: Pose::default() };
        let unknowns: Vec<Unknown> =
            Unknown::of(kind, &nominal.wheels, false).into_iter().filter(has_setting).collect();
        // Each by another part of what was believed of it.
        let changes: Vec<f64> =
            unknowns.iter().zip(1..).map(|(unknown, number)| 0.02 * f64::from(number) * unknown.prior).collect();
        let found = nominal.changed(&unknowns, &changes);
        let fitted = fitted_vehicle(&parameters.vehicle, &found).unwrap();

        let wheels = wheels_of(&fitted);
        assert_ne!(wheels, believed, "{reports:?}");
        let expect = |wheels: &[Wheel]| {
            for ((wheel, found), before) in wheels.iter().zip(&found.wheels).zip(&believed) {
                let mut expected = *found;
                expected.steering = before
                    .steering
                    .map(|steering| AngleEncoder { scale: steering.scale * found.steering.unwrap().scale, ..steering });
                for (measure, expected) in measures(wheel).into_iter().zip(measures(&expected)) {
                    assert!((measure - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{reports:?}: {wheel:?}");
                }
            }
        };
        expect(&wheels);

        // What replay and a controller make of the file is the same vehicle.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("vehicle.toml");
        VehicleFile::of_vehicle(&Parameters { vehicle: fitted, ..parameters }).write(&path).unwrap();
        let file = VehicleFile::read(&path).unwrap();
        assert!(file.settings().count() >= 3, "{reports:?}");
        let mut brought = parameters;
        assert!(file.apply(&mut brought), "{reports:?}");
        expect(&wheels_of(&brought.vehicle));
        // Another kind of vehicle does not take it.
        let mut other = believed_parameters(&Scenario::default());
        assert!(!file.apply(&mut other), "{reports:?}");
    }
}
