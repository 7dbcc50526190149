//! A vehicle is chosen from a list, and its measures are set one by one.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

mod support;

use agv_core::odometry::{Vehicle, WheelVehicle};
use agv_settings::leaf::{Leaf, LeafError, Value};
use agv_settings::store::Store;
use agv_settings::{LEAVES, Settings, VehicleKind, VehicleSettings, block_on, bus_load};
use support::{Flash, load};

fn set(settings: &mut Settings, name: &str, value: impl Into<f64>) {
    let (leaf, value) = (Leaf::named(name).unwrap(), value.into());
    let value = match leaf.value(settings) {
        Value::Number(_) => Value::Number(value),
        _ => Value::Whole(value as u64),
    };
    leaf.set(settings, value).unwrap();
}

fn of_kind(kind: VehicleKind) -> Settings {
    let mut settings = Settings::default();
    set(&mut settings, "vehicle.kind", kind as u8);
    settings
}

/// What the kind is in the odometry, and how many counters it has.
fn expected(kind: VehicleKind, vehicle: &Vehicle) -> Option<usize> {
    Some(match (kind, vehicle) {
        (VehicleKind::Tricycle, Vehicle::Tricycle(_)) => 2,
        (VehicleKind::TricycleSpeed, Vehicle::TricycleSpeed(_))
        | (VehicleKind::CarSpeed, Vehicle::Ackermann(_))
        | (VehicleKind::Increments, Vehicle::Increments) => 0,
        (VehicleKind::Differential, Vehicle::Wheels(WheelVehicle::Differential(_))) => 2,
        (VehicleKind::Ackermann, Vehicle::Wheels(WheelVehicle::Ackermann(_)))
        | (VehicleKind::Omni3, Vehicle::Wheels(WheelVehicle::ThreeOmnidirectional(_))) => 3,
        (VehicleKind::BiSteerable, Vehicle::Wheels(WheelVehicle::BiSteerable(_)))
        | (VehicleKind::Omni4, Vehicle::Wheels(WheelVehicle::FourOmnidirectional(_)))
        | (VehicleKind::Mecanum, Vehicle::Wheels(WheelVehicle::Mecanum(_))) => 4,
        _ => return None,
    })
}

#[test]
fn each_kind_is_sound_as_it_is_chosen_and_has_its_counters() {
    for (number, kind) in (0..).zip(VehicleKind::ALL) {
        assert_eq!(VehicleKind::of_number(number), Some(kind));
        let settings = of_kind(kind);
        assert_eq!(settings.check(), Ok(()), "{kind:?}");
        let vehicle = settings.parameters.vehicle;
        let counters = vehicle.counters();
        assert_eq!(Some(counters.len()), expected(kind, &vehicle), "{kind:?}");
        let nodes = LEAVES.iter().filter(|leaf| {
            leaf.name.starts_with("can.") && leaf.name.ends_with("_node") && leaf.name != "can.controller_node"
        });
        assert_eq!(nodes.filter(|leaf| leaf.matters(&settings)).count(), counters.len(), "{kind:?}");
        assert_eq!(VehicleSettings::of(&vehicle).vehicle(), vehicle, "{kind:?}");
    }
    assert_eq!(VehicleKind::of_number(VehicleKind::ALL.len() as u8), None);
}

/// Every leaf of the room `vehicle` that matters changes the vehicle, and no other does.
#[test]
fn the_measures_that_matter_are_those_that_count() {
    for kind in VehicleKind::ALL {
        let before = of_kind(kind);
        for leaf in LEAVES.iter().filter(|leaf| leaf.name.starts_with("vehicle.") && leaf.name != "vehicle.kind") {
            let mut after = before.clone();
            let (_, most) = leaf.bounds;
            set(&mut after, leaf.name, 0.3 * most);
            let has_changed = after.parameters.vehicle != before.parameters.vehicle;
            assert_eq!(has_changed, leaf.matters(&before), "{kind:?}: {}", leaf.name);
            assert_eq!(leaf.get(&before).is_some(), has_changed, "{kind:?}: {}", leaf.name);
        }
    }
}

#[test]
fn kind_and_measures_come_in_any_order() {
    let choices = [("vehicle.kind", 3.0), ("vehicle.track", 0.61), ("vehicle.wheel_2_scale", -2.5e-5)];
    let mut settings = Settings::default();
    choices.iter().for_each(|(name, value)| set(&mut settings, name, *value));
    let mut other = Settings::default();
    choices.iter().rev().for_each(|(name, value)| set(&mut other, name, *value));
    assert_eq!(settings, other);
    let Vehicle::Wheels(WheelVehicle::Differential(vehicle)) = settings.parameters.vehicle else {
        panic!("its wheels")
    };
    assert_eq!(vehicle.track, 0.61);
    assert_eq!(vehicle.right.radius * vehicle.right.turn.scale, -2.5e-5);
}

