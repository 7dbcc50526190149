//! A controller that is given what another one was given ends where that one ended.

use agv_core::state::Mode;
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::simulate;
use agv_lab::campaign::rig::{RigOptions, drive};
use agv_lab::campaign::tape::Tape;

const HALL: &str = include_str!("../../host-sim/scenarios/warehouse_hall.toml");

#[test]
fn a_tape_leads_another_controller_to_the_same_pose() {
    let recording = simulate(&Scenario::parse(HALL).unwrap()).unwrap().recording;
    let options = RigOptions::told(10.0, 1, None);
    let mut last = None;
    drive(&recording, &[], &options, |heard| last = heard.output.copied()).unwrap();
    let output = Tape::record(&recording, &options).unwrap().play(&recording).unwrap().output();
    let (expected, found) = (last.expect("a pose was published"), output.expect("a pose was published"));
    assert_eq!(expected, found);
    assert_eq!(expected.mode, Mode::Reflectors);
}
