//! Recognition of places on the laser logs of the thesis (K 4.2): which pairs count, what is asked, and how good the
//! answers are.

mod chain;
mod described;
mod figures;
mod protocol;

pub use chain::{Answer, CANDIDATES, Memory, Method, PLACES, associate, tables};
pub use described::DescribedScan;
pub use figures::{CurvePoint, Figures, Judged, figures};
pub use protocol::{Mode, Protocol, is_right};
