//! Parameters of one laser (M 3.2.1).

/// What the maker states about one laser.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Laser {
    /// Added to the measured distance (D_corr), m.
    pub distance: f64,
    /// Elevation of the beam (theta), rad; up is positive.
    pub elevation: f64,
    /// Rotation of the beam in the head (alpha), rad; left is positive.
    pub rotation: f64,
    /// Offset of the beam upwards (V_o), m.
    pub vertical_offset: f64,
    /// Offset of the beam sideways (H_o), m; left is positive.
    pub horizontal_offset: f64,
    /// Whether the laser is in use.
    pub is_enabled: bool,
    /// What later files add.
    pub full: Option<Full>,
}

/// Parameters that the later files have beside the five of M 3.2.1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Full {
    /// Correction of the near distance along the axis that M calls x, m.
    pub distance_x: f64,
    /// Correction of the near distance along the axis that M calls y, m.
    pub distance_y: f64,
    /// Distance at which the receiver is in focus, m.
    pub focal_distance: f64,
    /// Change of intensity with distance, without unit.
    pub focal_slope: f64,
    /// Smallest intensity.
    pub min_intensity: u8,
    /// Greatest intensity.
    pub max_intensity: u8,
    /// Whether the two near corrections are to be used, as the file says.
    pub has_two_points: bool,
}
