//! Where a scan was taken, seen from a place that it looks like: its points are aligned to the surfaces of the stored scan
//! (point to plane, Chen and Medioni 1992), beginning with the turn that the signatures give.

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{Neighbours, surfaces};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

/// Points of a scan that are aligned, about.
const POINTS: usize = 3000;
/// Points of the first look at each start, about.
const FEW: usize = 500;
/// Starts lie so far apart, m, and this many to each side of the stored place. A street looks alike along itself, so the
/// nearest surface is the right one only from near by.
const SPACING: f64 = 1.25;
const STARTS: i32 = 4;
/// Starts that are followed to the end.
const FOLLOWED: usize = 4;
/// Greatest distance of a point from its surface at the beginning and in the end, m, and the factor from step to step.
const REACH: (f64, f64, f64) = (1.5, 0.5, 0.8);
/// Steps of a first look, and at most.
const FIRST_STEPS: usize = 8;
const STEPS: usize = 30;
/// A step that is smaller than this ends the alignment, m and rad.
const SMALL: f64 = 1e-5;
/// Residuals above this count less, m.
const SCALE: f64 = 0.1;
/// Least cosine between the normals of a point and its surface.
const ALIKE: f64 = 0.7;
/// Least share of the points that must lie on a surface.
const LEAST_SHARE: f64 = 0.3;
/// Least information of the weakest direction, as a share of what all points together could give.
const LEAST_INFORMATION: f64 = 0.01;

/// An end that lies so far away, m, and is nearly as good leaves it open where the scan lies.
const ANOTHER_POSE: f64 = 1.0;
const RIVAL: f64 = 0.97;

/// Points of a scan with their normals, in the frame of the sensor.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    points: Vec<[f64; 3]>,
    normals: Vec<Vector3<f64>>,
}

impl Surfaces {
    /// Of a scan.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>) -> Self {
        let mut found = Self::default();
        surfaces(cloud, &Neighbours::default(), |point, normal| {
            found.points.push(point.map(f64::from));
            found.normals.push(Vector3::from(normal.map(f64::from)));
        });
        found
    }

    /// Some of the points, evenly chosen: enough to be aligned.
    #[must_use]
    pub fn thinned(&self) -> Self {
        self.some(POINTS)
    }

    fn some(&self, count: usize) -> Self {
        let step = self.points.len().div_ceil(count).max(1);
        Self {
            points: self.points.iter().step_by(step).copied().collect(),
            normals: self.normals.iter().step_by(step).copied().collect(),
        }
    }
}

/// How a scan lies in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Pose of the sensor in the frame of the other scan, m and rad.
    pub pose: Isometry3<f64>,
    /// Share of the points that lie on a surface of the other scan, within 0.5 m.
    pub share: f64,
    /// Root mean square of their distances from those surfaces, m.
    pub deviation: f64,
}

impl Alignment {
    /// Turn to the left, rad, -pi to pi.
    #[must_use]
    pub fn turn(&self) -> f64 {
        self.pose.rotation.euler_angles().2
    }
}

/// A scan that others are aligned to.
pub struct Target {
    surfaces: Surfaces,
    tree: ImmutableKdTree<f64, 3>,
}

impl Target {
    /// None if the scan has no surfaces.
    #[must_use]
    pub fn new(surfaces: Surfaces) -> Option<Self> {
        let tree = ImmutableKdTree::new_from_slice(&surfaces.points).ok()?;
        (!surfaces.points.is_empty()).then_some(Self { surfaces, tree })
    }

