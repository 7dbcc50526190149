//! Faults of the hall that the vehicle drives in.

use agv_host_sim::simulate::random::Random;
use agv_host_sim::simulate::scenario::{ReflectorShape, Scenario, Shapes, WorldOptions};
use agv_host_sim::simulate::{Simulation, simulate};

use super::{Fault, FaultKind};
use crate::campaign::CampaignError;

/// Simulates the drive of `scenario` in the hall as the faults have it. The map is that of the hall without them.
///
/// # Errors
/// [`CampaignError::Hall`] if the hall is not one of shapes, and reflectors cannot be added to it; see there for others.
pub fn simulate_with(scenario: &Scenario, faults: &[&Fault], random: &mut Random) -> Result<Simulation, CampaignError> {
    let mut scenario = scenario.clone();
    let mut added = 0;
    for fault in faults {
        let FaultKind::ReflectorsStand { count } = fault.what else { continue };
        let WorldOptions::Shapes(shapes) = &mut scenario.world else { return Err(CampaignError::Hall) };
        add_reflectors(shapes, count, random);
        added += count as usize;
    }
    let mut simulation = simulate(&scenario)?;
    let landmarks = &mut simulation.recording.landmarks;
    // Those that were added stand last.
    landmarks.truncate(landmarks.len().saturating_sub(added));
    Ok(simulation)
}

/// Reflectors anywhere between the walls.
fn add_reflectors(shapes: &mut Shapes, count: u32, random: &mut Random) {
    let extent = |of: fn(&[f64; 4]) -> [f64; 2]| {
        let ends = shapes.walls.iter().flat_map(of);
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), end| (low.min(end), high.max(end)))
    };
    let (x, y) = (extent(|[a, _, b, _]| [*a, *b]), extent(|[_, a, _, b]| [*a, *b]));
    for _ in 0..count {
        shapes.reflectors.push(ReflectorShape {
            x: random.between(x.0, x.1),
            y: random.between(y.0, y.1),
            radius: 0.04,
            farthest: 30.0,
            facing_deg: None,
            half_width_deg: 60.0,
        });
    }
}
