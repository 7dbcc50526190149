//! Points of ours against those of another driver.

/// Greatest difference of a coordinate, m.
pub const TOLERANCE: f32 = 0.002;

/// Greatest difference of a coordinate, m.
pub fn apart_of(one: [f32; 3], other: [f32; 3]) -> f32 {
    one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// The point, seen that much farther clockwise, 0.01 degrees.
pub fn turned([x, y, z]: [f32; 3], counts: f32) -> [f32; 3] {
    let (sin, cos) = (0.01 * counts).to_radians().sin_cos();
    [x * cos + y * sin, y * cos - x * sin, z]
}

/// What a comparison found.
#[derive(Debug, Default)]
pub struct Compared {
    pub points: usize,
    /// Greatest difference of a coordinate, m.
    pub worst: f32,
    /// Points that lie farther off and for which the papers say why.
    pub explained: usize,
}

impl Compared {
    pub fn add(&mut self, difference: f32, is_explained: bool) {
        self.points += 1;
        if difference > TOLERANCE && is_explained {
            self.explained += 1;
        } else {
            self.worst = self.worst.max(difference);
        }
    }

    pub fn report(&self, sensor: &str, driver: &str) {
        let Self { points, worst, explained } = self;
        println!("{} against {driver}: {points} points, {:.2} mm, {explained} explained", sensor, 1e3 * worst);
    }
}
