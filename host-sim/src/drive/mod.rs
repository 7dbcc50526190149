//! One replayed drive: its figures and its report.

mod figures;
mod fitness;
mod health;
mod names;
mod pictures;
mod report;
mod side_by_side;
mod tables;
mod track;

pub use figures::{Accuracy, Figures, Innovations, KINDS, MODES, ModeChange, ModeTime, ObservationCounts};
pub use fitness::{Fitness, GOOD, Grade, percent};
pub use health::health_rows;
pub use names::{kind_name, mode_name, mode_name_of_drive, reason_name};
pub use pictures::{add_pictures, heading_error_chart, heading_error_line, position_error_chart, position_error_line};
pub use report::add_drive;
pub use side_by_side::{ReplayedDrive, report_page};
pub use tables::{figure_rows, parameter_rows};
pub use track::{Standard, Track, TrackError, TrackPoint, way_steps};
