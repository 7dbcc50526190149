use agv_core::geometry::Point;
use agv_host_sim::simulate::block_storage::BlockStorage;
use agv_host_sim::simulate::raycast::RayCaster;

#[test]
fn the_block_storage_has_its_stated_dimensions() {
    let mut widths = Vec::new();
    for seed in 0..60 {
        let world = BlockStorage::default().world(seed);
        let boxes = (world.corners.len() - 4) / 4;
        assert!((80..=110).contains(&boxes), "{boxes} boxes");
        let caster = RayCaster::new(&world);
        let range = |x: f64, y: f64, dx: f64, dy: f64| {
            caster.first_hit(&Point::new(x, y), &Point::new(dx, dy), 100.0).unwrap().distance
        };
        // Faces stand at most 3 cm off, boards 1 cm more, and turned pallets half a centimetre more.
        widths.push(range(0.6, 0.0, 0.0, 1.0) + range(0.6, 0.0, 0.0, -1.0));
        // Some rays pass between two pallets.
        let nearest = |x: f64, dx: f64| [-0.4, 0.0, 0.4].map(|y| range(x, y, dx, 0.0)).into_iter().fold(99.0, f64::min);
        let end = nearest(1.0, 1.0);
        assert!((8.999..9.2).contains(&end), "{end}");
        let opposite = nearest(-1.0, -1.0);
        assert!((6.94..7.06).contains(&opposite), "{opposite}");
    }
    assert!(widths.iter().all(|width| (1.9..2.5).contains(width)), "{widths:?}");
    let spread = widths.iter().fold(0.0_f64, |a, &b| a.max(b)) - widths.iter().fold(9.0_f64, |a, &b| a.min(b));
    assert!(spread > 0.3, "{spread}");
}

#[test]
fn corners_are_where_surfaces_meet() {
    let world = BlockStorage::default().world(5);
    for corner in &world.corners {
        let ends = world.segments.iter().filter(|segment| segment.from == *corner || segment.to == *corner);
        assert_eq!(ends.count(), 2, "{corner:?}");
    }
}

#[test]
fn the_stated_share_of_pallets_is_moved_as_far_as_stated() {
    let still = BlockStorage::default().world(2);
    let moved = BlockStorage { moved_share: 0.25, moved_by: 0.2, ..BlockStorage::default() }.world(2);
    assert_eq!(still.corners.len(), moved.corners.len());
    let ways: Vec<f64> = still.corners.iter().zip(&moved.corners).map(|(a, b)| (a - b).norm()).collect();
    assert!(ways.iter().all(|way| *way == 0.0 || (way - 0.2).abs() < 1e-9));
    let share = ways.iter().filter(|way| **way > 0.0).count() as f64 / ways.len() as f64;
    assert!((0.1..0.4).contains(&share), "{share}");
}
