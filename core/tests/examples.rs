//! The examples do what they say.

#[path = "../examples/falko.rs"]
mod falko;
#[path = "../examples/localise.rs"]
mod localise;
#[path = "../examples/own_source.rs"]
mod own_source;
#[path = "../examples/own_vehicle.rs"]
mod own_vehicle;

#[test]
fn a_recorded_tricycle_is_localised() {
    localise::main();
}

#[test]
fn keypoints_are_found_in_a_scan() {
    falko::main();
}

#[test]
fn a_source_of_ones_own_corrects_the_pose() {
    own_source::main();
}

#[test]
fn a_vehicle_of_ones_own_is_localised() {
    own_vehicle::main();
}
