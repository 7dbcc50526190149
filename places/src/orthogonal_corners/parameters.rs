//! Parameters of the detector.

/// What the detector takes for a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrthogonalCornerParameters {
    /// Farthest return, m.
    pub farthest: f32,
    /// Largest distance of a return from the middle of its surface, m.
    pub thickness: f32,
    /// Shortest surface, m.
    pub length: f32,
    /// Fewest returns of a surface.
    pub points: u16,
    /// Largest distance between neighbouring returns of a surface, m.
    pub gap: f32,
    /// Largest distance of a corner from the ends of its surfaces, m.
    pub reach: f32,
    /// Corners closer than this are one, m.
    pub suppression_radius: f32,
    /// Standard deviation of a range that is expected of the sensor, m.
    pub range_deviation: f32,
}

impl Default for OrthogonalCornerParameters {
    fn default() -> Self {
        Self {
            farthest: 25.0,
            thickness: 0.1,
            length: 0.3,
            points: 4,
            gap: 0.5,
            reach: 0.3,
            suppression_radius: 0.2,
            range_deviation: 0.01,
        }
    }
}
