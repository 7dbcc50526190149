//! Clusters of points that were seen again and again (K 5.6).

use std::collections::HashMap;

use agv_core::geometry::Point;
use agv_core::maps::{Landmark, LandmarkKind};

/// A feature, where it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// What was seen.
    pub kind: LandmarkKind,
    /// Where, in W, m.
    pub position: Point,
    /// Variance an axis of where, as far as the pose from which it was seen is to blame, m^2.
    pub pose_variance: f64,
}

/// What makes a cluster a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clustering {
    /// Points further than this from a cluster's centre do not belong to it, m.
    pub radius: f64,
    /// Fewest points of a landmark.
    pub least_points: usize,
    /// Largest standard deviation of the points of a landmark along an axis, m.
    pub largest_deviation: f64,
    /// Standard deviation of a landmark, as a share of that of its points: the part that does not average out.
    pub deviation_share: f64,
}

impl Default for Clustering {
    fn default() -> Self {
        Self { radius: 0.06, least_points: 6, largest_deviation: 0.025, deviation_share: 0.5 }
    }
}

/// How often the points are assigned to the nearest centre and the centres moved to the mean of their points.
const ROUNDS: usize = 4;

#[derive(Clone, Debug)]
struct Cluster {
    kind: LandmarkKind,
    centre: Point,
    count: usize,
    sum: Point,
    square_sum: f64,
    pose_variance_sum: f64,
}

impl Cluster {
    fn new(sighting: &Sighting) -> Self {
        Self {
            kind: sighting.kind,
            centre: sighting.position,
            count: 0,
            sum: Point::zeros(),
            square_sum: 0.0,
            pose_variance_sum: 0.0,
        }
    }

    /// Mean variance of the poses from which the points were seen, m^2. It does not average out: the poses of a drive
    /// share their error.
    fn pose_variance(&self) -> f64 {
        self.pose_variance_sum / self.count.max(1) as f64
    }

    /// Standard deviation along an axis, m.
    fn deviation(&self) -> f64 {
        (self.square_sum / (2.0 * self.count.max(1) as f64)).sqrt()
    }
}

/// Centres of clusters by the cell of a grid in which they lie.
struct Index {
    cell: f64,
    places: HashMap<(i64, i64), Vec<usize>>,
}

impl Index {
    fn key(&self, point: &Point) -> (i64, i64) {
        ((point.x / self.cell).floor() as i64, (point.y / self.cell).floor() as i64)
    }

    fn insert(&mut self, point: &Point, cluster: usize) {
        self.places.entry(self.key(point)).or_default().push(cluster);
    }

    fn nearest(&self, sighting: &Sighting, clusters: &[Cluster]) -> Option<usize> {
        let (column, row) = self.key(&sighting.position);
        let neighbours = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (column + dx, row + dy)));
        neighbours
            .filter_map(|key| self.places.get(&key))
            .flatten()
            .copied()
            .filter(|&cluster| clusters[cluster].kind == sighting.kind)
            .map(|cluster| (cluster, (clusters[cluster].centre - sighting.position).norm()))
            .filter(|(_, distance)| *distance <= self.cell)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(cluster, _)| cluster)
    }
}

/// Clusters the sightings and gives the dense clusters as landmarks, numbered from zero.
#[must_use]
pub fn cluster(sightings: impl IntoIterator<Item = Sighting>, parameters: &Clustering) -> Vec<Landmark> {
    let sightings: Vec<Sighting> = sightings.into_iter().collect();
    let mut clusters: Vec<Cluster> = Vec::new();
    for round in 0..ROUNDS {
        let mut index = Index { cell: parameters.radius, places: HashMap::new() };
        for (number, cluster) in clusters.iter_mut().enumerate() {
            if cluster.count > 0 {
                cluster.centre = cluster.sum / cluster.count as f64;
            }
            *cluster =
                Cluster { count: 0, sum: Point::zeros(), square_sum: 0.0, pose_variance_sum: 0.0, ..cluster.clone() };
            index.insert(&cluster.centre, number);
        }
        for sighting in &sightings {
            let number = match index.nearest(sighting, &clusters) {
                Some(number) => number,
                None if round == 0 => {
                    index.insert(&sighting.position, clusters.len());
                    clusters.push(Cluster::new(sighting));
                    clusters.len() - 1
                }
                None => continue,
            };
            let cluster = &mut clusters[number];
            cluster.count += 1;
            cluster.sum += sighting.position;
            cluster.pose_variance_sum += sighting.pose_variance;
            cluster.square_sum += (sighting.position - cluster.centre).norm_squared();
        }
        clusters.retain(|cluster| cluster.count > 0);
    }
    clusters
        .iter()
        .filter(|cluster| cluster.count >= parameters.least_points)
        .filter(|cluster| cluster.deviation() <= parameters.largest_deviation)
        .zip(0_u16..)
        .map(|(cluster, id)| Landmark {
            id,
            kind: cluster.kind,
            x: cluster.centre.x,
            y: cluster.centre.y,
            deviation: (parameters.deviation_share * cluster.deviation()).hypot(cluster.pose_variance().sqrt()) as f32,
        })
        .collect()
}
