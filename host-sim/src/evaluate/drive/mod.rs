//! One replayed drive: its figures and its report.

mod figures;
mod names;
mod pictures;
mod report;
mod tables;
mod track;

pub use figures::{Accuracy, Figures, Innovations, KINDS, MODES, ModeChange, ModeTime, ObservationCounts};
pub use names::{kind_name, mode_name, reason_name};
pub use pictures::{add_pictures, heading_error_chart, heading_error_line, position_error_chart, position_error_line};
pub use report::add_drive;
pub use tables::{figure_rows, parameter_rows};
pub use track::{Standard, Track, TrackError, TrackPoint};
