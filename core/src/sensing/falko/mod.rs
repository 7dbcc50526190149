//! FALKO: corners of a scan (K 3.1), mended where the printed detector slides along gaps, and ends of faces.
//!
//! A point of the scan is a candidate if a triangle through it and the two ends of its neighbourhood is neither flat nor
//! narrow; among candidates close to each other the one with the straightest sides is kept, and the intersection of
//! lines through both sides gives its position between the beams.
//!
//! Corrections of the printed text: absent returns are never neighbours; neighbourhoods of a full circle cross the seam;
//! tan^-1 of a quotient (3.5, 3.6) is the direction of a vector; mod (3.7) is never negative; the sums 3.8 and 3.9 run
//! over counts of sectors. The printed sectors are measured from the sensor's first axis, so keypoints would depend on
//! the sensor's heading; here they are measured from the corner's own orientation (K 3.2.3), which turns with it.

mod candidates;
mod corner;
mod detector;
mod end_point;
mod parameters;
mod runs;
mod score;
mod suppression;

pub use detector::Detector;
pub use parameters::{EndPointParameters, LineGate, Parameters, SuppressionRule};
pub use score::{PairSum, Sectors};
