//! The vehicle of the settings that a fit has found.

use agv_core::odometry::{
    Counted, Differential, DrivenWheel, Mecanum, Omnidirectional, SteeredWheel, Tricycle, Vehicle, Wheel, WheelVehicle,
};

use super::unknowns::{Moves, Unknown, WheeledModel};

/// Whether the settings of a vehicle have a place for what is unknown: the directions of single wheels and rollers are those of its kind.
#[must_use]
pub fn has_setting(unknown: &Unknown) -> bool {
    use agv_core::odometry::WheelParameter::{Heading, Roller};
    let Moves::Wheels(moves) = &unknown.moves else { return true };
    let is_direction = unknown.name.starts_with("direction");
    !moves.iter().any(|(_, parameter, _)| *parameter == Roller || (*parameter == Heading && is_direction))
}

/// The believed vehicle with what a fit has found of its wheels; none if it is of another kind.
#[must_use]
pub fn fitted_vehicle(believed: &Vehicle, found: &WheeledModel) -> Option<Vehicle> {
    match believed {
        Vehicle::Tricycle(believed) => fitted_tricycle(believed, found).map(Vehicle::Tricycle),
        Vehicle::Wheels(believed) => fitted_wheels(believed, found).map(Vehicle::Wheels),
        _ => None,
    }
}

fn fitted_tricycle(believed: &Tricycle, found: &WheeledModel) -> Option<Tricycle> {
    let found = found.wheels.first()?;
    let offset = found.heading - believed.steering_offset_forward;
    Some(Tricycle {
        wheelbase: found.x,
        drive_scale: believed.drive_scale * found.radius,
        steering_scale: believed.steering_scale * ratio(found),
        steering_offset_forward: found.heading,
        steering_offset_backward: believed.steering_offset_backward + offset,
        ..*believed
    })
}

fn fitted_wheels(believed: &WheelVehicle, found: &WheeledModel) -> Option<WheelVehicle> {
    let wheel = |number: usize| found.wheels.get(number);
    let driven = |number: usize, before: &DrivenWheel| Some(DrivenWheel { radius: wheel(number)?.radius, ..*before });
    let steered = |number: usize, before: &SteeredWheel| {
        let found = wheel(number)?;
        let mut steering = before.steering;
        steering.scale *= ratio(found);
        let drive = driven(number, &before.drive)?;
        Some(SteeredWheel { x: found.x, y: found.y, drive, steering, steering_offset: found.heading })
    };
    let axle = |before: &Differential| {
        Some(Differential {
            track: wheel(0)?.y - wheel(1)?.y,
            left: driven(0, &before.left)?,
            right: driven(1, &before.right)?,
        })
    };
    let arm = || wheel(0).map(|wheel| wheel.x.hypot(wheel.y));
    Some(match believed {
        WheelVehicle::Differential(before) => WheelVehicle::Differential(axle(before)?),
        WheelVehicle::BiSteerable(before) => {
            let (front, rear) = (steered(0, &before.front)?, steered(1, &before.rear)?);
            WheelVehicle::BiSteerable(agv_core::odometry::BiSteerable { front, rear })
        }
        WheelVehicle::Ackermann(before) => {
            let front = wheel(2)?;
            let mut after = *before;
            (after.rear, after.wheelbase, after.steering_offset) = (axle(&before.rear)?, front.x, front.heading);
            after.steering.scale *= ratio(front);
            WheelVehicle::Ackermann(after)
        }
        WheelVehicle::ThreeOmnidirectional(before) => WheelVehicle::ThreeOmnidirectional(Omnidirectional {
            arm: arm()?,
            driven: all(before.driven, found),
            ..*before
        }),
        WheelVehicle::FourOmnidirectional(before) => WheelVehicle::FourOmnidirectional(Omnidirectional {
            arm: arm()?,
            driven: all(before.driven, found),
            ..*before
        }),
        WheelVehicle::Mecanum(before) => {
            let first = wheel(0)?;
            WheelVehicle::Mecanum(Mecanum {
                wheelbase: 2.0 * first.x,
                track: 2.0 * first.y,
                driven: all(before.driven, found),
            })
        }
    })
}

/// True steering angle over the one that the believed encoder states.
fn ratio(wheel: &Wheel) -> f64 {
    wheel.steering.map_or(1.0, |steering| steering.scale)
}

fn all<const N: usize>(mut driven: [DrivenWheel; N], found: &WheeledModel) -> [DrivenWheel; N] {
    for (driven, wheel) in driven.iter_mut().zip(&found.wheels) {
        driven.radius = wheel.radius;
    }
    driven
}

/// Changes the scale of the counter of a wheel. False if the vehicle has none.
#[must_use]
pub fn with_counter_scale(vehicle: &mut Vehicle, wheel: usize, counted: Counted, change: impl Fn(f64) -> f64) -> bool {
    let scale = match vehicle {
        Vehicle::Tricycle(tricycle) => match counted {
            Counted::Turn => Some(&mut tricycle.drive_scale),
            Counted::Steering => Some(&mut tricycle.steering_scale),
        },
        Vehicle::Wheels(vehicle) => counter_scale(vehicle, wheel, counted),
        _ => None,
    };
    scale.map(|scale| *scale = change(*scale)).is_some()
}

fn counter_scale(vehicle: &mut WheelVehicle, wheel: usize, counted: Counted) -> Option<&mut f64> {
    let driven = match vehicle {
        WheelVehicle::Differential(axle) => [&mut axle.left, &mut axle.right].into_iter().nth(wheel),
        WheelVehicle::Ackermann(car) => match counted {
            Counted::Steering => return Some(&mut car.steering.scale),
            Counted::Turn => [&mut car.rear.left, &mut car.rear.right].into_iter().nth(wheel),
        },
        WheelVehicle::BiSteerable(vehicle) => {
            let steered = [&mut vehicle.front, &mut vehicle.rear].into_iter().nth(wheel)?;
            match counted {
                Counted::Steering => return Some(&mut steered.steering.scale),
                Counted::Turn => Some(&mut steered.drive),
            }
        }
        WheelVehicle::ThreeOmnidirectional(vehicle) => vehicle.driven.get_mut(wheel),
        WheelVehicle::FourOmnidirectional(vehicle) => vehicle.driven.get_mut(wheel),
        WheelVehicle::Mecanum(vehicle) => vehicle.driven.get_mut(wheel),
    };
    driven.filter(|_| counted == Counted::Turn).map(|driven| &mut driven.turn.scale)
}
