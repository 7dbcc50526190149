//! A wheel that slips by a fifth is told within 0.3 m where redundant wheels, a gyro or reflectors show it.

use agv_lab::equipment::VehicleKind;
use agv_lab::evaluate::gyro::{ShownBy, Way, slip_row};

const LONGEST: f64 = 0.3;

#[test]
fn a_slip_is_told_where_redundant_wheels_a_gyro_or_reflectors_show_it() {
    use ShownBy::{Gyro, Nothing, Reflectors};
    use VehicleKind::{BiSteerable, Differential, Omni4, Tricycle};
    use Way::{Curve, Straight};
    let mut beyond = 0;
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
        // Reflectors, which are all that shows it of these.
        (Tricycle, Straight, Reflectors),
        (Tricycle, Curve, Reflectors),
        (Differential, Straight, Reflectors),
        (Differential, Curve, Reflectors),
    ] {
        let row = slip_row(vehicle, way, shown_by, 1..4, || ()).unwrap();
        println!("{row:?}");
        assert_eq!(row.told, row.drives, "{row:?}");
        assert!(row.longest_m > 0.0 && row.longest_m <= LONGEST, "{row:?}");
        beyond += row.beyond_level;
    }
    // A tricycle whose wheel slips in a bend is beyond its level by a tenth for two outputs, before the next revolution shows it.
    assert!(beyond <= 1, "{beyond}");
}

/// On a line nothing shows that a tricycle's only wheel slips: the protection level carries it.
#[test]
fn what_nothing_shows_the_protection_level_carries() {
    let row = slip_row(VehicleKind::Tricycle, Way::Straight, ShownBy::Gyro, 1..4, || ()).unwrap();
    assert_eq!((row.told, row.beyond_level), (0, 0), "{row:?}");
}
