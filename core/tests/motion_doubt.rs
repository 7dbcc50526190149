//! What one revolution makes of the level if it has lost sight of the landmarks before it.
#![allow(clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::Point;
use agv_core::localizer::{Mode, PoseOutput};
use agv_core::measurement::ReflectorObservation;

use super::support::stage::{BEAMS, Stage, parameters};

/// A standing vehicle that has seen so many reflectors of the map and the walls for a while.
fn standing(count: usize) -> Stage {
    let mut stage = Stage::told(parameters());
    let seen = &stage.view()[..count];
    for _ in 0..8 {
        revolve(&mut stage, seen, |_, range| range);
    }
    let said = stage.said();
    assert!(said.mode != Mode::Lost && said.level.position < 0.15, "{said:?}");
    stage
}

/// A revolution that sees these, and the walls with something done to each beam's range.
fn revolve(stage: &mut Stage, seen: &[ReflectorObservation], change: impl Fn(usize, f32) -> f32) -> PoseOutput {
    stage.drive(0.0, 0.0);
    let time = stage.time();
    let seen: Vec<_> = seen.iter().map(|observation| ReflectorObservation { time, ..*observation }).collect();
    stage.see(&seen);
    stage.scan_as(change)
}

#[test]
fn what_no_map_has_instead_of_what_was_seen_widens_the_level_at_once() {
    let mut stage = standing(5);
    let stranger = stage.observe(&Point::new(1.0, 1.5));
    let all = stage.view();
    let said = revolve(&mut stage, &[stranger], |_, range| range);
    assert!(said.mode != Mode::Lost && said.level.position > 1.5 && said.level.heading > 0.6, "{said:?}");
    // As long as no two of the map are seen.
    for few in [&all[..0], &all[..1]] {
        let said = revolve(&mut stage, few, |_, range| range);
        assert!(said.mode != Mode::Lost && said.level.position > 1.5, "{said:?}");
    }
    let said = revolve(&mut stage, &all[..2], |_, range| range);
    assert!(said.level.position < 0.15, "{said:?}");
}

#[test]
fn others_of_the_map_and_nothing_at_all_widen_no_level_where_the_walls_have_stayed() {
    for seen in [0..0, 5..7, 5..12] {
        let mut stage = standing(5);
        let others = &stage.view()[seen.clone()];
        let said = revolve(&mut stage, others, |_, range| range);
        assert!(said.mode != Mode::Lost && said.level.position < 0.15, "{seen:?}: {said:?}");
    }
}

/// A third of the walls is no motion by itself.
#[test]
fn what_is_hidden_by_walls_that_have_moved_widens_the_level_at_once() {
    let mut stage = standing(5);
    let all = stage.view();
    let bearing = |beam: usize| beam as f64 * TAU / BEAMS as f64 - PI;
    let is_hidden =
        |beam: usize| (f64::from(all[0].bearing) - 0.1..f64::from(all[4].bearing) + 0.1).contains(&bearing(beam));
    let hide = |beam: usize, range: f32| if is_hidden(beam) { range - 1.0 } else { range };
    let said = revolve(&mut stage, &[], hide);
    assert!(said.mode != Mode::Lost && said.level.position > 1.5, "{said:?}");
    // The same walls in front of what is still seen.
    let mut stage = standing(5);
    let said = revolve(&mut stage, &all[..5], hide);
    assert!(said.level.position < 0.15, "{said:?}");
}

/// Many may turn out of sight at once where an aisle ends: all that is seen instead is where the map has it.
#[test]
fn many_that_are_gone_are_no_motion_where_the_map_has_all_that_are_seen() {
    let mut stage = standing(8);
    let all = stage.view();
    let said = revolve(&mut stage, &all[8..12], |_, range| range);
    assert!(said.mode != Mode::Lost && said.level.position < 0.15, "{said:?}");
    // One of them is none of the map.
    let mut stage = standing(8);
    let stranger = stage.observe(&Point::new(1.0, 1.5));
    let said = revolve(&mut stage, &[all[8], all[9], stranger], |_, range| range);
    assert!(said.mode == Mode::Lost, "{said:?}");
}
