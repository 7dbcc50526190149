//! Scans are aligned to where another program says they were taken, and to where they were put.

use std::path::Path;

use agv_host_sim::import::poses;
use agv_host_sim::import::range_image::RangeImages;
use agv_host_sim::lidar3d::refinement::{Surfaces, Target};
use agv_host_sim::lidar3d::signatures::{Signatures, sensor_height};
use agv_lidar3d::cloud::Cloud;
use agv_tests::recordings;

const STREET: &str = "lidar3d/moosmann/MuehlburgerTor";

type Points = Vec<Option<[f32; 3]>>;

struct Street {
    images: RangeImages,
    poses: Vec<[f64; 3]>,
}

impl Street {
    fn open(folder: &Path) -> Self {
        let images = RangeImages::open(&folder.join("velodyne_dist")).unwrap();
        Self { images, poses: poses::read(&folder.join("kiss_icp_poses_derived.txt")).unwrap() }
    }

    fn scan(&self, number: usize) -> Points {
        self.images.points(number).unwrap()
    }

    fn cloud<'a>(&self, points: &'a Points) -> Cloud<'a> {
        Cloud::new(points, self.images.elevations.len()).unwrap()
    }
}

#[test]
fn a_scan_that_was_moved_is_brought_back() {
    let Some(folder) = recordings("a_scan_that_was_moved_is_brought_back", STREET) else { return };
    let street = Street::open(&folder);
    let points = street.scan(100);
    let target = Target::new(Surfaces::new(&street.cloud(&points))).unwrap();
    for (turn, [x, y, z]) in [(0.4_f32, [1.5_f32, -0.8, 0.05]), (-2.5, [-1.0, 1.2, -0.1]), (3.1, [0.3, 0.2, 0.0])] {
        // What the sensor sees from there: the inverse of its pose.
        let (sin, cos) = turn.sin_cos();
        let moved: Points = points
            .iter()
            .map(|point| {
                point.map(|[px, py, pz]| {
                    let (dx, dy) = (px - x, py - y);
                    [cos * dx + sin * dy, cos * dy - sin * dx, pz - z]
                })
            })
            .collect();
        let scan = Surfaces::new(&street.cloud(&moved)).thinned();
        let found = target.align(&scan, f64::from(turn) + 0.03).unwrap();
        let off = found.pose.translation.vector - nalgebra::Vector3::new(x, y, z).cast::<f64>();
        let turned = (found.turn() - f64::from(turn)).sin().abs();
        assert!(off.norm() < 0.005 && turned < 2e-4 && found.share > 0.9, "{found:?} {off:?} {turned}");
    }
}

#[test]
fn scans_of_a_street_lie_where_another_program_puts_them() {
    let Some(folder) = recordings("scans_of_a_street_lie_where_another_program_puts_them", STREET) else { return };
    let street = Street::open(&folder);
    let height = sensor_height(&street.scan(0));
    let (mut errors, mut turns, mut asked) = (Vec::new(), Vec::new(), 0);
    for first in (0..480).step_by(32) {
        let (one, other) = (street.scan(first), street.scan(first + 4));
        let ([x, y, heading], [u, v, other_heading]) = (street.poses[first], street.poses[first + 4]);
        let turn =
            Signatures::new(&street.cloud(&other), height).turn_since(&Signatures::new(&street.cloud(&one), height));
        let target = Target::new(Surfaces::new(&street.cloud(&one))).unwrap();
        asked += 1;
        let Some(found) = target.align(&Surfaces::new(&street.cloud(&other)).thinned(), turn) else { continue };
        let (sin, cos) = heading.sin_cos();
        let there = [cos * (u - x) + sin * (v - y), cos * (v - y) - sin * (u - x)];
        let position = found.pose.translation.vector;
        errors.push((position.x - there[0]).hypot(position.y - there[1]));
        turns.push((found.turn() - (other_heading - heading)).sin().abs().to_degrees());
    }
    errors.sort_by(f64::total_cmp);
    turns.sort_by(f64::total_cmp);
    println!("{} of {asked} aligned; errors, m: {errors:.3?}; turns, deg: {turns:.3?}", errors.len());
    // Between bare walls the way along the street is open, and is said to be.
    assert!(errors.len() * 10 >= asked * 7);
    assert!(errors[errors.len() / 2] < 0.05 && turns[turns.len() / 2] < 0.1);
    assert!(errors.iter().all(|error| *error < 0.2) && turns.iter().all(|turn| *turn < 0.5));
}
