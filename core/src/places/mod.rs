//! Where am I with no prior?
//!
//! A signature of the keypoints of a scan selects stored places (K 4.1.1), association of the keypoints gives the pose in
//! each (K 4.1.2, 4.1.3), and the scan itself decides. Reflectors, which look alike, are found by their distances.

mod alignment;
mod beam_lookup;
mod correspondence;
mod correspondence_graph;
mod glare;
mod hough;
mod maximum_clique;
mod place_index;
mod random_sample;
mod recognition;
mod reflectors;
mod scan_alignment;
mod scan_overlap;
mod surface_alignment;
mod surface_relations;
mod surface_scan;

pub use alignment::{Alignment, align};
pub use correspondence::{Correspondence, common_points, refine};
pub use correspondence_graph::{Compatibility, CorrespondenceGraph};
pub use glare::{Glare, GlareParameters, GlareTables};
pub use hough::{AffineHough, HoughParameters};
pub use maximum_clique::Clique;
pub use place_index::{Candidate, PlaceIndex};
pub use random_sample::{RandomSample, RandomSampleParameters};
pub use recognition::{PlaceView, Recognition, RecognitionParameters, Recognizer};
pub use reflectors::{
    IndexedReflectors, ReflectorAnswer, ReflectorFix, ReflectorIndex, ReflectorNoise, ReflectorRelocalizer,
    ReflectorSnapshot, RelocalizationParameters, RelocalizationProgress, SeenReflector,
};
pub use scan_alignment::{ScanAlignment, ScanAlignmentParameters, align_scans};
pub use scan_overlap::{Overlap, OverlapParameters, overlap};
pub use surface_alignment::{SurfaceAlignmentParameters, align_to_surfaces};
pub use surface_relations::surface_normal;
pub use surface_scan::{Surface, SurfaceParameters, SurfaceScan};
