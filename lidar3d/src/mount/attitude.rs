//! Height, roll and pitch of a sensor by the floor that it stands on.

use std::vec::Vec;

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::cloud::Cloud;
use crate::place::Floor;

/// Points of floor are looked for up to this distance, m; from nearer ones the vehicle itself may be seen.
const REACH: [f64; 2] = [2.0, 20.0];
/// How far from the plane points count in the beginning and in the end, m; between, three deviations of what counts.
const WIDEST: f64 = 0.15;
const NARROWEST: f64 = 1e-4;
const DEVIATIONS: f64 = 3.0;
/// What is drawn together by a normal distribution that is cut at three deviations.
const CUT: f64 = 1.014;
/// Fits at the most.
const ROUNDS: usize = 30;
/// A floor of fewer points is none.
const LEAST_POINTS: usize = 100;
/// A floor does not lean more, as the tangent of the angle.
const STEEPEST: f64 = 0.3;
/// A plane counts as that of a stated height if it is this near to it, m.
const NEAR_STATED: f64 = 0.25;

/// How a sensor stands on the floor, by one scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorStand {
    /// Height above the floor, m.
    pub height: f64,
    /// Turn about the sensor's forward axis, rad; positive with its left side up.
    pub roll: f64,
    /// Turn about the axis to its left, rad; positive with its front down.
    pub pitch: f64,
    /// Standard deviations of the three by the residuals of the plane, m and rad.
    pub deviations: [f64; 3],
    /// By how much the three differ from those of a plane through twice as wide a band: what stands on the floor draws a plane upwards, in a
    /// wide band more than in a narrow one. m and rad.
    pub contradictions: [f64; 3],
    /// Standard deviation of a point from the plane, m.
    pub residual: f64,
    /// Points of floor.
    pub points: usize,
}

impl FloorStand {
    /// By the floor of a scan, which lies near a stated height or, without one, where [`Floor::find`] finds it. What stands on
    /// the floor is left out by its distance from the plane, round after round. None if there is no plane.
    #[must_use]
    pub fn find(cloud: &Cloud<'_>, stated: Option<f64>) -> Option<Self> {
        let start = match stated {
            Some(height) => Vector3::new(0.0, 0.0, -height),
            None => {
                let Floor { height, slope: [a, b] } = Floor::find(cloud)?;
                Vector3::new(f64::from(a), f64::from(b), f64::from(-height))
            }
        };
        let points: Vec<Vector3<f64>> = cloud.seen().map(|point| Vector3::from(point.map(f64::from))).collect();
        let (plane, mut band) = (start, if stated.is_some() { NEAR_STATED } else { WIDEST });
        let mut fit = Fit::of(&points, &plane, band)?;
        for _ in 0..ROUNDS {
            let next = (DEVIATIONS * CUT * fit.residual).clamp(NARROWEST, band);
            // Bands shrink slowly: a plane that leans into what stands on the floor must first turn back.
            band = next.max(0.7 * band);
            let plane = fit.plane;
            fit = Fit::of(&points, &plane, band)?;
            if band <= next && (fit.plane - plane).amax() < 1e-9 {
                break;
            }
        }
        let wide = fit.stand();
        // What remains of the points is cut off evenly on both sides: the plane stays, and less of what stands on it counts.
        let narrow = (0.5 * band).max(NARROWEST);
        let plane = fit.plane;
        fit = Fit { residual: fit.residual, ..Fit::of(&points, &plane, narrow)? };
        let is_steep = fit.plane.xy().amax() > STEEPEST;
        let is_other = stated.is_some_and(|stated| (stated + fit.plane.z).abs() > NEAR_STATED);
        let stand = fit.stand();
        let contradictions = [wide.height - stand.height, wide.roll - stand.roll, wide.pitch - stand.pitch];
        (!is_steep && !is_other).then_some(Self { contradictions, ..stand })
    }

    /// The rotation that makes points of the sensor level: a roll, then a pitch.
    #[must_use]
    pub fn levelling(&self) -> Rotation3<f64> {
        Rotation3::from_euler_angles(self.roll, self.pitch, 0.0)
    }
}

/// A plane z = a x + b y + c, as (a, b, c), by least squares.
struct Fit {
    plane: Vector3<f64>,
    inverse: Matrix3<f64>,
    residual: f64,
    points: usize,
}

