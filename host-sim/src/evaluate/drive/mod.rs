//! One replayed drive: its figures and its report.

mod figures;
mod track;

pub use figures::{Accuracy, Figures, Innovations, KINDS, MODES, ModeChange, ModeTime, ObservationCounts};
pub use track::{Standard, Track, TrackError, TrackPoint};
