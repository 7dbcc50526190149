//! Orthogonal corners (OC; K 1.2.2, 3.2.3): where two surfaces meet that run along the two dominant directions of a scan.
//!
//! The thesis's second detector, for comparison: it supposes a building of right angles. The dominant direction comes from
//! the Hough spectrum of all points; pieces of surface along it and across it are runs of neighbouring returns whose
//! coordinate in the turned frame stays the same.

mod detector;
mod hough_spectrum;
mod parameters;
mod surface_run;

pub use detector::OrthogonalCorners;
pub use hough_spectrum::HoughSpectrum;
pub use parameters::OrthogonalCornerParameters;
