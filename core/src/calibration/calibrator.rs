//! Calibration while driving: segments from a stream, in fixed memory.

use heapless::Vec;

use super::outliers::{OutlierFlags, outliers};
use super::segment::{Segment, SegmentBuilder};
use super::{Calibration, Problem, Unobservable, calibrate};
use crate::geometry::Pose;
use crate::measurement::EncoderSample;
use crate::odometry::Tricycle;

/// Segments of a calibration drive, unless stated otherwise: forward and backward, to the left and to the right, eight each (K 5.2.1).
pub const CALIBRATION_SEGMENTS: usize = 32;

/// Why a segment was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibratorError {
    /// There is no room for another segment.
    Full,
    /// The driving wheel has not moved.
    NoMotion,
    /// A value is not finite.
    NotFinite,
}

/// Collects the segments of a drive: at each stop somebody says how the laser has moved since the stop before.
#[derive(Clone, Debug)]
pub struct Calibrator<const SEGMENTS: usize = CALIBRATION_SEGMENTS> {
    builder: SegmentBuilder,
    segments: Vec<Segment, SEGMENTS>,
}

impl<const SEGMENTS: usize> Calibrator<SEGMENTS> {
    /// A calibrator that has seen nothing.
    #[must_use]
    pub const fn new(nominal: Tricycle) -> Self {
        Self { builder: SegmentBuilder::new(nominal), segments: Vec::new() }
    }

    /// Takes the next sample of the encoders.
    pub fn encoders(&mut self, sample: &EncoderSample) {
        self.builder.add(sample);
    }

    /// Ends the segment: S is now at `sensor`, in S at the start of the segment. The next segment begins here.
    ///
    /// # Errors
    /// See [`CalibratorError`]; the segment is then dropped.
    pub fn stop(&mut self, sensor: &Pose) -> Result<(), CalibratorError> {
        let done = self.builder.restart();
        if !done.has_moved() {
            return Err(CalibratorError::NoMotion);
        }
        let segment = done.finish(sensor);
        if !segment.is_finite() {
            return Err(CalibratorError::NotFinite);
        }
        self.segments.push(segment).map_err(|_| CalibratorError::Full)
    }

    /// The segments so far.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// What the segments so far say of the vehicle.
    ///
    /// # Errors
    /// [`Unobservable`].
    pub fn solve(&self, problem: &Problem) -> Result<Calibration, Unobservable> {
        calibrate(&self.segments, problem)
    }

    /// The same without the segments that disagree with the others.
    ///
    /// # Errors
    /// [`Unobservable`].
    pub fn solve_robustly(&self, problem: &Problem) -> Result<(Calibration, OutlierFlags<SEGMENTS>), Unobservable> {
        outliers(&self.segments, problem)
    }
}
