//! The examples do what they say.

#[path = "../examples/falko.rs"]
mod falko;
#[path = "../examples/localise.rs"]
mod localise;

#[test]
fn a_recorded_tricycle_is_localised() {
    localise::main();
}

#[test]
fn keypoints_are_found_in_a_scan() {
    falko::main();
}