#[test]
fn a_vehicle_of_any_kind_is_stored_and_read() {
    for kind in VehicleKind::ALL {
        let mut settings = of_kind(kind);
        set(&mut settings, "vehicle.track", 0.7);
        set(&mut settings, "vehicle.wheel_1_scale", 3e-5);
        set(&mut settings, "can.third_node", 77);
        let mut store = Store::new(Flash::<{ 128 * 1024 }>::new()).unwrap();
        block_on(store.store_leaves(&settings)).unwrap();
        let (found, _, loaded) = load(&mut store);
        assert_eq!((found, loaded.contradiction), (settings, None), "{kind:?}");
    }
}

/// A kind, settings, and the leaf that does not go with the others.
type Case<'a> = (VehicleKind, &'a [(&'a str, f64)], Option<&'a str>);

#[test]
fn a_contradiction_is_named() {
    use VehicleKind::{Ackermann, BiSteerable, Differential, Increments, Mecanum, Omni3, TricycleSpeed};
    let cases: [Case; 14] = [
        (Differential, &[("vehicle.wheel_2_scale", 0.0)], Some("vehicle.wheel_2_scale")),
        // It has no third wheel.
        (Differential, &[("vehicle.wheel_3_scale", 0.0)], None),
        (Omni3, &[("vehicle.wheel_3_scale", 0.0)], Some("vehicle.wheel_3_scale")),
        (BiSteerable, &[("vehicle.wheel_2_steering_scale", 0.0)], Some("vehicle.wheel_2_steering_scale")),
        (BiSteerable, &[("vehicle.wheel_2_x", 0.75)], Some("vehicle.wheel_2_x")),
        (Ackermann, &[("vehicle.steering_scale", 0.0)], Some("vehicle.steering_scale")),
        (Mecanum, &[("can.fourth_node", 2.0)], Some("can.fourth_node")),
        (Omni3, &[("can.fourth_node", 2.0)], None),
        (Omni3, &[("can.third_node", 16.0)], Some("can.third_node")),
        (Omni3, &[("can.third_profile", 405.0)], Some("can.third_profile")),
        (TricycleSpeed, &[("can.angle_identifier", 2048.0)], Some("can.angle_identifier")),
        (TricycleSpeed, &[("can.speed_first_byte", 5.0), ("can.speed_length", 4.0)], Some("can.speed_first_byte")),
        (TricycleSpeed, &[("can.speed_unit", 0.0)], Some("can.speed_unit")),
        (Increments, &[("can.increment_first_byte", 3.0)], Some("can.increment_first_byte")),
    ];
    for (kind, changes, leaf) in cases {
        let mut settings = of_kind(kind);
        changes.iter().for_each(|(name, value)| set(&mut settings, name, *value));
        assert_eq!(settings.check().err().map(|contradiction| contradiction.leaf), leaf, "{kind:?} {changes:?}");
        // Out of flash they come sound.
        let mut store = Store::new(Flash::<{ 128 * 1024 }>::new()).unwrap();
        block_on(store.store_leaves(&settings)).unwrap();
        let (found, _, loaded) = load(&mut store);
        assert_eq!((loaded.contradiction, found.check()), (leaf, Ok(())), "{kind:?} {changes:?}");
    }
}

#[test]
fn a_change_that_another_setting_forbids_names_that() {
    let mut settings = Settings::default();
    set(&mut settings, "can.controller_node", 3);
    let before = settings.clone();
    let kind = Leaf::named("vehicle.kind").unwrap();
    let third = Leaf::named("can.third_node").unwrap();
    let mecanum = Value::Whole(VehicleKind::Mecanum as u64);
    assert_eq!(kind.change(&mut settings, mecanum), Err(LeafError::Other(third.key)));
    assert_eq!(settings, before);
    assert_eq!(third.change(&mut settings, Value::Whole(33)), Ok(()));
    assert_eq!(kind.change(&mut settings, mecanum), Ok(()));
    assert_eq!(kind.change(&mut settings, Value::Whole(10)), Err(LeafError::Bounds));
}

/// Longest frames as in Davis et al. 2007: 135 bits with 8 bytes, 95 with 4, 65 with 1.
#[test]
fn more_counters_take_more_of_the_bus() {
    let expected = |counters: f64| {
        let poses = 5.0 * 135.0 / 0.01;
        let heartbeats = (1.0 + counters) * 65.0 / 0.1;
        let counted = if counters > 0.0 { counters * 95.0 / 0.01 } else { 2.0 * 135.0 / 0.01 };
        (poses + heartbeats + counted + 135.0 / 0.1) / 500_000.0
    };
    for (kind, counters) in [
        (VehicleKind::Tricycle, 2.0),
        (VehicleKind::Omni3, 3.0),
        (VehicleKind::Mecanum, 4.0),
        (VehicleKind::TricycleSpeed, 0.0),
    ] {
        let found = bus_load(&of_kind(kind));
        assert!((found - expected(counters)).abs() < 1e-12, "{kind:?}: {found}");
    }
}
