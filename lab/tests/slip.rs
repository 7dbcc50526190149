//! A wheel that slips by a fifth is told within 0.3 m where redundant wheels or a gyro show it.

use agv_lab::equipment::VehicleKind;
use agv_lab::evaluate::gyro::{ShownBy, Way, slip_row};

const LONGEST: f64 = 0.3;
/// Of a wheel on the inside of a curve, which goes half of the way of the vehicle.
const LONGEST_INSIDE: f64 = 0.45;

#[test]
fn a_slip_is_told_where_redundant_wheels_or_a_gyro_show_it() {
    use ShownBy::{Gyro, Nothing};
    use VehicleKind::{BiSteerable, Differential, Omni4, Tricycle};
    use Way::{Curve, Straight};
    for (vehicle, way, shown_by) in [
        // Redundant wheels, and nothing else.
        (BiSteerable, Straight, Nothing),
        (BiSteerable, Curve, Nothing),
        (Omni4, Straight, Nothing),
        (Omni4, Curve, Nothing),
        // A gyro.
        (Tricycle, Curve, Gyro),
        (Differential, Straight, Gyro),
        (Differential, Curve, Gyro),
        (BiSteerable, Straight, Gyro),
        (Omni4, Curve, Gyro),
    ] {
        let row = slip_row(vehicle, way, shown_by, 1..4, || ()).unwrap();
        println!("{row:?}");
        assert_eq!(row.told, row.drives, "{row:?}");
        let longest = if (vehicle, way) == (Omni4, Curve) { LONGEST_INSIDE } else { LONGEST };
        assert!(row.longest_m > 0.0 && row.longest_m <= longest, "{row:?}");
        assert_eq!(row.beyond_level, 0, "{row:?}");
    }
}

/// On a line nothing shows that a tricycle's only wheel slips: the protection level carries it.
#[test]
fn what_nothing_shows_the_protection_level_carries() {
    let row = slip_row(VehicleKind::Tricycle, Way::Straight, ShownBy::Gyro, 1..4, || ()).unwrap();
    assert_eq!((row.told, row.beyond_level), (0, 0), "{row:?}");
}
