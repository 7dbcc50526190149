//! Surroundings made of straight walls, and what a laser measures of them.

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::{LaserId, Scan, Time};

/// Walls from one point to another, m.
pub type Walls = Vec<[f64; 4]>;

/// Standard deviation of a range, m.
const NOISE: f64 = 0.01;

/// The reach of the laser, m.
const REACH: f64 = 40.0;

/// Beams of a laser that looks all around.
pub const BEAMS: usize = 720;

/// Numbers that look random: xorshift, J. Stat. Softw. 8 (14), 2003.
pub struct Noise(pub u64);

impl Noise {
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mean zero, standard deviation one: twelve uniform numbers.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// What a beam measures from a pose along its heading; zero if nothing is in reach.
pub fn range(walls: &Walls, beam: &Pose, noise: &mut Noise) -> f32 {
    let (sine, cosine) = beam.theta.sin_cos();
    let hit = walls.iter().filter_map(|[ax, ay, bx, by]| {
        let (dx, dy) = (bx - ax, by - ay);
        let determinant = cosine * dy - sine * dx;
        let along = ((ax - beam.x) * dy - (ay - beam.y) * dx) / determinant;
        let share = ((ax - beam.x) * sine - (ay - beam.y) * cosine) / determinant;
        (along > 0.05 && (0.0..=1.0).contains(&share)).then_some(along)
    });
    let nearest = hit.min_by(f64::total_cmp).filter(|range| *range < REACH);
    nearest.map_or(0.0, |range| (range + NOISE * noise.normal()) as f32)
}

/// What a laser that looks all around, and stands, measures.
pub fn ranges(walls: &Walls, laser: &Pose, noise: &mut Noise) -> Vec<f32> {
    let bearing = |beam: usize| laser.theta - PI + TAU * beam as f64 / BEAMS as f64;
    (0..BEAMS).map(|beam| range(walls, &Pose { theta: bearing(beam), ..*laser }, noise)).collect()
}

/// The same as a scan.
pub fn scan(ranges: &[f32], start: Time) -> Scan<'_> {
    Scan {
        laser: LaserId::FIRST,
        start,
        beam_interval: 0.0,
        first_bearing: -PI,
        bearing_step: TAU / BEAMS as f64,
        ranges,
        intensities: &[],
    }
}

/// Points along the walls, with the normals of both sides.
pub fn surfaces(walls: &Walls, every: f64) -> Vec<(Point, Point)> {
    let of = |[ax, ay, bx, by]: &[f64; 4]| {
        let (from, along) = (Point::new(*ax, *ay), Point::new(bx - ax, by - ay));
        let length = along.norm();
        let normal = Point::new(-along.y, along.x) / length;
        let places = (length / every) as usize;
        (0..=places).flat_map(move |place| {
            let at = from + along * (place as f64 * every / length).min(1.0);
            [(at, normal), (at, -normal)]
        })
    };
    walls.iter().flat_map(of).collect()
}

/// A corridor 2.4 m wide and so long that no end is seen, with niches 20 cm deep and 1 m wide every so many metres, if any.
pub fn corridor(niches: Option<f64>) -> Walls {
    let mut walls = Vec::new();
    for side in [1.2, -1.2] {
        let mut x = -60.0;
        while let Some(every) = niches.filter(|_| x < 80.0) {
            let (deep, end) = (side * 1.4 / 1.2, x + every);
            walls.push([x, side, end - 1.0, side]);
            walls.push([end - 1.0, side, end - 1.0, deep]);
            walls.push([end - 1.0, deep, end, deep]);
            walls.push([end, deep, end, side]);
            x = end;
        }
        walls.push([x, side, 90.0, side]);
    }
    walls
}

/// A room of 12 m x 9 m with a nook and a cupboard.
pub fn room() -> Walls {
    vec![
        [-2.0, -3.0, 10.0, -3.0],
        [10.0, -3.0, 10.0, 6.0],
        [10.0, 6.0, 3.0, 6.0],
        [3.0, 6.0, 3.0, 5.0],
        [3.0, 5.0, -2.0, 5.0],
        [-2.0, 5.0, -2.0, -3.0],
        [7.0, -3.0, 7.0, -2.2],
        [7.0, -2.2, 8.2, -2.2],
        [8.2, -2.2, 8.2, -3.0],
    ]
}
