//! Places that are recognised again by their scans, without a prior pose: what a desktop does with a map of places.
//!
//! A signature of the keypoints of a scan selects stored places (K 4.1.1), association of the keypoints gives the pose in
//! each (K 4.1.2, 4.1.3), and the scan itself decides. Descriptors of keypoints and the detector of orthogonal corners that
//! the thesis compares are here, too.
#![no_std]
#![forbid(unsafe_code)]

mod beam_lookup;
mod binary_shape_context;
mod correspondence;
mod correspondence_graph;
mod cumulative_gaussian_histogram;
mod glare;
mod hough;
mod maximum_clique;
mod orthogonal_corners;
mod place_index;
mod random_sample;
mod recognition;
mod scan_alignment;
mod scan_overlap;
mod surface_relations;

pub use binary_shape_context::BinaryShapeContext;
pub use correspondence::{Correspondence, common_points, refine};
pub use correspondence_graph::{Compatibility, CorrespondenceGraph};
pub use cumulative_gaussian_histogram::{CumulativeGaussianHistogram, Kernel};
pub use glare::{Glare, GlareParameters, GlareTables};
pub use hough::{AffineHough, HoughParameters};
pub use maximum_clique::Clique;
pub use orthogonal_corners::{HoughSpectrum, OrthogonalCornerParameters, OrthogonalCorners};
pub use place_index::{Candidate, PlaceIndex};
pub use random_sample::{RandomSample, RandomSampleParameters};
pub use recognition::{PlaceView, Recognition, RecognitionParameters, Recognizer};
pub use scan_alignment::{ScanAlignmentParameters, align_scans};
pub use scan_overlap::{Overlap, OverlapParameters, overlap};
pub use surface_relations::surface_normal;
