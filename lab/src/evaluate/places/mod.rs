//! Recognition of places on the laser logs of the thesis (K 4.2): which pairs count, what is asked, and how good the
//! answers are.

mod chain;
mod described;
mod experiment;
mod figures;
mod pictures;
mod protocol;

pub use chain::{Answer, CANDIDATES, LEAST_CONFIDENCE, Memory, Method, PLACES, tables};
pub use described::DescribedScan;
pub use experiment::{Combination, Experiment, Outcome};
pub use figures::{CurvePoint, Figures, Judged, figures};
pub use pictures::page;
pub use protocol::{Mode, Protocol, is_right};