impl Fit {
    /// Through the points that are near to a plane.
    fn of(points: &[Vector3<f64>], near: &Vector3<f64>, band: f64) -> Option<Self> {
        let row = |point: &Vector3<f64>| Vector3::new(point.x, point.y, 1.0);
        let counts = |point: &&Vector3<f64>| {
            let far = point.xy().norm();
            (REACH[0]..REACH[1]).contains(&far) && (point.z - near.dot(&row(point))).abs() <= band
        };
        let chosen: Vec<&Vector3<f64>> = points.iter().filter(counts).collect();
        if chosen.len() < LEAST_POINTS {
            return None;
        }
        let (mut information, mut sum) = (Matrix3::zeros(), Vector3::zeros());
        for point in &chosen {
            let row = row(point);
            information += row * row.transpose();
            // What is left of the old plane is small, and small numbers are summed exactly.
            sum += row * (point.z - near.dot(&row));
        }
        let inverse = information.try_inverse()?;
        let plane = near + inverse * sum;
        let squares: f64 = chosen.iter().map(|point| (point.z - plane.dot(&row(point))).powi(2)).sum();
        Some(Self { plane, inverse, residual: (squares / (chosen.len() - 3) as f64).sqrt(), points: chosen.len() })
    }

    fn stand(&self) -> FloorStand {
        let [a, b, c] = self.plane.into();
        let length = (1.0 + a * a + b * b).sqrt();
        // The normal (-a, -b, 1) is what the vertical is after the turn back: (-sin p, sin r cos p, cos r cos p).
        let stand = |[a, b, c]: [f64; 3]| {
            let length = (1.0 + a * a + b * b).sqrt();
            [-c / length, (-b).atan2(1.0), (a / length).asin()]
        };
        let [height, roll, pitch] = stand([a, b, c]);
        let jacobian = Matrix3::from_rows(&[
            Vector3::new(c * a, c * b, -length * length).transpose() / length.powi(3),
            Vector3::new(0.0, -1.0 / (1.0 + b * b), 0.0).transpose(),
            Vector3::new((1.0 + b * b).sqrt(), -a * b / (1.0 + b * b).sqrt(), 0.0).transpose() / (length * length),
        ]);
        let covariance = jacobian * self.inverse * jacobian.transpose() * self.residual.powi(2);
        FloorStand {
            height,
            roll,
            pitch,
            deviations: covariance.diagonal().map(f64::sqrt).into(),
            contradictions: [0.0; 3],
            residual: self.residual,
            points: self.points,
        }
    }
}

/// How a sensor stands on the floor, by many scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Height above the floor, m.
    pub height: f64,
    /// Turn about the sensor's forward axis, rad; positive with its left side up.
    pub roll: f64,
    /// Turn about the axis to its left, rad; positive with its front down.
    pub pitch: f64,
    /// Standard deviations of the three, m and rad.
    pub deviations: [f64; 3],
    /// Scans in which there was a floor.
    pub scans: usize,
}

/// From so many scans on, the spread from scan to scan says how well the mean is known.
const SPREAD_SCANS: usize = 8;

/// The mean of several scans. The deviations are those of the mean by the spread from scan to scan, which shows an uneven floor and a
/// swaying vehicle, never less than those by the residuals, and with what a wider band contradicts. None without scans.
#[must_use]
pub fn attitude(stands: &[FloorStand]) -> Option<Attitude> {
    let count = stands.len() as f64;
    let values = |stand: &FloorStand| Vector3::new(stand.height, stand.roll, stand.pitch);
    let mean = stands.iter().map(values).sum::<Vector3<f64>>() / count;
    let squares = |of: &dyn Fn(&FloorStand) -> Vector3<f64>| {
        stands.iter().map(|stand| of(stand).map(|value| value * value)).sum::<Vector3<f64>>()
    };
    let stated = squares(&|stand| Vector3::from(stand.deviations)).map(f64::sqrt) / count;
    let spread = squares(&|stand| values(stand) - mean).map(|sum| (sum / (count - 1.0).max(1.0) / count).sqrt());
    let random = if stands.len() < SPREAD_SCANS { stated } else { spread.sup(&stated) };
    let contradicted = stands.iter().map(|stand| Vector3::from(stand.contradictions)).sum::<Vector3<f64>>() / count;
    let deviations = random.zip_map(&contradicted, f64::hypot);
    let [height, roll, pitch] = mean.into();
    (!stands.is_empty()).then(|| Attitude { height, roll, pitch, deviations: deviations.into(), scans: stands.len() })
}
