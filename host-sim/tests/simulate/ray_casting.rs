use std::f64::consts::{FRAC_PI_2, PI, TAU};

use agv_core::geometry::{Point, Pose};
use agv_host_sim::simulate::raycast::RayCaster;
use agv_host_sim::simulate::shape::{Circle, Rectangle};
use agv_host_sim::simulate::world::World;
use proptest::prelude::*;

use super::support::crossing;

fn circle_crossing(origin: &Point, angle: f64, circle: &Circle) -> Option<f64> {
    let centre = Pose::new(origin.x, origin.y, angle).inverse_transform(&circle.centre);
    let along = centre.x - (circle.radius.powi(2) - centre.y.powi(2)).sqrt();
    (along > 0.0).then_some(along)
}

fn search_of_all_solids(world: &World, origin: &Point, angle: f64) -> Option<f64> {
    let segments = world.segments.iter().filter_map(|segment| crossing(origin, angle, segment));
    let circles = world.circles.iter().filter_map(|circle| circle_crossing(origin, angle, circle));
    segments.chain(circles).min_by(f64::total_cmp)
}

fn coordinate() -> impl Strategy<Value = f64> {
    // Round numbers lie on the borders of the grid's cells.
    prop_oneof![-20.0..20.0, (-40..40).prop_map(|halves| f64::from(halves) * 0.5)]
}

fn any_world() -> impl Strategy<Value = World> {
    let walls = prop::collection::vec((coordinate(), coordinate(), coordinate(), coordinate()), 0..12);
    let boxes = prop::collection::vec((coordinate(), coordinate(), -PI..PI, 0.05..3.0, 0.05..3.0), 0..12);
    let circles = prop::collection::vec((coordinate(), coordinate(), 0.02..2.0), 0..8);
    (walls, boxes, circles).prop_map(|(walls, boxes, circles)| {
        let mut world = World::default();
        for (x, y, other_x, other_y) in walls {
            world.add_wall(Point::new(x, y), Point::new(other_x, other_y));
        }
        for (x, y, heading, length, width) in boxes {
            world.add_rectangle(&Rectangle { pose: Pose::new(x, y, heading), length, width });
        }
        for (x, y, radius) in circles {
            world.circles.push(Circle { centre: Point::new(x, y), radius });
        }
        world
    })
}

/// Whether a slightly turned ray would end elsewhere: one that just touches an end may be decided either way.
fn is_touching(turned: &[Option<f64>]) -> bool {
    turned.windows(2).any(|pair| match (pair[0], pair[1]) {
        (Some(a), Some(b)) => (a - b).abs() > 1e-4,
        (a, b) => a.is_some() != b.is_some(),
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn the_grid_finds_what_a_search_of_all_solids_finds(
        world in any_world(),
        origins in prop::collection::vec((coordinate(), coordinate()), 4),
        first_angle in prop_oneof![0.0..TAU, Just(0.0), Just(FRAC_PI_2)],
    ) {
        let caster = RayCaster::new(&world);
        for (x, y) in origins {
            // Some origins lie outside of the grid.
            let origin = Point::new(x * 1.25, y * 1.25);
            for step in 0..16 {
                let angle = first_angle + f64::from(step) * TAU / 16.0;
                let direction = Point::new(angle.cos(), angle.sin());
                let found = caster.first_hit(&origin, &direction, 200.0).map(|hit| hit.distance);
                let turned = [-1e-7, 0.0, 1e-7].map(|turn| search_of_all_solids(&world, &origin, angle + turn));
                let agrees = match (found, turned[1]) {
                    (Some(found), Some(want)) => (found - want).abs() < 1e-6 * (1.0 + want),
                    (None, None) => true,
                    _ => false,
                };
                let starts_on_surface = turned.iter().chain([&found]).flatten().any(|&distance| distance < 1e-6);
                prop_assert!(
                    agrees || is_touching(&turned) || starts_on_surface,
                    "from {origin:?} at {angle}: {found:?} instead of {turned:?}"
                );
            }
        }
    }
}

#[test]
fn a_ray_ends_at_its_limit() {
    let mut world = World::default();
    world.add_wall(Point::new(10.0, -1.0), Point::new(10.0, 1.0));
    let caster = RayCaster::new(&world);
    let hit = |farthest| caster.first_hit(&Point::zeros(), &Point::x(), farthest).map(|hit| hit.distance);
    assert_eq!(hit(10.1), Some(10.0));
    assert_eq!(hit(9.9), None);
    assert!(RayCaster::new(&World::default()).first_hit(&Point::zeros(), &Point::x(), 10.0).is_none());
}
