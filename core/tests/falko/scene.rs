//! A block storage of rectangles, and a laser in its lane; nothing here comes from the detector.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

/// Repeatable random numbers (splitmix64).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66_D123_4567)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }
}

pub type Vertex = [f64; 2];

/// Things on a floor.
pub struct Scene {
    outlines: Vec<Outline>,
}

impl Scene {
    /// A lane along the first axis from x = 0, 10 m deep, three rows of pallets on each side and one across its end, with
    /// gaps of 5 to 15 cm, faces offset by 3 cm and turned by 0.6 degrees at most, inside a hall.
    pub fn block_storage(random: &mut Random) -> Self {
        let mut outlines = Vec::new();
        let half_width = random.uniform(1.0, 1.2);
        for side in [-1.0, 1.0] {
            for row in 0..3 {
                let mut x = random.uniform(0.0, 0.1);
                while x < 9.0 {
                    let face = half_width + f64::from(row) * 1.1 + random.uniform(-0.03, 0.03);
                    outlines.push(pallet(random, x + 0.6, side * (face + 0.5), 0.0));
                    x += 1.2 + random.uniform(0.05, 0.15);
                }
            }
        }
        let mut y = -4.0;
        while y < 4.0 {
            let x = 10.8 + random.uniform(-0.03, 0.03);
            outlines.push(pallet(random, x, y, FRAC_PI_2));
            y += 1.2 + random.uniform(0.05, 0.15);
        }
        let mut y = -8.0;
        while y < 8.0 {
            let x = -8.0 + random.uniform(-0.03, 0.03);
            outlines.push(pallet(random, x, y, FRAC_PI_2));
            y += 1.2 + random.uniform(0.05, 0.15);
        }
        for (x, y) in [(-5.0, -4.0), (-5.0, 4.0), (-2.0, 8.0)] {
            outlines.push(rectangle(x, y, 0.4, 0.4, random.uniform(0.0, PI)));
        }
        outlines.push(rectangle(0.0, 0.0, 40.0, 30.0, 0.0));
        Self { outlines }
    }

    /// Distance along a ray to the first wall.
    fn cast(&self, origin: Vertex, bearing: f64) -> f64 {
        let direction = [bearing.cos(), bearing.sin()];
        let mut nearest = f64::INFINITY;
        for outline in &self.outlines {
            let next = outline.vertices.iter().cycle().skip(1);
            for (a, b) in outline.vertices.iter().zip(next) {
                let edge = [b[0] - a[0], b[1] - a[1]];
                let to_a = [a[0] - origin[0], a[1] - origin[1]];
                let determinant = direction[0] * edge[1] - direction[1] * edge[0];
                let distance = (to_a[0] * edge[1] - to_a[1] * edge[0]) / determinant;
                let share = (to_a[0] * direction[1] - to_a[1] * direction[0]) / determinant;
                if (0.0..=1.0).contains(&share) && distance > 0.0 && distance < nearest {
                    nearest = distance;
                }
            }
        }
        nearest
    }

    /// Ranges of `beams` beams around the full circle from `first_bearing`, with normal noise.
    pub fn scan(
        &self,
        pose: [f64; 3],
        beams: usize,
        first_bearing: f64,
        deviation: f64,
        random: &mut Random,
    ) -> Vec<f32> {
        let bearing = |beam: usize| pose[2] + first_bearing + TAU * beam as f64 / beams as f64;
        (0..beams)
            .map(|beam| (self.cast([pose[0], pose[1]], bearing(beam)) + deviation * random.normal()) as f32)
            .collect()
    }

    /// Ranges around the full circle of a sensor that moves by `travel` along its heading meanwhile, and the points in the
    /// frame that it had at the first beam, as a perfect correction of the motion gives them.
    pub fn moving_scan(
        &self,
        pose: [f64; 3],
        beams: usize,
        travel: f64,
        deviation: f64,
        random: &mut Random,
    ) -> Vec<(f32, [f32; 2])> {
        let beam = |beam: usize| {
            let share = beam as f64 / beams as f64;
            let (bearing, along) = (TAU * share - PI, travel * share);
            let origin = [pose[0] + along * pose[2].cos(), pose[1] + along * pose[2].sin()];
            let range = self.cast(origin, pose[2] + bearing) + deviation * random.normal();
            (range as f32, [(along + range * bearing.cos()) as f32, (range * bearing.sin()) as f32])
        };
        (0..beams).map(beam).collect()
    }

    /// Offset of a world point from the nearest true corner.
    pub fn offset_from_corner(&self, point: Vertex) -> Vertex {
        let corners = self.outlines.iter().flat_map(|outline| &outline.corners);
        let offsets = corners.map(|corner| [point[0] - corner[0], point[1] - corner[1]]);
        offsets.min_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1]))).unwrap_or([f64::NAN; 2])
    }
}

/// A pallet whose two long faces are three boards each, set off by 1 cm at most.
fn pallet(random: &mut Random, x: f64, y: f64, heading: f64) -> Outline {
    let turn = random.uniform(-0.6, 0.6).to_radians();
    let mut local = Vec::new();
    let mut corners = Vec::new();
    for side in [-1.0, 1.0] {
        for board in 0..3 {
            let across = side * (0.5 + random.uniform(-0.01, 0.01));
            for end in [-0.6 + 0.4 * f64::from(board), -0.2 + 0.4 * f64::from(board)] {
                if f64::abs(end) > 0.59 {
                    corners.push([side * -end, across]);
                }
                local.push([side * -end, across]);
            }
        }
    }
    Outline::placed(&local, &corners, [x, y, heading + turn])
}

fn rectangle(x: f64, y: f64, length: f64, width: f64, heading: f64) -> Outline {
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(u, v)| [u * length, v * width]);
    Outline::placed(&corners, &corners, [x, y, heading])
}

/// A closed outline, and those of its vertices that are corners of the whole.
pub struct Outline {
    vertices: Vec<Vertex>,
    corners: Vec<Vertex>,
}

impl Outline {
    fn placed(vertices: &[Vertex], corners: &[Vertex], pose: [f64; 3]) -> Self {
        let (sine, cosine) = pose[2].sin_cos();
        let place = |[u, v]: &Vertex| [pose[0] + cosine * u - sine * v, pose[1] + sine * u + cosine * v];
        Self { vertices: vertices.iter().map(place).collect(), corners: corners.iter().map(place).collect() }
    }
}
