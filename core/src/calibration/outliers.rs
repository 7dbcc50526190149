//! Segments that do not agree with the others.

use heapless::Vec;

use super::segment::Segment;
use super::{Calibration, Problem, Unobservable, calibrate};

/// One flag a segment: whether it disagrees with the others.
pub type OutlierFlags<const SEGMENTS: usize> = Vec<bool, SEGMENTS>;

/// Residuals this many robust standard deviations from zero disagree.
const THRESHOLD: f64 = 5.0;
/// Median of the absolute value of a normal number, and of the length of a normal vector in the plane.
const MEDIAN_OF_NORMAL: f64 = 0.6745;
const MEDIAN_OF_RAYLEIGH: f64 = 1.1774;
/// Smallest deviations that count, rad and m: differences below are no fault of a segment.
const SMALLEST_ROTATION: f64 = 2e-5;
const SMALLEST_POSITION: f64 = 2e-5;

fn median<const SEGMENTS: usize>(mut values: Vec<f64, SEGMENTS>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Solves the problem again and again, each time without the segment that disagrees most, until the rest agrees or half
/// of the segments are gone. Segments beyond `SEGMENTS` are not looked at.
///
/// # Errors
/// [`Unobservable`] of the segments that are left.
pub fn outliers<const SEGMENTS: usize>(
    segments: &[Segment],
    problem: &Problem,
) -> Result<(Calibration, OutlierFlags<SEGMENTS>), Unobservable> {
    let segments = segments.get(..segments.len().min(SEGMENTS)).unwrap_or(segments);
    let mut flags = OutlierFlags::<SEGMENTS>::new();
    let mut kept = Vec::<Segment, SEGMENTS>::new();
    for segment in segments {
        let _ = flags.push(false);
        let _ = kept.push(*segment);
    }
    let mut calibration = calibrate(&kept, problem)?;
    for _ in 0..segments.len() / 2 {
        let residuals = |segment: &Segment| {
            let position = calibration.extrinsic.residual(segment, &calibration.intrinsic, calibration.wheelbase);
            (libm::fabs(calibration.intrinsic.residual(segment)), position.norm())
        };
        let rotation = median(kept.iter().map(|segment| residuals(segment).0).collect::<Vec<_, SEGMENTS>>());
        let position = median(kept.iter().map(|segment| residuals(segment).1).collect::<Vec<_, SEGMENTS>>());
        let rotation = (rotation / MEDIAN_OF_NORMAL).max(SMALLEST_ROTATION);
        let position = (position / MEDIAN_OF_RAYLEIGH).max(SMALLEST_POSITION);
        let excess = |segment: &Segment| {
            let (turned, moved) = residuals(segment);
            (turned / rotation).max(moved / position)
        };
        let worst = segments
            .iter()
            .enumerate()
            .filter(|(index, _)| flags.get(*index) == Some(&false))
            .map(|(index, segment)| (index, excess(segment)))
            .max_by(|first, second| first.1.total_cmp(&second.1));
        let Some((index, _)) = worst.filter(|worst| worst.1 > THRESHOLD) else { break };
        kept.clear();
        let mut without = flags.clone();
        if let Some(flag) = without.get_mut(index) {
            *flag = true;
        }
        for (segment, is_outlier) in segments.iter().zip(&without) {
            if !is_outlier {
                let _ = kept.push(*segment);
            }
        }
        calibration = calibrate(&kept, problem)?;
        flags = without;
    }
    Ok((calibration, flags))
}