    /// Aligns a scan whose sensor was turned to the left by about `turn`, rad, and at most 5 m away. None if too little of
    /// it lies on the surfaces, they do not determine the pose, or it fits as well elsewhere.
    #[must_use]
    pub fn align(&self, scan: &Surfaces, turn: f64) -> Option<Alignment> {
        let few = scan.some(FEW);
        let steps = (-STARTS..=STARTS).map(|step| SPACING * f64::from(step));
        let starts = steps.clone().flat_map(|x| steps.clone().map(move |y| Vector3::new(x, y, 0.0)));
        let mut looks: Vec<(f64, Isometry3<f64>)> = starts
            .filter_map(|start| {
                let start = Isometry3::new(start, Vector3::z() * turn);
                let (pose, sum) = self.follow(&few, &start, FIRST_STEPS)?;
                Some((sum.weights, pose))
            })
            .collect();
        looks.sort_by(|one, other| other.0.total_cmp(&one.0));
        let followed = looks.iter().take(FOLLOWED).filter_map(|(_, pose)| self.follow(scan, pose, STEPS));
        let ends: Vec<(Isometry3<f64>, Sum)> = followed.collect();
        let (pose, sum) = ends.iter().max_by(|one, other| one.1.weights.total_cmp(&other.1.weights))?;
        let is_elsewhere =
            |other: &Isometry3<f64>| (other.translation.vector - pose.translation.vector).norm() > ANOTHER_POSE;
        if ends.iter().any(|(other, rival)| is_elsewhere(other) && rival.weights > RIVAL * sum.weights) {
            return None;
        }
        let share = sum.count as f64 / scan.points.len().max(1) as f64;
        let deviation = (sum.squares / sum.count.max(1) as f64).sqrt();
        (share >= LEAST_SHARE && sum.is_determined()).then_some(Alignment { pose: *pose, share, deviation })
    }

    /// From a start to where nothing moves any more, and the sums there.
    fn follow(&self, scan: &Surfaces, start: &Isometry3<f64>, steps: usize) -> Option<(Isometry3<f64>, Sum)> {
        let mut pose = *start;
        let (mut reach, last_reach, factor) = REACH;
        for _ in 0..steps {
            let step = self.sum(scan, &pose, reach).step()?;
            let (turn, shift) = (step.fixed_rows::<3>(0).into_owned(), step.fixed_rows::<3>(3).into_owned());
            pose = Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn)) * pose;
            if reach <= last_reach && step.amax() < SMALL {
                break;
            }
            reach = (factor * reach).max(last_reach);
        }
        Some((pose, self.sum(scan, &pose, last_reach)))
    }

    fn sum(&self, scan: &Surfaces, pose: &Isometry3<f64>, reach: f64) -> Sum {
        let mut sum = Sum::default();
        for (point, normal) in scan.points.iter().zip(&scan.normals) {
            let point = pose * Point3::from(*point);
            let nearest =
                self.tree.query(&[point.x, point.y, point.z]).nearest_one::<SquaredEuclidean<f64>>().execute();
            let place = nearest.item as usize;
            let surface = self.surfaces.normals[place];
            if nearest.distance > reach * reach || (pose * normal).dot(&surface) < ALIKE {
                continue;
            }
            let residual = surface.dot(&(point - Point3::from(self.surfaces.points[place])));
            let lever = point.coords.cross(&surface);
            let row = Vector6::new(lever.x, lever.y, lever.z, surface.x, surface.y, surface.z);
            let weight = 1.0 / (1.0 + (residual / SCALE).powi(2));
            sum.information += weight * row * row.transpose();
            sum.gradient += weight * residual * row;
            sum.squares += residual * residual;
            sum.weights += weight;
            sum.count += 1;
        }
        sum
    }
}

/// Normal equations of one step.
#[derive(Default)]
struct Sum {
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
    squares: f64,
    weights: f64,
    count: usize,
}

impl Sum {
    /// Turn and shift, rad and m.
    fn step(&self) -> Option<Vector6<f64>> {
        let step = -self.information.cholesky()?.solve(&self.gradient);
        step.iter().all(|value| value.is_finite()).then_some(step)
    }

    /// Whether surfaces face in enough directions to fix the position.
    fn is_determined(&self) -> bool {
        let position = self.information.fixed_view::<3, 3>(3, 3).into_owned();
        position.symmetric_eigenvalues().min() > LEAST_INFORMATION * position.trace()
    }
}
