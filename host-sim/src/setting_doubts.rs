//! Values of settings that are possible, and that hardly a vehicle has: in most cases a unit was mistaken.

use std::f64::consts::FRAC_PI_4;

/// Angles within so much of a multiple of 45 degrees are meant so, rad.
const NEAR_STRAIGHT: f64 = 0.09;
/// Angles below this are small adjustments, rad.
const ADJUSTMENT: f64 = 0.35;

/// A question about a value, if there is one.
#[must_use]
pub fn doubt(name: &str, value: f64) -> Option<String> {
    match name {
        "vehicle.wheelbase" if !(0.3..=6.0).contains(&value) => {
            Some(format!("{name} is {value} m; vehicles have 0.3 to 6 m. Is it in metres?"))
        }
        "vehicle.track" | "vehicle.arm" if !(0.1..=4.0).contains(&value) => {
            Some(format!("{name} is {value} m; vehicles have 0.1 to 4 m. Is it in metres?"))
        }
        "vehicle.drive_scale"
        | "vehicle.wheel_1_scale"
        | "vehicle.wheel_2_scale"
        | "vehicle.wheel_3_scale"
        | "vehicle.wheel_4_scale"
            if !(1e-7..=1e-2).contains(&value.abs()) =>
        {
            Some(format!("{name} is {value} m for one tick; usual are 0.1 um to 10 mm. Is it in metres?"))
        }
        "laser.x" | "laser.y" if value.abs() > 6.0 => Some(format!("{name} is {value} m. Is it in metres?")),
        "laser.theta"
        | "vehicle.steering_offset_forward"
        | "vehicle.steering_offset_backward"
        | "vehicle.wheel_1_steering_offset"
        | "vehicle.wheel_2_steering_offset" => angle(name, value),
        _ => None,
    }
}

fn angle(name: &str, value: f64) -> Option<String> {
    let from_straight = (value / FRAC_PI_4 - (value / FRAC_PI_4).round()).abs() * FRAC_PI_4;
    if value.abs() <= ADJUSTMENT || from_straight <= NEAR_STRAIGHT {
        return None;
    }
    let (degrees, radians) = (value.to_degrees(), value.to_radians());
    Some(format!(
        "{name} is {value} rad, which is {degrees:.1} deg; {value} deg would be {radians:.4} rad. Is it in radians?"
    ))
}

#[cfg(test)]
mod tests {
    use super::doubt;

    #[test]
    fn what_hardly_a_vehicle_has_is_asked_about() {
        for (name, value) in [
            ("vehicle.wheelbase", 30.0),
            ("vehicle.wheelbase", 0.15),
            ("laser.theta", 3.0),
            ("laser.theta", -2.0),
            ("laser.theta", 1.3),
            ("vehicle.steering_offset_forward", 0.5),
            ("vehicle.drive_scale", 0.25),
            ("laser.x", 9.0),
            ("vehicle.track", 612.0),
            ("vehicle.wheel_3_scale", 0.1),
            ("vehicle.wheel_2_steering_offset", 1.1),
        ] {
            assert!(doubt(name, value).is_some_and(|text| text.contains(name)), "{name} {value}");
        }
        for (name, value) in [
            ("vehicle.wheelbase", 1.5),
            ("laser.theta", std::f64::consts::PI),
            ("laser.theta", 0.785),
            ("laser.theta", -0.05),
            ("vehicle.drive_scale", -0.000_25),
            ("limits.fastest", 9.0),
        ] {
            assert_eq!(doubt(name, value), None, "{name} {value}");
        }
    }
}
