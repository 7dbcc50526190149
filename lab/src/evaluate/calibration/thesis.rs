//! The designs of K tables 5.1 and 5.2, and the deviations printed there.

use serde::Serialize;

/// A way of driving.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Design {
    /// Segments of each of the four phases.
    pub n_seg: u32,
    /// Smallest and largest steering angle, degrees.
    pub steering_deg: [f64; 2],
    /// Angle of each arc, degrees.
    pub beta_deg: f64,
    /// Speed of the driving wheel, mm/s.
    pub speed_mm_s: f64,
}

/// Printed standard deviations; of three or four repetitions each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Printed {
    /// Steering offset, standard calibration, cdeg.
    pub alpha_cdeg: f64,
    /// Steering offsets forward and backward, asymmetric calibration, cdeg.
    pub alpha_asymmetric_cdeg: [f64; 2],
    /// Drive scale, mm a tick, standard and asymmetric.
    pub drive_scale_mm: [f64; 2],
    /// Place of the laser, mm, standard and asymmetric.
    pub laser_x_mm: [f64; 2],
    /// The same.
    pub laser_y_mm: [f64; 2],
    /// Heading of the laser, cdeg, standard and asymmetric.
    pub laser_theta_cdeg: [f64; 2],
}

const fn row(
    n_seg: u32,
    [low, high]: [f64; 2],
    beta_deg: f64,
    speed_mm_s: f64,
    standard: [f64; 5],
    asymmetric: [f64; 6],
) -> (Design, Printed) {
    let [alpha_cdeg, scale, x, y, heading] = standard;
    let [forward, backward, scale_asymmetric, x_asymmetric, y_asymmetric, heading_asymmetric] = asymmetric;
    let design = Design { n_seg, steering_deg: [low, high], beta_deg, speed_mm_s };
    let printed = Printed {
        alpha_cdeg,
        alpha_asymmetric_cdeg: [forward, backward],
        drive_scale_mm: [scale * 1e-6, scale_asymmetric * 1e-6],
        laser_x_mm: [x, x_asymmetric],
        laser_y_mm: [y, y_asymmetric],
        laser_theta_cdeg: [heading, heading_asymmetric],
    };
    (design, printed)
}

const WIDE: [f64; 2] = [18.0, 50.0];
const NARROW: [f64; 2] = [18.0, 34.0];
const SHARP: [f64; 2] = [35.0, 50.0];

/// All rows: offset, drive scale (1e-6 mm a tick), laser x, y, heading of table 5.1, then offsets forward and backward and
/// the same of table 5.2.
pub const TABLE: [(Design, Printed); 20] = [
    row(2, WIDE, 180.0, 1000.0, [0.39, 36.0, 0.13, 0.14, 0.32], [0.81, 0.33, 38.0, 0.16, 0.10, 0.40]),
    row(4, NARROW, 180.0, 1000.0, [0.30, 23.0, 0.16, 0.27, 0.21], [0.43, 0.47, 8.0, 0.20, 0.36, 0.26]),
    row(4, WIDE, 60.0, 1000.0, [0.72, 43.0, 0.34, 0.63, 1.18], [0.76, 0.52, 29.0, 0.42, 0.50, 1.46]),
    row(4, WIDE, 120.0, 1000.0, [0.32, 59.0, 0.51, 0.22, 0.70], [0.07, 0.62, 40.0, 0.63, 0.19, 0.85]),
    row(4, WIDE, 180.0, 800.0, [0.59, 111.0, 0.60, 0.18, 0.28], [0.61, 0.82, 129.0, 0.73, 0.49, 0.34]),
    row(4, WIDE, 180.0, 1000.0, [0.62, 40.0, 0.25, 0.47, 0.80], [1.04, 0.36, 47.0, 0.30, 0.48, 0.98]),
    row(4, WIDE, 180.0, 1200.0, [0.35, 7.0, 0.66, 0.22, 1.12], [0.41, 0.55, 30.0, 0.81, 0.68, 1.37]),
    row(4, WIDE, 180.0, 1400.0, [0.63, 23.0, 0.43, 0.15, 0.77], [0.99, 0.39, 40.0, 0.52, 0.40, 0.94]),
    row(4, SHARP, 180.0, 1000.0, [0.44, 4.0, 0.22, 0.26, 1.80], [0.63, 0.26, 5.0, 0.27, 0.30, 2.20]),
    row(6, WIDE, 180.0, 1000.0, [0.31, 85.0, 0.32, 0.53, 0.44], [0.37, 0.37, 105.0, 0.39, 0.66, 0.53]),
    row(8, WIDE, 180.0, 1000.0, [0.11, 15.0, 0.09, 0.28, 0.59], [0.34, 0.46, 27.0, 0.11, 0.39, 0.72]),
    row(10, WIDE, 180.0, 1000.0, [0.09, 23.0, 0.17, 0.12, 0.34], [0.44, 0.39, 25.0, 0.21, 0.23, 0.40]),
    row(4, NARROW, 180.0, 800.0, [0.48, 122.0, 0.03, 0.48, 1.73], [0.72, 0.34, 163.0, 0.04, 0.66, 2.12]),
    row(4, NARROW, 180.0, 1200.0, [0.30, 6.0, 0.39, 0.12, 0.50], [0.39, 0.34, 28.0, 0.48, 0.30, 0.62]),
    row(4, NARROW, 180.0, 1400.0, [0.65, 39.0, 0.37, 0.56, 0.54], [0.99, 0.64, 34.0, 0.46, 0.83, 0.66]),
    row(6, NARROW, 180.0, 800.0, [0.33, 61.0, 0.15, 0.24, 0.28], [0.48, 0.34, 69.0, 0.18, 0.42, 0.33]),
    row(6, NARROW, 180.0, 1000.0, [0.29, 27.0, 0.45, 0.41, 0.79], [0.32, 0.27, 28.0, 0.56, 0.55, 0.96]),
    row(6, NARROW, 180.0, 1200.0, [0.16, 27.0, 0.45, 0.49, 0.47], [0.07, 0.19, 30.0, 0.55, 0.56, 0.57]),
    row(6, NARROW, 240.0, 1200.0, [0.11, 7.0, 0.15, 0.38, 0.35], [0.23, 0.34, 13.0, 0.18, 0.39, 0.42]),
    row(6, WIDE, 240.0, 800.0, [0.16, 52.0, 0.21, 0.35, 0.55], [0.33, 0.16, 59.0, 0.26, 0.51, 0.67]),
];
