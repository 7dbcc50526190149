//! Deviations of a closed form under a noise model: its answer to the errors of each window, by finite differences.
//!
//! Errors of rotation and of translation of one window come from the same slip, steering angle and stops. The core, which
//! stores no windows, takes them as independent; here they are not.

use agv_core::calibration::{Calibration, Problem, Segment, Unobservable, calibrate};
use agv_core::geometry::wrap;
use nalgebra::{SMatrix, SVector, Vector2};

use super::noise::{Disturbances, NoiseModel};
use super::window::Window;

/// What a closed form finds: offsets, drive scale, wheelbase, laser x, y, heading, and the wheelbase that is suggested.
const RESULTS: usize = 8;

type Results = SVector<f64, RESULTS>;

fn results(calibration: &Calibration) -> Results {
    let (intrinsic, extrinsic) = (&calibration.intrinsic, &calibration.extrinsic);
    Results::from([
        intrinsic.offset_forward,
        intrinsic.offset_backward,
        calibration.drive_scale(),
        calibration.wheelbase,
        extrinsic.laser.x,
        extrinsic.laser.y,
        extrinsic.laser.theta,
        extrinsic.wheelbase,
    ])
}

/// Change of a motion's coordinate from which derivatives are taken, m or rad.
const STEP: f64 = 1e-6;

fn answer(segments: &[Segment], index: usize, problem: &Problem) -> Result<SMatrix<f64, RESULTS, 3>, Unobservable> {
    let mut answer = SMatrix::<f64, RESULTS, 3>::zeros();
    for coordinate in 0..3 {
        let moved = |step: f64| {
            let mut segments = segments.to_vec();
            if let Some(segment) = segments.get_mut(index) {
                match coordinate {
                    0 => segment.sensor += Vector2::new(step, 0.0),
                    1 => segment.sensor += Vector2::new(0.0, step),
                    _ => segment.rotation += step,
                }
            }
            calibrate(&segments, problem).map(|found| results(&found))
        };
        let mut change = moved(STEP)? - moved(-STEP)?;
        change[6] = wrap(change[6]);
        answer.set_column(coordinate, &(change / (2.0 * STEP)));
    }
    Ok(answer)
}

/// Standard deviations of offsets, drive scale, wheelbase, laser x, y, heading and suggested wheelbase.
///
/// # Errors
/// [`Unobservable`] if the segments are at the edge of what can be solved.
pub fn closed_form_deviations(
    windows: &[Window],
    segments: &[Segment],
    problem: &Problem,
    disturbed: &[Disturbances],
    noise: &NoiseModel,
) -> Result<[f64; RESULTS], Unobservable> {
    let mut covariance = SMatrix::<f64, RESULTS, RESULTS>::zeros();
    let mut last: Option<(SMatrix<f64, RESULTS, 3>, &Window)> = None;
    for (index, (window, disturbances)) in windows.iter().zip(disturbed).enumerate() {
        let here = answer(segments, index, problem)?;
        covariance += here * disturbances.covariance(noise) * here.transpose();
        if let Some((there, before)) = last {
            let shared = here * window.covariance_with(before) * there.transpose() * noise.laser.powi(2);
            covariance += shared + shared.transpose();
        }
        last = Some((here, window));
    }
    Ok(std::array::from_fn(|index| covariance[(index, index)].max(0.0).sqrt()))
}
